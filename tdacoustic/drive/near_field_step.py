"""Step: the field of one condition's lines at the points of its maps; and what its levels are.

Transfer vectors would cost a solve of every mode at every point; here each line is solved for alone, its modal
velocities combined on the wall, and the point sources' fields are scattered once. The step holds fields of unit
sources, so that gains, Masuda's constant and the motor's sound powers do not compute it anew.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.housing_field import HousingField, HousingSound, number_of
from tdacoustic.drive.housing_steps import panel_velocities
from tdacoustic.drive.levels import PATHS, Path, Receiver
from tdacoustic.drive.near_field import INSIDE, OUTSIDE, MapPlane, NearField, PlaneMap, map_planes
from tdacoustic.drive.prediction import DriveSound
from tdacoustic.drive.source_inside import HousingCavity, SourceInside
from tdacoustic.drive.sources import SoundSource, StructureSource
from tdacoustic.fleet import Fleet
from tdacoustic.housing import Box, HousingModes
from tdacoustic.radiation.box_in_air import BoxInAir
from tdacoustic.radiation.field_maps import AT_SOURCE_M, pressures_outside
from tdacoustic.radiation.transfer_vectors import grid_hz_for
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress

__all__ = [
    "NEAR_FIELD",
    "FieldLine",
    "FieldSquares",
    "NearFieldSettings",
    "near_field_of",
    "near_field_task",
    "planes_of",
]

Real = NDArray[np.float64]
Point = tuple[float, float, float]

_REFERENCE_PA: Final = 2e-5
_SAME_HZ: Final = 1e-6
"""Relative difference below which two lines share one solution."""


@dataclass(frozen=True, eq=False)
class FieldLine:
    """A line of the housing, or of a point source beside it.

    Parameters
    ----------
    frequency_hz : float
    source : int
        Number among the body's sources; -1 of the housing's own motion.
    velocities : ndarray of complex, shape (modes,)
        Peak amplitudes of modal velocities; empty of a point source.
    inside_pa_m : float
        Peak amplitude of the source in the housing that moves its walls so, its pressure in free space times the
        distance; 0 of none.
    """

    frequency_hz: float
    source: int
    velocities: NDArray[np.complex128]
    inside_pa_m: float = 0.0


@dataclass(frozen=True, eq=False)
class NearFieldSettings:
    """What the field of a condition depends on besides the modes.

    Parameters
    ----------
    body : BoxInAir
        Without near receivers.
    highest_hz : float
        ``[radiation] max_frequency_hz``, which the grids follow.
    lines : tuple of FieldLine
    points_m : ndarray, shape (points, 3)
        Outside of the housing, or on it.
    inside_m : ndarray, shape (points, 3)
        In the air of the housing; none of a housing whose air is not computed.
    cavity_loss_factor : float
        Of that air.
    """

    body: BoxInAir
    highest_hz: float
    lines: tuple[FieldLine, ...]
    points_m: Real
    inside_m: Real
    cavity_loss_factor: float


@dataclass(frozen=True, eq=False)
class FieldSquares:
    """|p|² of lines at points.

    Parameters
    ----------
    outside : ndarray of float32, shape (lines, points)
        Mean squares in Pa² of the housing's motion; |p|² of sources of 1 Pa at 1 m.
    inside : ndarray of float32, shape (lines, points)
        Mean squares in Pa²; 0 of point sources outside, which do not move the walls, and NaN at a source itself.
    """

    outside: NDArray[np.float32]
    inside: NDArray[np.float32]


def _near_field(settings: NearFieldSettings, modes: HousingModes, cavity: HousingCavity | None = None) -> FieldSquares:
    return FieldSquares(_outside(settings, modes), _inside(settings, modes, cavity))


def _inside(settings: NearFieldSettings, modes: HousingModes, cavity: HousingCavity | None) -> NDArray[np.float32]:
    found = np.zeros((len(settings.lines), len(settings.inside_m)), dtype=np.float32)
    if cavity is None or not len(settings.inside_m):
        return found
    air = SourceInside(cavity, modes.frequency_hz, settings.body.position_m)
    apart = np.linalg.norm(settings.inside_m - np.asarray(air.source_m), axis=1) >= AT_SOURCE_M
    for row, line in zip(found, settings.lines, strict=True):
        if line.source >= 0:
            continue
        there = apart | (line.inside_pa_m == 0.0)
        pressure = air.pressures(
            settings.inside_m[there], line.frequency_hz, settings.cavity_loss_factor, line.velocities, line.inside_pa_m
        )
        row[:] = np.nan
        row[there] = 0.5 * np.abs(pressure) ** 2
    return found


def _outside(settings: NearFieldSettings, modes: HousingModes) -> NDArray[np.float32]:
    found = np.zeros((len(settings.lines), len(settings.points_m)), dtype=np.float32)
    groups = _groups(settings.lines)
    grid_hz, surface, shapes = 0.0, None, np.zeros((0, 0))
    for number, group in enumerate(groups):
        tell_progress(number / len(groups))
        frequency = settings.lines[group[0]].frequency_hz
        wanted = grid_hz_for(frequency, settings.highest_hz)
        if surface is None or wanted != grid_hz:
            grid_hz, surface = wanted, settings.body.surface(wanted)
            shapes = panel_velocities(modes, surface, settings.body.position_m)
        moving = [index for index in group if settings.lines[index].source < 0]
        standing = [index for index in group if settings.lines[index].source >= 0]
        velocities = np.zeros((len(shapes), len(moving)), dtype=np.complex128)
        for column, index in enumerate(moving):
            velocities[:, column] = shapes @ settings.lines[index].velocities
        sources = tuple(settings.lines[index].source for index in standing)
        pressures = pressures_outside(settings.body, surface, frequency, settings.points_m, velocities, sources)
        squares = np.abs(pressures.T) ** 2
        found[moving] = 0.5 * squares[: len(moving)]
        found[standing] = squares[len(moving) :]
    return found


def _groups(lines: Sequence[FieldLine]) -> list[list[int]]:
    """Numbers of lines by frequency, ascending."""
    found: list[list[int]] = []
    for index in sorted(range(len(lines)), key=lambda number: lines[number].frequency_hz):
        last = lines[found[-1][0]].frequency_hz if found else -math.inf
        if found and lines[index].frequency_hz - last <= _SAME_HZ * last:
            found[-1].append(index)
        else:
            found.append([index])
    return found


NEAR_FIELD: Final = Step("near-field", 1, _near_field, "Sound pressure around the housing by boundary elements")


def planes_of(fleet: Fleet, housing: HousingSound) -> tuple[MapPlane, ...]:
    """Return the planes of a fleet's maps; none around a housing that is no parametric box.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound
    """
    if not (isinstance(housing.box, Box) and isinstance(housing.body, BoxInAir)):
        return ()
    return map_planes(fleet, housing.box, housing.body)


def near_field_task(
    fleet: Fleet,
    housing: HousingSound,
    sound: DriveSound,
    planes: Sequence[MapPlane],
    modes: Task,
    cavity: Task | None = None,
) -> Task:
    """Return the task of one condition's maps.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound
        Of a box.
    sound : DriveSound
        Of the condition.
    planes : sequence of MapPlane
        Of `planes_of`.
    modes : Task
        Of the housing's modes.
    cavity : Task, optional
        Of the air inside; without it there is no level inside.
    """
    air, body = housing.inside if cavity is not None else None, housing.body
    assert isinstance(body, BoxInAir)  # else it has no planes
    settings = NearFieldSettings(
        replace(body, near_m=()),
        fleet.radiation.max_frequency_hz.value,
        tuple(_line(fleet, source, air) for source in sound.sources if housing.reaches(source.frequency_hz)),
        _points(planes, OUTSIDE),
        np.zeros((0, 3)) if air is None else _points(planes, INSIDE),
        0.0 if air is None else fleet.number("housing.cavity_loss_factor"),
    )
    inputs = {"modes": modes} if cavity is None else {"modes": modes, "cavity": cavity}
    return NEAR_FIELD.task(f"condition {sound.condition}", settings, **inputs)


def _line(fleet: Fleet, source: SoundSource, air: SourceInside | None) -> FieldLine:
    if not isinstance(source, StructureSource):
        return FieldLine(source.frequency_hz, number_of(source), np.zeros(0, dtype=np.complex128))
    within = 0.0
    if source.path == "mesh" and air is not None:  # a source inside, whose amplitude its walls' motion tells
        factors = fleet.number("housing.loss_factor"), fleet.number("housing.cavity_loss_factor")
        unit = air.velocities(source.frequency_hz, *factors)
        within = float((np.vdot(unit, source.velocities) / np.vdot(unit, unit)).real)
    return FieldLine(source.frequency_hz, -1, source.velocities, within)


def _points(planes: Sequence[MapPlane], place: int) -> Real:
    return np.concatenate([plane.points_m[plane.place.ravel() == place] for plane in planes])


def near_field_of(
    fleet: Fleet, housing: HousingSound, sound: DriveSound, planes: Sequence[MapPlane], squares: FieldSquares
) -> NearField:
    """Return the maps of a condition.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound
    sound : DriveSound
        Of the condition.
    planes : sequence of MapPlane
    squares : FieldSquares
        Of the task of `near_field_task`.
    """
    field = _FieldOfPoints(fleet, housing, sound.sources, squares.outside)
    outside = field.levels_by_path(_points(planes, OUTSIDE))
    inside = field.inside_by_path(squares.inside)
    maps, first, within = [], 0, 0
    for plane in planes:
        there, air = plane.place == OUTSIDE, plane.place == INSIDE
        levels = {path: np.full(there.shape, math.nan) for path in PATHS}
        counts = int(np.count_nonzero(there)), int(np.count_nonzero(air))
        for path in PATHS:
            levels[path][there] = outside[path][first : first + counts[0]]
            if squares.inside.size:
                levels[path][air] = inside[path][within : within + counts[1]]
        first, within = first + counts[0], within + counts[1]
        maps.append(PlaneMap(plane, levels))
    body, reaches = housing.body, housing.reaches
    low, high = body.ends_m
    points = {(s.path, s.position_m): None for s in sound.sources if not isinstance(s, StructureSource)}
    if housing.inside is not None and any(s.path == "mesh" and isinstance(s, StructureSource) for s in sound.sources):
        points["mesh", housing.inside.source_m] = None
    lines = sorted({source.frequency_hz for source in sound.sources})
    return NearField(
        sound.condition,
        tuple(maps),
        low,
        high,
        tuple(points),
        tuple(frequency for frequency in lines if reaches(frequency)),
        tuple(frequency for frequency in lines if not reaches(frequency)),
        field.adds,
    )


class _FieldOfPoints(HousingField):
    """The housing's field at points for which |p|² is known: levels as everywhere else."""

    def __init__(
        self, fleet: Fleet, housing: HousingSound, sources: Sequence[SoundSource], squares: NDArray[np.float32]
    ) -> None:
        super().__init__(fleet, housing)
        self._sources = sources
        scattered = [source for source in sources if housing.reaches(source.frequency_hz)]
        self._squares = {id(source): row for source, row in zip(scattered, squares, strict=True)}

    def levels_by_path(self, points_m: Real) -> dict[Path, Real]:
        """Levels (points,) of each path and of the total, NaN of a silent one."""
        receivers = [Receiver("", math.hypot(x, y, z), (x, y, z)) for x, y, z in points_m.tolist()]
        return self._by_path(self._sources, 10.0 ** (0.1 * self._received_db(self._sources, receivers)))

    def inside_by_path(self, squares: NDArray[np.float32]) -> dict[Path, Real]:
        """Levels (points,) inside of each path and of the total, of mean squares of the lines in reach."""
        held = [source for source in self._sources if id(source) in self._squares]
        return self._by_path(held, squares / _REFERENCE_PA**2)

    def _by_path(self, sources: Sequence[SoundSource], energies: NDArray[np.floating[Any]]) -> dict[Path, Real]:
        found: dict[Path, Real] = {}
        for path in PATHS:
            wanted = self.adds if path == "total" else (path,)
            rows = [number for number, source in enumerate(sources) if source.path in wanted]
            energy = np.asarray(energies[rows].sum(axis=0), dtype=np.float64)
            levels = np.full(energy.shape, math.nan)
            np.log10(energy, out=levels, where=np.isfinite(energy) & (energy > 0.0))
            found[path] = 10.0 * levels
        return found

    def transfer_db(self, source: SoundSource, receivers: Sequence[Receiver]) -> Real:
        """Return the level at the points less the sound power level of a source, shape (points,)."""
        if id(source) not in self._squares:
            found = np.full(len(receivers), math.nan)  # at the source itself
            places = np.array([receiver.position_m for receiver in receivers]).reshape(-1, 3)
            apart = np.flatnonzero(np.linalg.norm(places - np.asarray(source.position_m), axis=1) >= AT_SOURCE_M)
            found[apart] = super().transfer_db(source, [receivers[number] for number in apart.tolist()])
            return found
        squares = self._squares[id(source)].astype(np.float64)
        if isinstance(source, StructureSource):
            with np.errstate(divide="ignore"):
                return np.asarray(10.0 * np.log10(squares / _REFERENCE_PA**2)) - source.sound_power_level_db
        return self._of_unit_db(source, squares)
