"""The sound around the drive: who makes how much of the level at 4 m, by condition."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tdacoustic.drive import DriveSound, GearState, HousingFacts
from tdacoustic.fleet import Fleet
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
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import conditions_words, sentence
from tdacoustic.reporting.sections.sound_paths import (
    PATHS,
    heard_paths,
    is_added,
    path_line,
    path_word,
    total_words,
)
from tdacoustic.reporting.sections.sound_spectra import sound_spectra
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["sound_field", "sound_words"]

POINTS_IN = {
    "free": mark("The sources are points in free space; the level is the mean in energy over the sphere."),
    "half": mark(
        "The sources are points in the space over rigid ground at the rail; the level is the mean in energy over the "
        "half sphere."
    ),
}
HOUSING_IN = {
    "free": mark(
        "In free space stands the housing, a closed box, computed from {low:.0f} to {high:.0f} Hz; the level is the "
        "mean in energy over the sphere."
    ),
    "half": mark(
        "In the space over rigid ground at the rail stands the housing, a closed box, computed from {low:.0f} to "
        "{high:.0f} Hz; the level is the mean in energy over the half sphere."
    ),
}
OF_POINTS = mark(
    "The bearing forces' way through the housing is not computed. Levels of both sources stand here whether the total "
    "adds them or not."
)
OF_MOTOR = mark("The motor's tones come from the fleet's excitations.")
OF_MESH = mark(
    "The meshing noise is Masuda's level at 1 m as a point source, all of it at the mesh frequency; the housing is "
    "already in it."
)
STRUCTURE = mark(
    "Structure: the lines of the bearing forces shake the housing at its seats; its modes (finite elements) answer and "
    "boundary elements give their sound."
)
STRUCTURE_WITH_GAIN = mark(
    "Structure: the lines of the bearing forces shake the housing at its seats; its modes (finite elements) answer and "
    "boundary elements give their sound, with [model] structure_gain_db = {gain} dB."
)
MOTOR = mark(
    "Motor: the motor's tones come from the fleet's excitations, as point sources beside the rigid housing, which "
    "scatters them. Their volume flow is held, so that the housing changes their power."
)
MESH_OUTSIDE = mark(
    "Mesh: the meshing noise is Masuda's level at 1 m as a point source, all of it at the mesh frequency, outside of "
    "the housing. That level is of a gear unit with its housing, so the power of the source is held: the rigid housing "
    "gives it a direction and nothing else."
)
MESH_INSIDE = mark(
    "Mesh: the meshing noise is Masuda's level at 1 m as a point source, all of it at the mesh frequency, inside of "
    "the housing. Its volume flow is held; the air inside shakes the walls, and what they radiate is the level of the "
    "mesh (section Insertion loss of the housing). Its sound power level is that of a point source with the same mean "
    "level outside."
)
OF_POWERS = mark(
    "The sound power level of a tone of the motor is that without the housing beside it; that of a tone of the "
    "structure is that of a point source with the same mean level at {surface}."
)


def sound_field(result: FleetPrediction) -> Section:
    """Return the section on the levels around the drive."""
    prediction, fleet = result.prediction, result.fleet
    blocks = _method(result)
    held = heard_paths(prediction.sound)
    if held:
        blocks.append(Paragraph(" ".join(part for part in (total_words(fleet, held), _silent_words(result)) if part)))
    blocks.append(_table(result))
    levels = {path: _levels(result, path) for path in ("total", *(path.key for path in PATHS))}
    if held:
        blocks.append(FigureBlock(_figure(result, levels), "calculated"))
    spectra = sound_spectra(result)
    blocks += [] if spectra is None else [spectra]
    tones = [
        (sound.condition, path_word(s.path), s.name, s.frequency_hz, s.sound_power_level_db, level)
        for sound in prediction.sound
        for s, level in zip(sound.sources, sound.surface_db, strict=True)
    ]
    if tones:
        folded: list[Block] = [_sources(tones, prediction.surface)]
        if prediction.housing is not None:
            folded.insert(0, Paragraph(say(OF_POWERS, surface=prediction.surface)))
        blocks.append(Details(say("{count} sources", count=len(tones)), folded))
    return Section("sound-field", say("Sound around the drive"), blocks)


def sound_words(result: FleetPrediction, state: GearState) -> str:
    """Return the level on the surface and what it is made of, in words; empty without sound."""
    sound, surface = result.prediction.sound_of(state.condition.name), result.prediction.surface
    if sound is None:
        return ""
    levels = {path: level for path in PATHS if (level := sound.level_db(surface, path.key)) is not None}
    added, beside = (
        [
            f"{path_word(path.key)} {level:.1f} dB"
            for path, level in levels.items()
            if is_added(result.fleet, path) is wanted
        ]
        for wanted in (True, False)
    )
    parts = [", ".join(added)] if added else []
    parts += [say("not added: {paths}", paths=", ".join(beside))] if beside else []
    if not parts:
        return ""
    total = sound.level_db(surface)
    start = (
        say("no level at {surface}", surface=surface)
        if total is None
        else say("level at {surface} {level:.1f} dB", surface=surface, level=total)
    )
    return f"{start} ({'; '.join(parts)})"


def _method(result: FleetPrediction) -> list[Block]:
    """What the paths are, and what the level is: a paragraph of point sources, a list with a housing."""
    space, housing = result.fleet.radiation.space.value, result.prediction.housing
    if housing is None:
        said = [say(POINTS_IN[space]), say(OF_MOTOR), say(OF_MESH), say(OF_POINTS)]
        return [Paragraph(" ".join(said))]
    low, high = housing.range_hz
    start = say(HOUSING_IN[space], low=low, high=high)
    every = say("Levels of every path stand here whether the total adds them or not.")
    beyond = say(
        "Outside of {low:.0f} to {high:.0f} Hz point sources radiate as if there were no "
        "housing, and bearing forces give no sound.",
        low=low,
        high=high,
    )
    return [Paragraph(f"{start} {every}"), Sentences([*_path_words(result.fleet, housing), beyond])]


def _path_words(fleet: Fleet, housing: HousingFacts) -> list[str]:
    gain_db = fleet.model.structure_gain_db.value
    gain = pretty_signs(f"{gain_db:+g}")
    structure = say(STRUCTURE_WITH_GAIN, gain=gain) if gain_db else say(STRUCTURE)
    motor = [] if housing.motor_m is None else [say(MOTOR)]
    mesh = say(MESH_OUTSIDE) if housing.inside_m is None else say(MESH_INSIDE)
    return [structure, *motor, mesh]


def _silent_words(result: FleetPrediction) -> str:
    """Conditions whose bearing forces all lie where the housing is not computed; empty of none."""
    housing = result.prediction.housing
    if housing is None:
        return ""
    silent = [
        state
        for state, sound in _conditions(result)
        if sound is not None
        and len(state.forces.frequency_hz)
        and all(source.path != "structure" for source in sound.sources)
    ]
    if not silent:
        return ""
    low, high = housing.range_hz
    return sentence(
        say(
            "{conditions}: no line of the bearing forces lies within {low:.0f} to {high:.0f} Hz, so "
            "the structure has no level there",
            conditions=conditions_words(silent),
            low=low,
            high=high,
        )
    )


def _levels(result: FleetPrediction, path: str) -> np.ndarray:
    surface = result.prediction.surface
    found = [None if sound is None else sound.level_db(surface, path) for _, sound in _conditions(result)]
    return np.array([math.nan if level is None else level for level in found])


def _conditions(result: FleetPrediction) -> list[tuple[GearState, DriveSound | None]]:
    prediction = result.prediction
    return [(state, prediction.sound_of(state.condition.name)) for state in prediction.conditions]


def _table(result: FleetPrediction) -> Table:
    surface = result.prediction.surface
    with_structure = result.prediction.housing is not None
    columns = [
        Column("condition", say("Condition")),
        Column("train_speed_km_h", say("Speed"), "km/h", 1, "number"),
        Column("motor_power_db", say("Motor's power"), "dB re 1 pW", 1, "number"),
        Column("motor_spl_db", say("Motor"), f"dB, {surface}", 1, "number"),
        Column("mesh_spl_db", say("Mesh"), f"dB, {surface}", 1, "number"),
        Column("spl_db", say("Total"), f"dB, {surface}", 1, "number"),
        Column("a_weighted_db", say("Total"), f"dB(A), {surface}", 1, "number"),
    ]
    if with_structure:
        columns.insert(5, Column("structure_spl_db", say("Structure"), f"dB, {surface}", 1, "number"))
    rows: list[list[Cell]] = []
    for state, sound in _conditions(result):
        if sound is None:
            continue
        paths = ("motor", "mesh", "structure") if with_structure else ("motor", "mesh")
        row: list[Cell] = [state.condition.name, state.condition.train_speed_km_h, sound.sound_power_level_db("motor")]
        row += [sound.level_db(surface, path) for path in (*paths, "total")]
        rows.append([*row, sound.level_db(surface, weighting="A")])
    return Table("levels-4-m", say("Levels around the drive, by what makes them"), columns, rows, origin="calculated")


def _sources(tones: Sequence[Sequence[Cell]], surface: str) -> Table:
    columns = (
        Column("condition", say("Condition")),
        Column("path", say("Path")),
        Column("name", say("Source")),
        Column("frequency_hz", say("Frequency"), "Hz", 1, "number"),
        Column("sound_power_level_db", say("Sound power level"), "dB re 1 pW", 1, "number"),
        Column("surface_db", say("Level"), f"dB, {surface}", 1, "number"),
    )
    return Table("sound-sources", say("Sources"), columns, tones, origin="calculated")


def _figure(result: FleetPrediction, levels: dict[str, np.ndarray]) -> Figure:
    speeds = np.array([state.condition.train_speed_km_h for state in result.prediction.conditions])
    order = np.argsort(speeds)
    surface = result.prediction.surface
    lines = []
    if np.isfinite(levels["total"]).any():
        lines.append(Line(speeds[order], levels["total"][order], say("total"), color=7, points=True))
    lines += [
        path_line(result.fleet, path, speeds[order], levels[path.key][order])
        for path in PATHS
        if np.isfinite(levels[path.key]).any()
    ]
    return Figure(
        "level-over-speed",
        say("Level at {surface} over the train's speed", surface=surface),
        say("Mean in energy over the surface. One dot a condition; the lines between them only lead the eye."),
        Axis(say("Train speed"), "km/h"),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        lines,
    )
