"""Maps of the sound close to the housing."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import NearField
from tdacoustic.drive.near_field import AROUND_HIGHEST_DB, SOURCE_RADIUS_M, PlaneMap
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
from tdacoustic.reporting.figure import Axis, Element, Figure, Heatmap, Line, Markers, Symbol
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.near_field_words import (
    TABLE_PATHS,
    near_field_method,
    near_field_words,
    number_words,
)
from tdacoustic.reporting.sections.sound_paths import PATHS, path_word
from tdacoustic.reporting.sections.words import slug
from tdacoustic.results import FleetPrediction

__all__ = ["near_field_section"]

SHOWN_DB: Final = 40.0
"""Below the highest level outside that counts, down to which the colours reach at most."""
PLACES: Final[dict[Literal["outside", "inside"], Symbol]] = {"outside": "x", "inside": "cross"}
_PLACE_WORDS: Final = {"outside": mark("outside"), "inside": mark("inside")}
_HIGHEST: Final = {"outside": mark("highest level outside"), "inside": mark("highest level inside")}
OUTLINE, HIGHEST = 7, 6
"""Slots of the palette: the housing, and what is said of the highest level."""


def near_field_section(result: FleetPrediction) -> Section | None:
    """Return the section on the maps; None where no condition is mapped."""
    fields = [field for field in result.prediction.maps if field.range_db("outside") is not None]
    if not fields:
        return None
    blocks: list[Block] = [Paragraph(near_field_method(result, fields[0])), Sentences(near_field_words(result, fields))]
    blocks += [FigureBlock(figure, "calculated") for figure in _figures(fields[0])]
    for field in fields[1:]:
        held = [FigureBlock(figure, "calculated") for figure in _figures(field)]
        blocks.append(Details(say("Maps of condition {name}", name=field.condition), held))
    blocks.append(_table(fields))
    return Section("near-field", say("Sound close to the housing"), blocks)


def _figures(field: NearField) -> list[Figure]:
    outside, inside = field.range_db("outside"), field.range_db("inside")
    assert outside is not None  # checked by the caller
    high = 5.0 * math.ceil(0.2 * max(outside[1], -math.inf if inside is None else inside[1]))
    low = 5.0 * math.floor(0.2 * max(outside[0], outside[1] - SHOWN_DB))
    return [_figure(field, held, (low, high)) for held in field.planes]


def _figure(field: NearField, held: PlaneMap, limits: tuple[float, float]) -> Figure:
    plane = held.plane
    right, up, across = plane.axes
    level = Axis(say("Sound pressure level"), "dB", limits=limits, reference="20 µPa")
    shown = np.round(field.shown_db(held), 1)
    elements: list[Element] = [Heatmap(plane.right_m, plane.up_m, shown, say("level"), level)]
    elements += _outlines(field, held)
    for path, place in field.sources_m:
        if path in field.adds and abs(place[across] - plane.at_m) < SOURCE_RADIUS_M:
            look = next(one for one in PATHS if one.key == path)
            x, y = (np.array([place[axis]]) for axis in (right, up))
            elements.append(Markers(x, y, say("source: {path}", path=look.name), symbol=look.symbol, color=look.slot))
    for where, symbol in PLACES.items():
        loudest = field.highest(where)
        if loudest is not None and loudest.plane == plane.name:
            x, y = (np.array([loudest.position_m[axis]]) for axis in (right, up))
            elements.append(Markers(x, y, say(_HIGHEST[where]), symbol=symbol, color=HIGHEST))
    half = 0.5 * float(plane.right_m[1] - plane.right_m[0])
    edge = (float(plane.right_m[0]) - half, float(plane.right_m[-1]) + half)
    names = "xyz"
    return Figure(
        slug("near-field", field.condition, plane.name.lower()),
        say(
            "Level in the {plane} plane at {axis} = {distance} m, condition {name}",
            plane=plane.name,
            axis=names[across],
            distance=number_words(plane.at_m),
            name=field.condition,
        ),
        say(
            "One scale of colours, {low:.0f} to {high:.0f} dB, for outside and inside and all "
            "three planes of the condition; what is beyond has the colour of the end.",
            low=limits[0],
            high=limits[1],
        ),
        Axis(names[right], "m", limits=edge),
        Axis(names[up], "m", limits=edge),
        elements,
        height=460,
        equal=True,
    )


def _outlines(field: NearField, held: PlaneMap) -> list[Line]:
    """The housing where the plane cuts it, and the region around the highest level outside."""
    right, up, across = held.plane.axes
    found = []
    if field.low_m[across] <= held.plane.at_m <= field.high_m[across]:
        x = [field.low_m[right], field.high_m[right], field.high_m[right], field.low_m[right], field.low_m[right]]
        y = [field.low_m[up], field.low_m[up], field.high_m[up], field.high_m[up], field.low_m[up]]
        found.append(Line(np.array(x), np.array(y), say("housing"), color=OUTLINE, width=2.0))
    edges: tuple[NDArray[np.float64], NDArray[np.float64]] = field.outline(held.plane.name, "outside")
    if edges[0].size:
        name = say("within {difference:g} dB of the highest level outside", difference=AROUND_HIGHEST_DB)
        found.append(Line(*edges, name, color=HIGHEST, width=1.2))
    return found


def _table(fields: list[NearField]) -> Table:
    columns = (
        Column("condition", say("Condition")),
        Column("place", say("Place")),
        Column("path", say("Path")),
        Column("level_db", say("Highest level"), "dB", 1, "number"),
        *(Column(f"{name}_m", name, "m", 2, "number") for name in "xyz"),
        Column("plane", say("Plane")),
    )
    rows: list[list[Cell]] = []
    for field in fields:
        for place in PLACES:
            for path in TABLE_PATHS:
                found = field.highest(place, path)
                if found is not None:
                    x, y, z = found.position_m
                    words = say(_PLACE_WORDS[place]), path_word(path)
                    rows.append([field.condition, *words, found.level_db, x, y, z, found.plane])
    caption = say(
        "Highest levels on the maps, {distance:g} m and more from the point sources of each path",
        distance=SOURCE_RADIUS_M,
    )
    return Table("near-field-highest", caption, columns, rows, origin="calculated")
