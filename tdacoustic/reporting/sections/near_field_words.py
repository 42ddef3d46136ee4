"""What the maps of the sound close to the housing show, in sentences, beside what the paper says of its Fig. 15."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from tdacoustic.drive import NearField, pattern_correlation
from tdacoustic.drive.levels import Path
from tdacoustic.drive.near_field import SOURCE_RADIUS_M, LoudestPoint
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import named_conditions, range_words, sentence
from tdacoustic.reporting.sections.printed import PAPER, is_of_the_paper
from tdacoustic.reporting.sections.sound_paths import PATHS, is_added
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["TABLE_PATHS", "near_field_method", "near_field_words", "number_words"]

FREE_SOURCE: Final = mark(
    "The source of the meshing noise stands outside here, above the housing's top unless the fleet says where; the "
    'paper puts it into the box, which [masuda] placement = "inside" computes.'
)
OF_INSIDE: Final = mark("of what the walls send inwards (structure), which the total outside does not add")
AT_SOURCES: Final = mark(
    "At a point source the level has no bound, so what is said and coloured leaves out what is nearer to one than "
    "{distance:g} m (assumed); single points there are brighter than the scale ends."
)
TABLE_PATHS: Final[tuple[Path, ...]] = ("total", "motor", "mesh", "structure")
"""In the order in which the highest levels are listed."""


def near_field_method(result: FleetPrediction, field: NearField) -> str:
    """Say where and how the levels are computed.

    Parameters
    ----------
    result : FleetPrediction
    field : NearField
        One of its maps; all have the same planes.
    """
    fleet, planes = result.fleet, [held.plane for held in field.planes]
    across = joined([f"{'xyz'[plane.axes[2]]} = {number_words(plane.at_m)} m ({plane.name})" for plane in planes])
    added = [path.phrase for path in PATHS if is_added(fleet, path)]
    levels = say(
        "Levels every {spacing:g} m in three planes through the middle of the housing, {planes}, "
        "around the drive's centre and up to the walls. The paper does not say where its planes "
        "lie. Each line is computed by boundary elements for itself; the levels are those of the "
        "total, which adds {paths}.",
        spacing=fleet.radiation.map_spacing_m.value,
        planes=across,
        paths=joined(added),
    )
    if fleet.radiation.space.value == "half":
        nowhere = say("In the walls and below the ground there is no level.")
    else:
        nowhere = say("In the walls there is no level.")
    return f"{levels} {nowhere} {say(AT_SOURCES, distance=SOURCE_RADIUS_M)}"


def near_field_words(result: FleetPrediction, fields: list[NearField]) -> list[str]:
    """Say where it is loudest, condition by condition, and what of the paper's Fig. 15 is there."""
    found = []
    for field in fields:
        parts = _highest_words(field)
        if parts:
            found.append(sentence(f"{named_conditions([field.condition])}: {'; '.join(parts)}"))
        seen = _seen_words(field)
        if seen:
            found.append(say("Condition {name}, as the maps show it: {seen}.", name=field.condition, seen=seen))
    found += _beyond_words(fields)
    if is_of_the_paper(result.fleet):
        found.append(_paper_words(fields))
        if result.fleet.masuda.placement.value == "free" and not all(_is_between(field) for field in fields):
            found.append(say(FREE_SOURCE))
    if len(fields) > 1:
        found.append(_alike_words(result, fields))
    return found


def _highest_words(field: NearField) -> list[str]:
    """Where the highest levels outside and inside are."""
    outside, inside = field.highest("outside"), field.highest("inside")
    found = []
    if outside is not None:
        at = ", ".join([_at(outside), *_where(field, outside)])
        found.append(say("the highest level outside is {level}", level=at))
    if inside is not None:
        found.append(say("the highest level inside is {level}", level=_at(inside)))
        if field.inside_path != "total":
            found[-1] += f", {say(OF_INSIDE)}"
    return found


