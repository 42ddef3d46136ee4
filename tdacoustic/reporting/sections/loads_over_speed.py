"""Bearing forces over the conditions: where they are largest, and how they go with speed.

Whether that is what another source says is judged in one place, by the fleet's ``[[feature]]``: here are the figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import GearState
from tdacoustic.fleet.studies import FLAT_DB
from tdacoustic.gears import DIRECTIONS, GEARS
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import (
    DIRECTION_SLOTS,
    begun_large,
    first_harmonic_n,
    gear_word,
    hertz,
    newtons,
    sentence,
)
from tdacoustic.reporting.sections.paper_features import judged_words
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction
from tdacoustic.studies.shapes import shape_of

__all__ = ["largest_words", "loads_over_speed", "rise_words"]

FEWEST = 3
"""Speeds below which nothing can rise and then fall."""

COURSES: Final = {
    "flat": mark("stays the same"),
    "rises": mark("rises"),
    "falls": mark("falls"),
    "rises_then_falls": mark("rises, then falls"),
    None: mark("up and down"),
}
"""Shapes of `shape_of` in words."""


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
        Sentences([sentence(text) for text in (largest_words(loaded), judged_words(result, ("_force_",))) if text]),
        _courses(loaded, first),
        _table(loaded, first, "forces-first", say("Amplitude of the first mesh harmonic")),
        Details(
            say("Rms of all lines, and mean forces"),
            [
                _table(loaded, np.stack([s.forces.rms_n() for s in loaded], -1), "forces-rms", say("Rms of all lines")),
                _table(
                    loaded, np.stack([s.forces.mean_n for s in loaded], -1), "forces-mean", say("Mean forces, signed")
                ),
            ],
        ),
    ]
    return Section("forces-over-conditions", say("Over the conditions"), blocks)


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
        say(
            "First mesh harmonic of the forces on the bearings of the {gear} over the conditions",
            gear=gear_word(GEARS[gear]),
        ),
        say("One dot a condition; the lines between them only lead the eye."),
        Axis(say("Mesh frequency"), "Hz"),
        Axis(say("Force"), "N", "log", note=say("peak amplitude")),
        lines,
        height=360,
    )


def largest_words(loaded: Sequence[GearState]) -> str:
    """Say in how many conditions the y force is the largest, by gear, at the mesh frequency and in all lines."""
    first, whole = _y_is_largest(_over_conditions(loaded)), _y_is_largest(_rms(loaded))
    counts = [
        joined(
            [
                say("{count} of {all} conditions ({gear})", count=count, all=len(loaded), gear=gear_word(gear))
                for count, gear in zip(counted, GEARS, strict=True)
            ]
        )
        for counted in (first, whole)
    ]
    if first == whole:
        return say(
            "the tangential force (y) is the largest of the three both at the mesh frequency and by the rms of all "
            "lines in {counts}",
            counts=counts[0],
        )
    return say(
        "the tangential force (y) is the largest of the three at the mesh frequency in {counts_at_mesh}, by the rms of "
        "all lines in {counts_by_rms}",
        counts_at_mesh=counts[0],
        counts_by_rms=counts[1],
    )


def _y_is_largest(values: NDArray[np.float64]) -> list[int]:
    """Number of conditions, by gear."""
    tangential = DIRECTIONS.index("y")
    return [int((of_gear.argmax(axis=0) == tangential).sum()) for of_gear in values]


def _rms(loaded: Sequence[GearState]) -> NDArray[np.float64]:
    return np.stack([state.forces.rms_n() for state in loaded], -1)


def rise_words(loaded: Sequence[GearState]) -> str:
    """Say for which gears and directions the first mesh harmonic rises, then falls; empty of too few speeds."""
    courses = {
        f"{gear_word(gear)} {direction}": _course(loaded, values)[0]
        for gear, of_gear in zip(GEARS, _over_conditions(loaded), strict=True)
        for direction, values in zip(DIRECTIONS, of_gear, strict=True)
    }
    if "" in courses.values():
        return ""
    there = [name for name, course in courses.items() if course == say(COURSES["rises_then_falls"])]
    others = [name for name in courses if name not in there]
    if not there:
        return say("no force at the mesh frequency rises, then falls over the speeds")
    if not others:
        return say("the force at the mesh frequency rises, then falls over the speeds in every direction")
    return say(
        "the force at the mesh frequency rises, then falls over the speeds at {forces}, not at {others}",
        forces=joined(there),
        others=joined(others),
    )


def _course(loaded: Sequence[GearState], values: NDArray[np.float64]) -> tuple[str, str]:
    """How a force goes over the speeds, empty of too few of them, and the figures behind it."""
    mesh, places = np.unique([state.mesh_hz for state in loaded], return_index=True)
    values = values[places]
    listed = ", ".join(newtons(value) for value in values)
    if mesh.size < FEWEST:
        return "", say("{forces}: at least {fewest} speeds are needed", forces=listed, fewest=FEWEST)
    with np.errstate(divide="ignore"):
        shape = shape_of(20.0 * np.log10(values), FLAT_DB)
    start, top, end = (
        say("{force} at {frequency}", force=newtons(values[at]), frequency=hertz(mesh[at]))
        for at in (0, int(values.argmax()), -1)
    )
    figures = {
        "rises_then_falls": say("from {start} up to {top}, then down to {end}", start=start, top=top, end=end),
        None: say("{forces}; largest {top}", forces=listed, top=top),
    }
    return say(COURSES[shape]), figures.get(shape, say("from {start} to {end}", start=start, end=end))


def _courses(loaded: Sequence[GearState], first: NDArray[np.float64]) -> Table:
    rows: list[list[Cell]] = []
    for gear, name in enumerate(GEARS):
        for number, direction in enumerate(DIRECTIONS):
            course, figures = _course(loaded, first[gear, number])
            rows.append([gear_word(name), direction, course, figures])
    columns = (
        Column("gear", say("Gear")),
        Column("direction", say("Direction")),
        Column("course", say("With speed")),
        Column("figures", say("Figures, conditions by rising mesh frequency")),
    )
    caption = say(
        "How the forces at the mesh frequency go with speed; {change:g} dB up or down count as level", change=FLAT_DB
    )
    return Table("force-courses", caption, columns, rows, origin="calculated")


def _table(loaded: Sequence[GearState], values: NDArray[np.float64], name: str, caption: str) -> Table:
    forces = [
        Column(f"{gear}_{direction}_n", f"{begun_large(gear_word(gear))} {direction}", "N", 1, "number")
        for gear in GEARS
        for direction in DIRECTIONS
    ]
    columns = [
        Column("condition", say("Condition")),
        Column("mesh_frequency_hz", say("Mesh"), "Hz", 1, "number"),
        *forces,
    ]
    rows: list[list[Cell]] = [
        [state.condition.name, state.mesh_hz, *values[:, :, index].ravel().tolist()]
        for index, state in enumerate(loaded)
    ]
    return Table(name, caption, columns, rows, origin="calculated")
