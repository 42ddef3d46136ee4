"""The sound around the drive: who makes how much of the level at 4 m, by condition."""

from __future__ import annotations

import math

import numpy as np

from tdacoustic.drive import DriveSound, GearState
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Block, Cell, Column, Details, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.results import FleetPrediction

__all__ = ["sound_field", "sound_words"]

_PATHS = (("mesh", "Meshing noise", 1), ("motor", "Motor", 0))


def sound_field(result: FleetPrediction) -> Section:
    """Return the section on the levels around the drive."""
    prediction, fleet = result.prediction, result.fleet
    blocks: list[Block] = [Paragraph(_method(fleet)), _table(result)]
    levels = {path: _levels(result, path) for path in ("total", "mesh", "motor")}
    if np.isfinite(levels["total"]).any():
        blocks.append(FigureBlock(_figure(result, levels), "calculated"))
    tones = [
        (sound.condition, s.path, s.name, s.frequency_hz, s.sound_power_level_db)
        for sound in prediction.sound
        for s in sound.sources
    ]
    if tones:
        columns = (
            Column("condition", "Condition"),
            Column("path", "Path"),
            Column("name", "Source"),
            Column("frequency_hz", "Frequency", "Hz", 1, "number"),
            Column("sound_power_level_db", "Sound power level", "dB re 1 pW", 1, "number"),
        )
        table = Table("sound-sources", "Sources", columns, tones, origin="calculated")
        blocks.append(Details(f"{len(tones)} sources", [table]))
    return Section("sound-field", "Sound around the drive", blocks)


def sound_words(result: FleetPrediction, state: GearState) -> str:
    """Return the level on the surface and what it is made of, in words; empty without sound."""
    sound, surface = result.prediction.sound_of(state.condition.name), result.prediction.surface
    total = None if sound is None else sound.level_db(surface)
    if sound is None or total is None:
        return ""
    parts = [
        f"{name} {level:.1f} dB"
        for path, name in (("motor", "motor"), ("mesh", "mesh"))
        if (level := sound.level_db(surface, path)) is not None
    ]
    return f"level at {surface} {total:.1f} dB ({', '.join(parts)})"


def _method(fleet: Fleet) -> str:
    free = fleet.radiation.space.value == "free"
    where = "free space" if free else "the space over rigid ground at the rail"
    return (
        f"The sources are points in {where}; the level is the mean in energy over the "
        f"{'sphere' if free else 'half sphere'}. The motor's tones come from the fleet's excitations. The meshing "
        "noise is Masuda's level at 1 m as a point source, all of it at the mesh frequency; the housing is already in "
        "it. The bearing forces' way through the housing is not computed. Levels of both sources stand here whether "
        "the total adds them or not."
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
    columns = (
        Column("condition", "Condition"),
        Column("train_speed_km_h", "Speed", "km/h", 1, "number"),
        Column("motor_power_db", "Motor", "sound power, dB re 1 pW", 1, "number"),
        Column("motor_spl_db", f"Motor at {surface}", "dB", 1, "number"),
        Column("mesh_spl_db", f"Mesh at {surface}", "dB", 1, "number"),
        Column("spl_db", f"Total at {surface}", "dB", 1, "number"),
        Column("a_weighted_db", f"Total at {surface}", "dB(A)", 1, "number"),
    )
    rows: list[list[Cell]] = [
        [
            state.condition.name,
            state.condition.train_speed_km_h,
            sound.motor_sound_power_level_db,
            sound.level_db(surface, "motor"),
            sound.level_db(surface, "mesh"),
            sound.level_db(surface),
            sound.level_db(surface, weighting="A"),
        ]
        for state, sound in _conditions(result)
        if sound is not None
    ]
    return Table("levels-4-m", "Levels around the drive, by what makes them", columns, rows, origin="calculated")


def _figure(result: FleetPrediction, levels: dict[str, np.ndarray]) -> Figure:
    speeds = np.array([state.condition.train_speed_km_h for state in result.prediction.conditions])
    order = np.argsort(speeds)
    surface = result.prediction.surface
    lines = [Line(speeds[order], levels["total"][order], "total", color=7, points=True)]
    lines += [
        Line(speeds[order], levels[path][order], name, color=slot, points=True, style="dashed")
        for path, name, slot in _PATHS
        if np.isfinite(levels[path]).any()
    ]
    return Figure(
        "level-over-speed",
        f"Level at {surface} over the train's speed",
        "Mean in energy over the surface. One dot a condition; the lines between them only lead the eye.",
        Axis("Train speed", "km/h"),
        Axis("Sound pressure level", "dB", reference="20 µPa"),
        lines,
    )