def _seen_words(field: NearField) -> str:
    """What stands out on the maps: the brightest path outside, how far the level falls, and inside beside it."""
    added = [path for path in TABLE_PATHS if path in field.adds]
    brightest = {path: point.level_db for path in added if (point := field.highest("outside", path)) is not None}
    outside, inside = field.highest("outside"), field.highest("inside")
    if outside is None or not brightest:
        return ""
    first, *others = sorted(brightest, key=lambda path: -brightest[path])
    if first == "motor":
        told = [say("outside the motor's tones are brightest")]
    else:
        told = [say("outside {path} is brightest", path=_phrase(first))]
    if others:
        apart = brightest[first] - brightest[others[0]]
        told.append(say("by {difference:.0f} dB over {path}", difference=apart, path=_phrase(others[0])))
    low = field.range_db("outside")
    if low is not None:
        told.append(say("and the level falls to {level:.0f} dB at the darkest point", level=low[0]))
    parts = [", ".join(told)]
    if inside is not None:
        apart = inside.level_db - outside.level_db
        parts.append(
            say("inside it is up to {difference:.0f} dB above the brightest outside", difference=apart)
            if apart >= 0.0
            else say("inside it is up to {difference:.0f} dB below the brightest outside", difference=-apart)
        )
    return "; ".join(parts)


def _phrase(key: str) -> str:
    return next(path.phrase for path in PATHS if path.key == key)


def _beyond_words(fields: list[NearField]) -> list[str]:
    """Lines that the housing does not stop."""
    held = [field for field in fields if field.free_hz]
    if not held:
        return []
    lines = sorted({frequency for field in held for frequency in field.free_hz})
    text = say(
        "In {conditions} lines of point sources at {frequencies} Hz lie beyond the housing's range: they pass it as if "
        "it were not there.",
        conditions=named_conditions([field.condition for field in held]),
        frequencies=range_words(f"{lines[0]:.0f}", f"{lines[-1]:.0f}"),
    )
    return [text]


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
        found_in = named_conditions(between)
        ends.append(say("here the highest level outside lies between them in {conditions}", conditions=found_in))
    if others:
        found_in = named_conditions(others)
        ends.append(
            say("and elsewhere in {conditions}", conditions=found_in)
            if between
            else say("here it lies elsewhere in {conditions}", conditions=found_in)
        )
    compared = [field for field in fields if field.inside_path is not None]
    if compared:
        louder = [field.condition for field in compared if _inside_is_louder(field)]
        quieter = [field.condition for field in compared if not _inside_is_louder(field)]
        if louder:
            found_in = named_conditions(louder)
            ends.append(say("inside it is louder than anywhere outside in {conditions}", conditions=found_in))
        if quieter:
            found_in = named_conditions(quieter)
            ends.append(say("inside it is quieter than the loudest point outside in {conditions}", conditions=found_in))
    return sentence("; ".join([text, *ends]))


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
    said = [
        say(
            "the levels outside at the same points in {conditions} correlate in pairs with {correlations} (1 is the "
            "same pattern)",
            conditions=named_conditions([field.condition for field in fields]),
            correlations=range_words(f"{alike.min():.2f}", f"{alike.max():.2f}"),
        )
    ]
    if is_of_the_paper(result.fleet):
        said.append(say("{paper} says that the pattern remains almost unchanged over speed", paper=say(PAPER)))
    return sentence(pretty_signs("; ".join(said)))


def _at(point: LoudestPoint) -> str:
    x, y, z = (number_words(value) for value in point.position_m)
    return say("{level:.1f} dB at x {x}, y {y}, z {z} m", level=point.level_db, x=x, y=y, z=z)


def _where(field: NearField, point: LoudestPoint) -> list[str]:
    """What it is near to, in words; none of nothing."""
    if field.lies_between(point.position_m):
        return [say("between the motor and the housing")]
    added = [(math.dist(place, point.position_m), path) for path, place in field.sources_m if path in field.adds]
    if not added or min(added)[0] > 2.0 * SOURCE_RADIUS_M:
        return []
    apart, path = min(added)
    if path == "mesh":
        return [say("{distance:.2f} m from the source of the meshing noise", distance=apart)]
    return [say("{distance:.2f} m from the source of the motor", distance=apart)]


def number_words(value: float) -> str:
    """Return a coordinate as it is printed.

    Examples
    --------
    >>> number_words(0.5), number_words(-0.0)
    ('0.5', '0')
    """
    return pretty_signs(f"{value + 0.0:.4g}")
