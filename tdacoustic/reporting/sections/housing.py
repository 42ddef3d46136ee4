"""The housing that the bearing forces shake: what it is, where it stands, and what its computation leaves out."""

from __future__ import annotations

from typing import Final

import numpy as np

from tdacoustic.drive import HousingFacts
from tdacoustic.gears import GEARS
from tdacoustic.reporting.document import Block, Details, Fact, Facts, FigureBlock, Paragraph, Section, Sentences
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Rule
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import gear_word
from tdacoustic.reporting.sections.housing_parameters import HOUSING_SECTIONS, housing_named
from tdacoustic.reporting.sections.parameters import parameter_table
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["housing_section"]

FIRST_MODES: Final = 10
"""Natural frequencies that are named one by one."""

METHOD = mark(
    "The gears stand in a closed welded box of plates with four bearing seats, on soft springs at the seats and at a "
    "hanger. Its modes come from finite elements; the sound of each mode, and of point sources beside the rigid box, "
    "comes from boundary elements, once for all conditions, helix angles and loss factors."
)
FRAMES = mark(
    "The gears' x points from the pinion to the wheel, their z to the right (−y of the drive), so that a positive "
    "torque is traction forward. In the drive's frame x is the direction of travel, y is to the left, z is up; 0, 0, 0 "
    "is the drive's centre."
)
TWO_WAY = mark(
    "The coupling is two-way: the bearing seats give way under the gears, and the bearing forces are those on a "
    "housing that moves."
)
ONE_WAY = mark(
    "The coupling is one-way: the bearing forces are those on a foundation that does not move, and the housing does "
    "not act back on the gears. Around 500 Hz panel, seat and bearing have impedances of one size, so a single "
    "direction of force, the axial one above all, may be off by several dB."
)
METHOD_STEP = mark(
    "The gears stand in the housing of a STEP file: one closed hollow solid of one material, on soft springs at its "
    "bearing seats and at a hanger. Its modes come from finite elements (curved tetrahedra of order 4); the sound of "
    "each mode, and of point sources beside the rigid housing, comes from boundary elements on flat panels over its "
    "outside, once for all conditions, helix angles and loss factors."
)
LEFT_OUT_STEP = mark(
    "Joints and screws of the housing are left out, and so are oil and gears in it and the air inside. The motor's "
    "body, wheels, bogie and car body neither radiate nor scatter."
)
LEFT_OUT = mark(
    "Ribs, flanges, bores and joints of the housing are left out, and so are oil and gears in it and the air inside. "
    "The motor's body, wheels, bogie and car body neither radiate nor scatter."
)


def housing_section(result: FleetPrediction) -> Section | None:
    """Return the section on the housing; None where no housing is computed."""
    housing = result.prediction.housing
    if housing is None:
        return None
    is_box = housing.step_file is None
    blocks: list[Block] = [Paragraph(say(METHOD) if is_box else say(METHOD_STEP)), Facts(_facts(housing))]
    if len(housing.mode_hz):
        blocks.append(FigureBlock(_figure(result, housing), "calculated"))
    words = [
        say(FRAMES),
        _split_words(housing),
        _coupling_words(result),
        say(LEFT_OUT) if is_box else say(LEFT_OUT_STEP),
    ]
    blocks.append(Sentences([*housing.notes, *words]))
    blocks.append(_parameters(result))
    return Section("housing", say("The housing"), blocks)


def _facts(housing: HousingFacts) -> list[Fact]:
    low, high = housing.range_hz
    modes = housing.mode_hz
    below = int(np.count_nonzero(modes <= high))
    first = [f"{value:.1f}" for value in modes[:FIRST_MODES]]
    facts = [] if housing.step_file is None else [Fact(say("From the STEP file"), housing.step_file)]
    facts += [
        Fact(say("Mass"), say("{mass:.0f} kg, of the finite elements", mass=housing.mass_kg)),
        Fact(say("Frequency range"), say("{low:.0f} to {high:.0f} Hz", low=low, high=high)),
        Fact(
            say("Modes"),
            say(
                "{count} with natural frequencies up to {highest:.0f} Hz; kept are {kept} and {shapes} shapes of a "
                "static correction, which stand for the modes beyond",
                count=below,
                highest=high,
                kept=len(modes),
                shapes=housing.corrections,
            ),
        ),
        Fact(say("First natural frequencies"), f"{', '.join(first)}{', ...' if len(modes) > FIRST_MODES else ''} Hz"),
        Fact(say("Middle of the housing"), _place(housing.position_m)),
        Fact(say("Source of the meshing noise"), _place(housing.mesh_m)),
    ]
    if housing.motor_m is not None:
        facts.append(Fact(say("Sources of the motor"), _place(housing.motor_m)))
    return facts


def _place(position_m: tuple[float, float, float]) -> str:
    x, y, z = (pretty_signs(f"{value:.4g}") for value in position_m)
    return say("x {x}, y {y}, z {z} m in the drive's frame", x=x, y=y, z=z)


def _split_words(housing: HousingFacts) -> str:
    shares = [100.0 * share for share in housing.left_share]
    if abs(shares[0] - shares[1]) < 0.05:
        of_left = say("{share:.3g} % of the force of either gear", share=shares[0])
    else:
        of_left = joined(
            [
                say("{share:.3g} % of that of the {gear}", share=share, gear=gear_word(gear))
                for share, gear in zip(shares, GEARS, strict=True)
            ]
        )
    return say(
        "A gear's bearing force, which the gear model has as a total, is split between its two "
        "bearings by the lever rule for where the gear stands on its shaft: the left bearing "
        "takes {shares}, the right one the rest. So is the axial force, which in truth one "
        "bearing may hold alone and which tilts it.",
        shares=of_left,
    )


def _coupling_words(result: FleetPrediction) -> str:
    return say(TWO_WAY) if result.fleet.model.coupling.value == "two_way" else say(ONE_WAY)


def _figure(result: FleetPrediction, housing: HousingFacts) -> Figure:
    """The number of modes up to a frequency, with the mesh frequencies of the conditions."""
    high = housing.range_hz[1]
    modes = np.sort(housing.mode_hz[housing.mode_hz <= high])
    x = np.concatenate([[0.0], np.repeat(modes, 2), [high]])
    y = np.repeat(np.arange(modes.size + 1.0), 2)
    elements: list[Element] = [Line(x, y, say("modes"))]
    elements += [
        Rule(state.mesh_hz, state.condition.name) for state in result.prediction.conditions if state.mesh_hz <= high
    ]
    return Figure(
        "housing-modes",
        say("Modes of the housing up to a frequency"),
        say("Vertical lines: the mesh frequencies of the conditions."),
        Axis(say("Frequency"), "Hz", limits=(0.0, high)),
        Axis(say("Number of modes")),
        elements,
        height=280,
    )


def _parameters(result: FleetPrediction) -> Details:
    fleet = result.fleet
    caption = say("Parameters of the housing and of the sound field, from the fleet file of {name}", name=fleet.name)

    def named(key: str) -> tuple[str, str] | None:
        return housing_named(fleet, key) if key.startswith(HOUSING_SECTIONS) else None

    table = parameter_table("housing-parameters", caption, fleet, named)
    assumed = [row[2] for row in table.rows].count("assumed")
    return Details(
        say(
            "{count} parameters of housing and sound field, {assumed} of them assumed",
            count=len(table.rows),
            assumed=assumed,
        ),
        [table],
    )
