"""The helix sweep: what another helix angle of the same teeth changes."""

from __future__ import annotations

import math

import numpy as np

from tdacoustic.drive import HelixCase
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import level_unit, micrometres, motion_cells
from tdacoustic.reporting.sections.sound_paths import heard_paths, path_line
from tdacoustic.results import FleetPrediction

__all__ = ["helix_sweep", "helix_words"]

FOLLOWS = mark(
    "Rack, teeth, profile shifts and face width stay; the centre distance, the contact ratios, the stiffness of the "
    "mesh and the working pressure angle follow from the helix angle."
)
STAYS = mark(
    "Masses, inertias, bearings, and the unloaded transmission error stay as they are: that a longer contact line "
    "averages a real one more is left out."
)
STAYS_WITH_HOUSING = mark(
    "Masses, inertias, bearings, the housing and its seats, and the unloaded transmission error stay as they are: that "
    "a longer contact line averages a real one more is left out."
)


def helix_sweep(result: FleetPrediction) -> Section | None:
    """Return the section on the helix sweep, or None where the fleet names no angles."""
    cases = sorted(result.prediction.helix, key=lambda case: case.helix_angle_deg)
    if result.fleet.operation.helix_angle_deg is None or not cases:
        return None
    angles = np.array([case.helix_angle_deg for case in cases])
    blocks: list[Block] = [Paragraph(_method(result, cases[0])), _table(result, cases)]
    if len(cases) > 1:
        dte = np.array([1e6 * case.gears.steady.dte_pp_m for case in cases])
        levels = np.array([math.nan if case.gears.masuda_db is None else case.gears.masuda_db for case in cases])
        distances = np.array([1e3 * case.unit.geometry.centre_distance_m for case in cases])
        unit = level_unit(result.fleet)
        if dte.any():
            axis = Axis(say("DTE"), "µm", note=say("peak to peak"))
            blocks.append(
                _figure("helix-dte", say("Dynamic transmission error over the helix angle"), axis, angles, dte)
            )
        if np.isfinite(levels).any():
            axis = Axis(say("Level at 1 m"), unit, reference="20 µPa")
            blocks.append(_figure("helix-masuda", say("Masuda's level over the helix angle"), axis, angles, levels))
        around = _level_figure(result, cases, angles)
        blocks += [] if around is None else [FigureBlock(around, "calculated")]
        axis = Axis(say("Centre distance"), "mm")
        blocks.append(_figure("helix-distance", say("Centre distance over the helix angle"), axis, angles, distances))
    return Section("helix-sweep", say("Helix sweep"), blocks)


def helix_words(result: FleetPrediction) -> str:
    """Return what the helix sweep found in a sentence, empty without one or where nothing moves."""
    cases = [case for case in result.prediction.helix if case.gears.steady.dte_pp_m > 0.0]
    if result.fleet.operation.helix_angle_deg is None or len(cases) < 2:
        return ""
    least, most = (pick(cases, key=lambda case: case.gears.steady.dte_pp_m) for pick in (min, max))
    distances = [1e3 * case.unit.geometry.centre_distance_m for case in cases]
    return say(
        "helix angles {angles}: the DTE is between {least} ({least_at:g}°) and {most} ({most_at:g}°), with the centre "
        "distance from {nearest:.1f} to {farthest:.1f} mm",
        angles=", ".join(f"{case.helix_angle_deg:g}°" for case in cases),
        least=micrometres(least.gears.steady.dte_pp_m),
        least_at=least.helix_angle_deg,
        most=micrometres(most.gears.steady.dte_pp_m),
        most_at=most.helix_angle_deg,
        nearest=min(distances),
        farthest=max(distances),
    )


def _method(result: FleetPrediction, case: HelixCase) -> str:
    stays = say(STAYS) if result.prediction.housing is None else say(STAYS_WITH_HOUSING)
    speed = say("At {speed:.4g} km/h, the fastest condition.", speed=case.gears.condition.train_speed_km_h)
    return f"{speed} {say(FOLLOWS)} {stays}"


def _table(result: FleetPrediction, cases: list[HelixCase]) -> Table:
    surface = result.prediction.surface
    with_structure = result.prediction.housing is not None
    columns = [
        Column("helix_angle_deg", say("Helix angle"), "°", 1, "number"),
        Column("centre_distance_mm", say("Centres"), "mm", 3, "number"),
        Column("transverse_contact_ratio", "εα", "", 3, "number"),
        Column("overlap_ratio", "εβ", "", 3, "number"),
        Column("stiffness_n_per_um", "k̄", "N/µm", 0, "number"),
        Column("dte_pp_um", say("DTE p-p"), "µm", 2, "number"),
        Column("masuda_spl_1m_db", say("Masuda"), f"{level_unit(result.fleet)}, 1 m", 1, "number"),
        Column("spl_db", say("Total"), f"dB, {surface}", 1, "number"),
        Column("motion", say("Motion")),
    ]
    if with_structure:
        columns.insert(7, Column("structure_spl_db", say("Structure"), f"dB, {surface}", 1, "number"))
    rows: list[list[Cell]] = [
        [
            case.helix_angle_deg,
            1e3 * case.unit.geometry.centre_distance_m,
            case.unit.geometry.transverse_contact_ratio,
            case.unit.geometry.overlap_ratio,
            1e-6 * case.unit.stiffness.normal_n_per_m,
            1e6 * case.gears.steady.dte_pp_m,
            case.gears.masuda_db,
            *([case.sound.level_db(surface, "structure")] if with_structure else []),
            case.sound.level_db(surface),
            motion_cells(case.gears.steady)[0],
        ]
        for case in cases
    ]
    caption = say(
        "Helix sweep: εα is the transverse contact ratio, εβ the overlap ratio, k̄ the mean stiffness of the mesh"
    )
    return Table("helix", caption, columns, rows, origin="calculated")


def _level_figure(result: FleetPrediction, cases: list[HelixCase], angles: np.ndarray) -> Figure | None:
    """The level on the surface, the total and each path; None where the meshing noise alone makes it, as at 1 m."""
    held = heard_paths(case.sound for case in cases)
    if [path.key for path in held] in ([], ["mesh"]):
        return None
    surface = result.prediction.surface
    of = {"total": [case.sound.level_db(surface) for case in cases]}
    of |= {path.key: [case.sound.level_db(surface, path.key) for case in cases] for path in held}
    levels = {key: np.array([math.nan if level is None else level for level in row]) for key, row in of.items()}
    lines = [path_line(result.fleet, path, angles, levels[path.key]) for path in held]
    if np.isfinite(levels["total"]).any():
        lines.insert(0, Line(angles, levels["total"], say("total"), color=7, points=True))
    return Figure(
        "helix-level",
        say("Level at {surface} over the helix angle", surface=surface),
        say("Mean in energy over the surface. One dot a computed angle; the lines between them only lead the eye."),
        Axis(say("Helix angle"), "°"),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        lines,
        height=360,
    )


def _figure(name: str, title: str, axis: Axis, angles: np.ndarray, values: np.ndarray) -> FigureBlock:
    line = Line(angles, values, axis.label, points=True)
    caption = say("One dot a computed angle; the lines between them only lead the eye.")
    return FigureBlock(
        Figure(name, title, caption, Axis(say("Helix angle"), "°"), axis, [line], height=280), "calculated"
    )
