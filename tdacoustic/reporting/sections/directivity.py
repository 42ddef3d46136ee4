"""How loud the drive is in each direction around it, by condition and by helix angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Directivity
from tdacoustic.drive.doubts import circle_doubts
from tdacoustic.drive.levels import paths_of_total
from tdacoustic.drive.patterns import FLAT_DB, SHAPED_DB, Pattern
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Rule
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import named_conditions, range_words, sentence
from tdacoustic.reporting.sections.paper_features import judged_words
from tdacoustic.reporting.sections.printed import PAPER, is_of_the_paper
from tdacoustic.reporting.sections.sound_paths import heard_paths, is_added
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["directivity"]

MOST_LINES: Final = 8

_SIDES: Final = ((0.0, mark("travel")), (90.0, mark("left")), (180.0, mark("back")), (270.0, mark("right")))


class Around(NamedTuple):
    """A circle with the words for what it is of."""

    name: str
    circle: Directivity
    pattern: Pattern

    @property
    def range_db(self) -> float:
        """From the quietest to the loudest direction."""
        return self.pattern.range_db


def directivity(result: FleetPrediction) -> Section | None:
    """Return the section on the level around the drive; None where it is the same in all directions."""
    speeds, angles = _over_speed(result), _over_helix(result)
    if not any(around.range_db >= FLAT_DB for around in (*speeds, *angles)):
        return None
    blocks: list[Block] = [Paragraph(_method(result)), *_node_planes(result)]
    if speeds:
        said = _speed_words(result, speeds)
        blocks += [Sentences(said)] if said else []
        blocks += _figures("directivity", say("the conditions"), speeds)
        blocks.append(
            _table("directivity-conditions", say("The level around the drive, by condition"), say("Condition"), speeds)
        )
        blocks += _alike(result, "directivity-alike-conditions", say("Condition"), "speed", speeds)
    if angles:
        caption = say("The level around the drive, by helix angle")
        table = _table("directivity-helix-angles", caption, say("Helix angle"), angles)
        folded: list[Block] = [
            *_figures("directivity-helix", say("the helix angles, at the fastest condition"), angles),
            table,
            *_alike(result, "directivity-alike-helix", say("Helix angle"), "helix", angles),
        ]
        blocks.append(Details(say("Directions over the helix angles"), folded))
    return Section("directivity", say("Directions"), blocks)


def _node_planes(result: FleetPrediction) -> list[Notice]:
    """Where the circle lies in a node plane of the sound, which is a doubt of the prediction too."""
    held = result.prediction
    sounds = [*held.sound, *(case.sound for case in held.helix)]
    return [Notice("warning", sentence(text)) for text in circle_doubts(result.fleet, sounds, held.directivity)]


def _over_speed(result: FleetPrediction) -> list[Around]:
    """Circles of the conditions that make a sound, by speed."""
    named = [
        Around(f"{sound.condition} ({circle.value:.4g} km/h)", circle, pattern)
        for sound, (circle, pattern) in zip(result.prediction.sound, _heard(result, "speed"), strict=False)
        if np.isfinite(circle.level_db).all()
    ]
    return sorted(named, key=lambda around: around.circle.value)


def _over_helix(result: FleetPrediction) -> list[Around]:
    """Circles of the helix sweep by angle; none where the fleet names no angles."""
    if result.fleet.operation.helix_angle_deg is None:
        return []
    named = [
        Around(f"{circle.value:g}°", circle, pattern)
        for circle, pattern in _heard(result, "helix")
        if np.isfinite(circle.level_db).all()
    ]
    return sorted(named, key=lambda around: around.circle.value)


def _heard(result: FleetPrediction, sweep: str) -> list[tuple[Directivity, Pattern]]:
    """Circles of a sweep with their numbers."""
    both = zip(result.prediction.directivity, result.patterns, strict=True)
    return [pair for pair in both if pair[0].sweep == sweep]


def _method(result: FleetPrediction) -> str:
    radius_m = result.fleet.radiation.circle_radius_m.value
    added = [path.phrase for path in heard_paths(result.prediction.sound) if is_added(result.fleet, path)]
    return say(
        "Levels on a circle of {radius:g} m around the drive's centre in the plane z = 0, "
        "every 5°. 0° is the direction of travel (x), 90° is to the left (y), 180° is behind, "
        "270° is to the right. The levels are those of the total, which adds {paths}.",
        radius=radius_m,
        paths=joined(added),
    )


def _speed_words(result: FleetPrediction, speeds: list[Around]) -> list[str]:
    widest = max(speeds, key=lambda around: around.range_db)
    found = [
        say(
            "the directions differ most in condition {name}, by {difference:.1f} dB",
            name=widest.name,
            difference=widest.range_db,
        )
    ]
    found += [_beyond_words(result), _shape_words(result, speeds), judged_words(result, ("pattern", "loudest_deg"))]
    return [sentence(text) for text in found if text]


def _beyond_words(result: FleetPrediction) -> str:
    """Conditions of whose directions the housing is no part; empty of none."""
    housing = result.prediction.housing
    if housing is None:
        return ""
    low, high = housing.range_hz
    adds, beyond = paths_of_total(result.fleet), []
    for sound in result.prediction.sound:
        added = [source.frequency_hz for source in sound.sources if source.path in adds]
        if added and not any(low <= frequency <= high for frequency in added):
            beyond.append(sound.condition)
    if not beyond:
        return ""
    return say(
        "all that the total adds in {conditions} lies outside of the {low:.0f} to "
        "{high:.0f} Hz that the housing is computed for, so that the housing has no part in the "
        "directions there",
        conditions=named_conditions(beyond),
        low=low,
        high=high,
    )


def _shape_words(result: FleetPrediction, speeds: list[Around]) -> str:
    """How alike the shapes are; empty of fewer than two that are no circles."""
    shaped = [around for around in speeds if around.range_db >= SHAPED_DB]
    alike = [pair.correlation for pair in result.pattern_pairs if pair.sweep == "speed" and pair.both_shaped]
    if not alike:
        return ""
    said = [
        say(
            "the shapes of the {count} conditions with {difference:g} dB or more between "
            "directions correlate in pairs with {correlations} (1 is the same shape)",
            count=len(shaped),
            difference=SHAPED_DB,
            correlations=range_words(f"{min(alike):.2f}", f"{max(alike):.2f}"),
        )
    ]
    if is_of_the_paper(result.fleet):
        said.append(say("{paper} calls the shape invariant with speed", paper=say(PAPER)))
    return pretty_signs("; ".join(said))


def _figures(name: str, of_what: str, held: Sequence[Around]) -> list[FigureBlock]:
    """The levels, and the same relative to the loudest direction of each."""
    shown = _spread(held)
    some = [say("{count} of {all} are drawn.", count=len(shown), all=len(held))] if len(shown) < len(held) else []
    levels = [around.circle.level_db for around in shown]
    axis = Axis(say("Sound pressure level"), "dB", reference="20 µPa")
    title = say("Level around the drive over the direction, {of_what}", of_what=of_what)
    found = [_figure(name, title, " ".join(some), axis, shown, levels)]
    if len(shown) > 1 and any(around.range_db >= SHAPED_DB for around in shown):
        relative = [values - values.max() for values in levels]
        axis = Axis(say("Level"), "dB", reference=say("the loudest direction"))
        title = say("Shape of the level around the drive, {of_what}", of_what=of_what)
        caption = " ".join([say("Each relative to its own loudest direction."), *some])
        found.append(_figure(f"{name}-shape", title, caption, axis, shown, relative))
    return [FigureBlock(figure, "calculated") for figure in found]


def _spread(held: Sequence[Around]) -> list[Around]:
    """At most `MOST_LINES` of them, from the first to the last."""
    places = np.unique(np.linspace(0, len(held) - 1, min(MOST_LINES, len(held))).round().astype(int))
    return [held[place] for place in places]


def _figure(
    name: str,
    title: str,
    caption: str,
    axis: Axis,
    shown: Sequence[Around],
    levels: Sequence[NDArray[np.float64]],
) -> Figure:
    elements: list[Element] = [
        Line(np.append(around.circle.angle_deg, 360.0), np.append(values, values[0]), around.name)
        for around, values in zip(shown, levels, strict=True)
    ]
    elements += [Rule(angle, say(side)) for angle, side in _SIDES]
    return Figure(name, title, caption, Axis(say("Direction"), "°", limits=(0.0, 360.0)), axis, elements, height=380)


def _table(name: str, caption: str, of: str, held: Sequence[Around]) -> Table:
    columns = (
        Column("of", of),
        Column("loudest_db", say("Loudest"), "dB", 1, "number"),
        Column("loudest_deg", say("at"), "°", 0, "number"),
        Column("quietest_db", say("Quietest"), "dB", 1, "number"),
        Column("quietest_deg", say("at"), "°", 0, "number"),
        Column("range_db", say("Range"), "dB", 1, "number"),
    )
    rows: list[list[Cell]] = []
    for around in held:
        found = around.pattern
        at = [None if math.isnan(angle) else angle for angle in (found.loudest_deg, found.quietest_deg)]
        rows.append([around.name, found.loudest_db, at[0], found.quietest_db, at[1], found.range_db])
    return Table(name, caption, columns, rows, origin="calculated")


def _alike(result: FleetPrediction, name: str, of: str, sweep: str, held: Sequence[Around]) -> list[Block]:
    """How alike each two shapes are, as a table; nothing of fewer than two."""
    pairs = {(pair.first, pair.second): pair for pair in result.pattern_pairs if pair.sweep == sweep}
    if len(held) < 2 or not pairs:
        return []
    columns = [Column("of", of)]
    unit = "km/h" if sweep == "speed" else "°"
    columns += [
        Column(f"with_{number}", f"{around.pattern.value:.4g}", unit, 2, "number") for number, around in enumerate(held)
    ]
    rows: list[list[Cell]] = []
    for around in held:
        row: list[Cell] = [around.name]
        for other in held:
            low, high = sorted((around.pattern.value, other.pattern.value))
            pair = pairs.get((low, high))
            row.append(None if pair is None or math.isnan(pair.correlation) else pair.correlation)
        rows.append(row)
    caption = say(
        "How alike the shapes are: correlation of each two over the directions, of levels in dB "
        "less their mean; shapes of less than {difference:g} dB say little",
        difference=SHAPED_DB,
    )
    return [Details(say("Shapes in pairs"), [Table(name, caption, columns, rows, origin="calculated")])]
