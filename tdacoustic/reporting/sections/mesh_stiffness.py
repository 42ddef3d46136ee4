"""The stiffness of the mesh over the mesh period."""

from __future__ import annotations

import numpy as np

from tdacoustic.reporting.document import FigureBlock, Paragraph, Section
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.gear_words import significant
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction

__all__ = ["mesh_stiffness"]

PERIODS = 2
SAMPLES = 512
"""Of a mesh period."""
HARMONICS = 4


def mesh_stiffness(result: FleetPrediction) -> Section:
    """Return the section on the stiffness of the mesh over time."""
    system = result.prediction.unit.system
    lines = system.contact_lines
    time = np.arange(PERIODS * SAMPLES + 1) / SAMPLES
    relative = lines.relative(time)
    mean = 1e-6 * system.mesh_stiffness_n_per_m
    figure = Figure(
        "mesh-stiffness",
        say("Stiffness of the mesh over two mesh periods"),
        say("Along the normal line of action. The axis does not begin at zero."),
        Axis(say("Time"), say("mesh periods")),
        Axis(say("Mesh stiffness"), "N/µm"),
        [
            Line(time, mean * relative, "k_m(t)"),
            Line(time[[0, -1]], np.array([mean, mean]), say("mean"), style="dashed", color=7),
        ],
        height=340,
    )
    words = say(
        "The stiffness follows the total length of the contact lines: a trapezoid on each pair of teeth, from the two "
        "contact ratios (equations (4) to (6) of the paper), times the mean stiffness. How stiff a tooth is along its "
        "height, and how the load is shared, is not part of it."
    )
    return Section(
        "mesh-stiffness", say("Mesh stiffness"), [Paragraph(words), FigureBlock(figure, "calculated"), _ripple(result)]
    )


def _ripple(result: FleetPrediction) -> Paragraph:
    lines = result.prediction.unit.system.contact_lines
    if lines.is_constant:
        return Paragraph(
            say("A contact ratio is a whole number, so the total length and with it the stiffness is constant.")
        )
    amplitudes = 200.0 * np.abs(lines.fourier(HARMONICS)[1:])
    values = lines.relative(np.arange(SAMPLES) / SAMPLES)
    harmonics = [f"{significant(value, 2)} % (x{n})" for n, value in enumerate(amplitudes, 1)]
    return Paragraph(
        say(
            "It varies by {percent} % of its mean peak to peak. Amplitudes of the mesh "
            "harmonics, of the mean: {harmonics}. With the transmission error this is what excites "
            "the vibration; the closer a contact ratio is to a whole number, the less of it there is.",
            percent=significant(100.0 * float(np.ptp(values)), 3),
            harmonics=joined(harmonics),
        )
    )
