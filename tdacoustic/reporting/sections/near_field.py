"""Maps of the sound close to the housing, beside what the paper says of its Fig. 15."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import NearField, pattern_correlation
from tdacoustic.drive.levels import Path
from tdacoustic.drive.near_field import AROUND_HIGHEST_DB, SOURCE_RADIUS_M, LoudestPoint, PlaneMap
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
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.printed import PAPER, is_of_the_paper
from tdacoustic.reporting.sections.sound_paths import PATHS, is_added
from tdacoustic.reporting.sections.words import joined, pretty_signs, slug
from tdacoustic.results import FleetPrediction

__all__ = ["near_field_section"]

SHOWN_DB: Final = 40.0
"""Below the highest level outside that counts, down to which the colours reach at most."""
FREE_SOURCE: Final = mark(
    "The source of the meshing noise stands outside here, above the housing's top unless the fleet says where; the "
    'paper puts it into the box, which [masuda] placement = "inside" computes.'
)
PLACES: Final[dict[Literal["outside", "inside"], Symbol]] = {"outside": "x", "inside": "cross"}
TABLE_PATHS: Final[tuple[Path, ...]] = ("total", "motor", "mesh", "structure")
OUTLINE, HIGHEST = 7, 6
"""Slots of the palette: the housing, and what is said of the highest level."""


def near_field_section(result: FleetPrediction) -> Section | None:
    """Return the section on the maps; None where no condition is mapped."""
    fields = [field for field in result.prediction.maps if field.range_db("outside") is not None]
    if not fields:
        return None
    blocks: list[Block] = [Paragraph(_method(result, fields[0])), Sentences(_words(result, fields))]
    blocks += [FigureBlock(figure, "calculated") for figure in _figures(fields[0])]
    for field in fields[1:]:
        held = [FigureBlock(figure, "calculated") for figure in _figures(field)]
        blocks.append(Details(say("Maps of condition {condition}", condition=field.condition), held))
    blocks.append(_table(fields))
    return Section("near-field", say("Sound close to the housing"), blocks)


def _method(result: FleetPrediction, field: NearField) -> str:
    fleet, planes = result.fleet, [held.plane for held in field.planes]
    across = joined([f"{'xyz'[plane.axes[2]]} = {_number(plane.at_m)} m ({plane.name})" for plane in planes])
    added = [path.phrase for path in PATHS if is_added(fleet, path)]
    ground = say(" and below the ground") if fleet.radiation.space.value == "half" else ""
    return say(
        "Levels every {value:g} m in three planes through the middle of the housing, {across}, "
        "around the drive's centre and up to the walls. The paper does not say where its planes "
        "lie. Each line is computed by boundary elements for itself; the levels are those of the "
        "total, which adds {added}. In the walls{ground} there is no level. At a point source "
        "the level has no bound, so what is said and coloured leaves out what is nearer to one "
        "than {source_radius_m:g} m (assumed); single points there are brighter than the scale "
        "ends.",
        value=fleet.radiation.map_spacing_m.value,
        across=across,
        added=joined(added),
        ground=ground,
        source_radius_m=SOURCE_RADIUS_M,
    )


def _words(result: FleetPrediction, fields: list[NearField]) -> list[str]:
    found = []
    for field in fields:
        outside, inside = field.highest("outside"), field.highest("inside")
        parts = (
            []
            if outside is None
            else [say("the highest level outside is {at}{where}", at=_at(outside), where=_where(field, outside))]
        )
        parts += (
            []
            if inside is None
            else [say("the highest level inside is {at}{of_inside}", at=_at(inside), of_inside=_of_inside(field))]
        )
        if parts:
            found.append(
                sentence(say("condition {condition}: {parts}", condition=field.condition, parts="; ".join(parts)))
            )
        seen = _seen_words(field)
        found += (
            [sentence(say("condition {condition}, as the maps show it: {seen}", condition=field.condition, seen=seen))]
            if seen
            else []
        )
    found += _beyond_words(fields)
    if is_of_the_paper(result.fleet):
        found.append(_paper_words(fields))
        if result.fleet.masuda.placement.value == "free" and not all(_is_between(field) for field in fields):
            found.append(say(FREE_SOURCE))
    if len(fields) > 1:
        found.append(_alike_words(result, fields))
    return found


def _seen_words(field: NearField) -> str:
    """What stands out on the maps: the brightest path outside, how far the level falls, and inside beside it."""
    added = [path for path in TABLE_PATHS if path in field.adds]
    brightest = {path: point.level_db for path in added if (point := field.highest("outside", path)) is not None}
    outside, inside = field.highest("outside"), field.highest("inside")
    if outside is None or not brightest:
        return ""
    first, *others = sorted(brightest, key=lambda path: -brightest[path])
    told = say("outside {phrase} {value} brightest", phrase=_phrase(first), value="are" if first == "motor" else "is")
    if others:
        told += say(
            ", by {brightest:.0f} dB over {phrase}",
            brightest=brightest[first] - brightest[others[0]],
            phrase=_phrase(others[0]),
        )
    low = field.range_db("outside")
    told += "" if low is None else say(", and the level falls to {low:.0f} dB at the darkest point", low=low[0])
    if inside is not None:
        apart = inside.level_db - outside.level_db
        told += say(
            "; inside it is up to {apart:.0f} dB {value} the brightest outside",
            apart=abs(apart),
            value="above" if apart >= 0.0 else "below",
        )
    return told


def _phrase(key: str) -> str:
    return next(path.phrase for path in PATHS if path.key == key)


def _of_inside(field: NearField) -> str:
    if field.inside_path == "total":
        return ""
    return say(", of what the walls send inwards (structure), which the total outside does not add")


def _beyond_words(fields: list[NearField]) -> list[str]:
    """Lines that the housing does not stop."""
    held = [field for field in fields if field.free_hz]
    if not held:
        return []
    lines = sorted({frequency for field in held for frequency in field.free_hz})
    at = (
        f"{lines[0]:.0f} Hz"
        if len(lines) == 1
        else say("{lines:.0f} to {lines_2:.0f} Hz", lines=lines[0], lines_2=lines[-1])
    )
    which = _conditions([field.condition for field in held])
    text = say("in {which} lines of point sources at {at} lie beyond the housing's range", which=which, at=at)
    return [sentence(say("{text}: they pass it as if it were not there", text=text))]


def _paper_words(fields: list[NearField]) -> str:
    """What of Fig. 15 is there."""
    text = say(
        "{paper} has the highest level of all inside of the box, and the highest in the air "
        "between the motor and the gearbox (Fig. 15, condition 5; it prints no numbers)",
        paper=say(PAPER),
    )
    ends = []
    between = [field.condition for field in fields if _is_between(field)]
    others = [field.condition for field in fields if not _is_between(field)]
    if between:
        ends.append(
            say("here the highest level outside lies between them in {conditions}", conditions=_conditions(between))
        )
    if others:
        ends.append(
            say(
                "{value} elsewhere in {conditions}",
                value="and" if between else say("here it lies"),
                conditions=_conditions(others),
            )
        )
    compared = [field for field in fields if field.inside_path is not None]
    if compared:
        louder = [field.condition for field in compared if _inside_is_louder(field)]
        quieter = [field.condition for field in compared if not _inside_is_louder(field)]
        if louder:
            ends.append(
                say("inside it is louder than anywhere outside in {conditions}", conditions=_conditions(louder))
            )
        if quieter:
            ends.append(
                say(
                    "inside it is quieter than the loudest point outside in {conditions}",
                    conditions=_conditions(quieter),
                )
            )
    return sentence("; ".join([text, *ends]))


def _conditions(names: list[str]) -> str:
    return say("condition{value} {names}", value="s" if len(names) > 1 else "", names=joined(names))


def _is_between(field: NearField) -> bool:
    loudest = field.highest("outside")
    return loudest is not None and field.lies_between(loudest.position_m)


def _inside_is_louder(field: NearField) -> bool:
    inside, outside = field.highest("inside"), field.highest("outside")
    return inside is not None and (outside is None or inside.level_db > outside.level_db)


def _alike_words(result: FleetPrediction, fields: list[NearField]) -> str:
    alike = pattern_correlation(fields)[np.triu_indices(len(fields), 1)]
    alike = alike[np.isfinite(alike)]
    if not alike.size:
        return ""
    ends = list(dict.fromkeys(f"{value:.2f}" for value in (float(alike.min()), float(alike.max()))))
    text = say(
        "the levels outside at the same points in {conditions} correlate in pairs with {ends} (1 is the same pattern)",
        conditions=_conditions([field.condition for field in fields]),
        ends=" to ".join(ends),
    )
    if is_of_the_paper(result.fleet):
        text += say("; {paper} says that the pattern remains almost unchanged over speed", paper=say(PAPER))
    return sentence(pretty_signs(text))


def _at(point: LoudestPoint) -> str:
    x, y, z = (_number(value) for value in point.position_m)
    return say("{level_db:.1f} dB at x {x}, y {y}, z {z} m", level_db=point.level_db, x=x, y=y, z=z)


def _where(field: NearField, point: LoudestPoint) -> str:
    """What it is near to, in words."""
    if field.lies_between(point.position_m):
        return say(", between the motor and the housing")
    added = [(math.dist(place, point.position_m), path) for path, place in field.sources_m if path in field.adds]
    if not added or min(added)[0] > 2.0 * SOURCE_RADIUS_M:
        return ""
    apart, path = min(added)
    return say(
        ", {apart:.2f} m from the {value}",
        apart=apart,
        value=say("source of the meshing noise") if path == "mesh" else say("source of the motor"),
    )


def _number(value: float) -> str:
    return pretty_signs(f"{value + 0.0:.4g}")


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
    elements: list[Element] = [Heatmap(plane.right_m, plane.up_m, shown, "level", level)]
    elements += _outlines(field, held)
    for path, place in field.sources_m:
        if path in field.adds and abs(place[across] - plane.at_m) < SOURCE_RADIUS_M:
            look = next(one for one in PATHS if one.key == path)
            x, y = (np.array([place[axis]]) for axis in (right, up))
            elements.append(Markers(x, y, say("source: {name}", name=look.name), symbol=look.symbol, color=look.slot))
    for where, symbol in PLACES.items():
        loudest = field.highest(where)
        if loudest is not None and loudest.plane == plane.name:
            x, y = (np.array([loudest.position_m[axis]]) for axis in (right, up))
            elements.append(Markers(x, y, say("highest level {where}", where=where), symbol=symbol, color=HIGHEST))
    half = 0.5 * float(plane.right_m[1] - plane.right_m[0])
    edge = (float(plane.right_m[0]) - half, float(plane.right_m[-1]) + half)
    names = "xyz"
    return Figure(
        slug("near-field", field.condition, plane.name.lower()),
        say(
            "Level in the {name} plane at {names} = {number} m, condition {condition}",
            name=plane.name,
            names=names[across],
            number=_number(plane.at_m),
            condition=field.condition,
        ),
        say(
            "One scale of colours, {limits:.0f} to {limits_2:.0f} dB, for outside and inside and all "
            "three planes of the condition; what is beyond has the colour of the end.",
            limits=limits[0],
            limits_2=limits[1],
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
        found.append(Line(np.array(x), np.array(y), "housing", color=OUTLINE, width=2.0))
    edges: tuple[NDArray[np.float64], NDArray[np.float64]] = field.outline(held.plane.name, "outside")
    if edges[0].size:
        name = say("within {around_highest_db:g} dB of the highest level outside", around_highest_db=AROUND_HIGHEST_DB)
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
                    rows.append([field.condition, place, path, found.level_db, x, y, z, found.plane])
    caption = say(
        "Highest levels on the maps, {source_radius_m:g} m and more from the point sources of each path",
        source_radius_m=SOURCE_RADIUS_M,
    )
    return Table("near-field-highest", caption, columns, rows, origin="calculated")
