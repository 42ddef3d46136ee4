"""Bearing forces over the conditions, and whether they do what Fig. 10 of the paper shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import GearState
from tdacoustic.gears import DIRECTIONS, GEARS
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.sections.gear_words import DIRECTION_SLOTS, first_harmonic_n, hertz, newtons, sentence
from tdacoustic.reporting.sections.printed import PAPER
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction

__all__ = ["largest_words", "loads_over_speed", "rise_words"]

FEWEST = 3
"""Speeds below which nothing can rise and then fall."""

FEATURES = (
    f"Fig. 10 of {PAPER} shows three features: the tangential force (y) is the largest, all directions follow the "
    "same pattern, and the forces rise and then fall as the mesh frequency grows. Whether this drive does the same, at "
    "the line of the mesh frequency:"
)


def loads_over_speed(result: FleetPrediction, loaded: Sequence[GearState]) -> Section:
    """Return the section on forces over the conditions.

    Parameters
    ----------
    result : FleetPrediction
    loaded : sequence of GearState
        The conditions with a force, by speed.
    """
    first = _over_conditions(loaded)
    figures = [FigureBlock(_figure(loaded, first, gear), "calculated") for gear in range(len(GEARS))]
    blocks: list[Block] = [
        *(figures if len(loaded) > 1 else ()),
        Paragraph(FEATURES),
        Sentences([sentence(largest_words(loaded))]),
        _features(loaded, first),
        _table(loaded, first, "forces-first", "Amplitude of the first mesh harmonic"),
        Details(
            "Rms of all lines, and mean forces",
            [
                _table(loaded, np.stack([s.forces.rms_n() for s in loaded], -1), "forces-rms", "Rms of all lines"),
                _table(loaded, np.stack([s.forces.mean_n for s in loaded], -1), "forces-mean", "Mean forces, signed"),
            ],
        ),
    ]
    return Section("forces-over-conditions", "Over the conditions", blocks)


def _over_conditions(loaded: Sequence[GearState]) -> NDArray[np.float64]:
    """Amplitudes of the first mesh harmonic, shape (2, 3, conditions)."""
    return np.stack([first_harmonic_n(state) for state in loaded], -1)


def _figure(loaded: Sequence[GearState], first: NDArray[np.float64], gear: int) -> Figure:
    mesh = np.array([state.mesh_hz for state in loaded])
    lines = [
        Line(mesh, first[gear, number], direction, color=DIRECTION_SLOTS[direction], points=True)
        for number, direction in enumerate(DIRECTIONS)
    ]
    return Figure(
        f"forces-{GEARS[gear]}",
        f"First mesh harmonic of the forces on the bearings of the {GEARS[gear]} over the conditions",
        "One dot a condition; the lines between them only lead the eye.",
        Axis("Mesh frequency", "Hz"),
        Axis("Force", "N", "log", note="peak amplitude"),
        lines,
        height=360,
    )


def largest_words(loaded: Sequence[GearState]) -> str:
    """Say in how many conditions the y force is the largest, by gear, at the mesh frequency and in all lines."""
    first, whole = _y_is_largest(_over_conditions(loaded)), _y_is_largest(_rms(loaded))
    counts = [
        joined([f"{count} of {len(loaded)} conditions ({gear})" for count, gear in zip(counted, GEARS, strict=True)])
        for counted in (first, whole)
    ]
    overall = "met" if min(first + whole) == len(loaded) else "met in part" if max(first + whole) else "not met"
    if first == whole:
        where = f"both at the mesh frequency and by the rms of all lines in {counts[0]}"
    else:
        where = f"at the mesh frequency in {counts[0]}, by the rms of all lines in {counts[1]}"
    return f"the y force is the largest: {overall}, {where}"


def _y_is_largest(values: NDArray[np.float64]) -> list[int]:
    """Number of conditions, by gear."""
    tangential = DIRECTIONS.index("y")
    return [int((of_gear.argmax(axis=0) == tangential).sum()) for of_gear in values]


def _rms(loaded: Sequence[GearState]) -> NDArray[np.float64]:
    return np.stack([state.forces.rms_n() for state in loaded], -1)


def rise_words(loaded: Sequence[GearState]) -> str:
    """Say for how many gears and directions the first mesh harmonic rises and then falls."""
    verdicts = {
        f"{gear} {direction}": _rise_and_fall(loaded, values)[0]
        for gear, of_gear in zip(GEARS, _over_conditions(loaded), strict=True)
        for direction, values in zip(DIRECTIONS, of_gear, strict=True)
    }
    if "" in verdicts.values():
        return f"fewer than {FEWEST} speeds, so nothing can be said of forces that rise and then fall"
    met = [name for name, verdict in verdicts.items() if verdict == "met"]
    missed = [name for name in verdicts if name not in met]
    named = [f"met at {joined(met)}" if missed else "met at all"] if met else []
    named += [f"not met at {joined(missed)}" if met else "not met at any"] if missed else []
    return f"the forces at the mesh frequency rise and then fall over the speeds: {'; '.join(named)}"


def _rise_and_fall(loaded: Sequence[GearState], values: NDArray[np.float64]) -> tuple[str, str]:
    """Verdict, empty where it cannot be judged, and the figures behind it."""
    mesh, places = np.unique([state.mesh_hz for state in loaded], return_index=True)
    values = values[places]
    listed = ", ".join(newtons(value) for value in values)
    if mesh.size < FEWEST:
        return "", f"{listed}: at least {FEWEST} speeds are needed"
    steps, peak = np.diff(values), int(values.argmax())
    start, top, end = (f"{newtons(values[at])} at {hertz(mesh[at])}" for at in (0, peak, -1))
    if (steps[:peak] > 0.0).all() and (steps[peak:] < 0.0).all():
        if 0 < peak < values.size - 1:
            return "met", f"from {start} up to {top}, then down to {end}"
        return "not met", f"{'rises' if peak else 'falls'} throughout, from {start} to {end}"
    return "not met", f"up and down: {listed}; largest {top}"


def _features(loaded: Sequence[GearState], first: NDArray[np.float64]) -> Table:
    rows: list[list[Cell]] = []
    for gear, name in enumerate(GEARS):
        for number, direction in enumerate(DIRECTIONS):
            verdict, figures = _rise_and_fall(loaded, first[gear, number])
            rows.append(["Rises, then falls", name, direction, verdict or "not judged", figures])
        peaks = first[gear].argmax(axis=1)
        where = [f"{d} at {hertz(loaded[int(at)].mesh_hz)}" for d, at in zip(DIRECTIONS, peaks, strict=True)]
        verdict = "not judged" if len(loaded) < FEWEST else "met" if np.unique(peaks).size == 1 else "not met"
        rows.append(["All directions peak together", name, "all", verdict, f"largest: {', '.join(where)}"])
    columns = (
        Column("feature", "Feature"),
        Column("gear", "Gear"),
        Column("direction", "Direction"),
        Column("verdict", "Verdict", kind="verdict"),
        Column("figures", "Figures, conditions by rising mesh frequency"),
    )
    return Table("force-features", "Features of Fig. 10, met or not", columns, rows, origin="calculated")


def _table(loaded: Sequence[GearState], values: NDArray[np.float64], name: str, caption: str) -> Table:
    forces = [
        Column(f"{gear}_{direction}_n", f"{gear.capitalize()} {direction}", "N", 1, "number")
        for gear in GEARS
        for direction in DIRECTIONS
    ]
    columns = [Column("condition", "Condition"), Column("mesh_frequency_hz", "Mesh", "Hz", 1, "number"), *forces]
    rows: list[list[Cell]] = [
        [state.condition.name, state.mesh_hz, *values[:, :, index].ravel().tolist()]
        for index, state in enumerate(loaded)
    ]
    return Table(name, caption, columns, rows, origin="calculated")
