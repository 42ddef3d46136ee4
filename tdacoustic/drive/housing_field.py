"""The sound field of a drive with its housing: transfer vectors in, levels out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.housing_solid import solid_notes
from tdacoustic.drive.insertion_loss import InsertionLoss, with_conditions
from tdacoustic.drive.levels import PointField, Receiver
from tdacoustic.drive.prediction import GearState, HousingFacts
from tdacoustic.drive.source_inside import HousingCavity, SourceInside
from tdacoustic.drive.sources import SoundSource, StructureSource
from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.gears import BearingForces
from tdacoustic.gears.masuda import SPHERE_OF_1_M_DB
from tdacoustic.housing import Box, HousingModes, SolidHousing, SolidModes, seat_loads
from tdacoustic.radiation import mean_over_sphere_db
from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.radiation.received import MeanVectors, PointVectors

__all__ = ["HousingField", "HousingSound", "number_of"]

Real = NDArray[np.float64]
Point = tuple[float, float, float]

_REFERENCE_PA = 2e-5
_MESH, _MOTOR = 0, 1
"""Numbers of the sources in transfer vectors."""


@dataclass(frozen=True, eq=False)
class HousingSound:
    """The computed transfer vectors of a housing.

    Parameters
    ----------
    box : Box or SolidHousing
        With the fleet's loss factor and gears.
    body : BodyInAir
    modes : HousingModes or SolidModes
    mean : MeanVectors
    points : PointVectors
    cavity : HousingCavity, optional
        The air inside, where there is any that can be computed.
    insertion_loss : InsertionLoss, optional
    """

    box: Box | SolidHousing
    body: BodyInAir
    modes: HousingModes | SolidModes
    mean: MeanVectors
    points: PointVectors
    cavity: HousingCavity | None = None
    insertion_loss: InsertionLoss | None = None

    @cached_property
    def inside(self) -> SourceInside | None:
        """A source in the air inside; None without it."""
        if self.cavity is None or not isinstance(self.modes, HousingModes):
            return None
        return SourceInside(self.cavity, self.modes.frequency_hz, self.body.position_m)

    @cached_property
    def places(self) -> dict[Point, int]:
        """Numbers of the points by their coordinates."""
        return {point: number for number, point in enumerate(self.points.points_m)}

    @property
    def range_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency of the transfer vectors."""
        return float(self.mean.frequency_hz[0]), float(self.mean.frequency_hz[-1])

    def reaches(self, frequency_hz: float) -> bool:
        """Whether the transfer vectors hold at a frequency."""
        low, high = self.range_hz
        return low <= frequency_hz <= high


class HousingField(PointField):
    """The field of the housing that the bearing forces shake, and of point sources that the rigid housing scatters.

    Masuda's level is that of a gear unit with its housing: the power of its source is held, and the housing gives it a
    direction alone. The motor's sources keep their volume flow, so that the housing beside them changes their power.
    Point sources at frequencies that the transfer vectors do not reach are those of free space.

    A receiver without a position takes the level of the surface, moved to its distance with 1/R.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound
    """

    def __init__(self, fleet: Fleet, housing: HousingSound) -> None:
        super().__init__(fleet)
        self.housing = housing
        self._path = fleet.path
        self._step_file = fleet.step_path.name if fleet.step_path is not None else None
        self.mesh_position_m = housing.body.sources_m[_MESH]
        self._loss_factor = fleet.number("housing.loss_factor")
        self._cavity_loss_factor = fleet.number("housing.cavity_loss_factor")
        self._is_inside = fleet.masuda.placement.value == "inside"
        self._gain_db = fleet.model.structure_gain_db.value
        self._surface_db = mean_over_sphere_db(self.surface.distance_m, self._space)

    @property
    def facts(self) -> HousingFacts:
        """What the field was computed with."""
        held = self.housing
        sources = held.body.sources_m
        return HousingFacts(
            held.modes.mass_kg,
            held.modes.frequency_hz[: held.modes.natural],
            len(held.modes.frequency_hz) - held.modes.natural,
            held.range_hz,
            (held.box.share_of_left(held.box.seats[0]), held.box.share_of_left(held.box.seats[1])),
            held.body.position_m,
            sources[_MESH],
            sources[_MOTOR] if len(sources) > _MOTOR else None,
            held.inside.source_m if self._is_inside and held.inside is not None else None,
            *((self._step_file, solid_notes(held.box, held.body)) if isinstance(held.box, SolidHousing) else ()),
        )

    def meshing(self, source: SoundSource) -> SoundSource | None:
        """Return the meshing noise as the field has it; None of a source inside that the housing does not reach.

        The free source as it is; of one inside, the housing that it shakes through the air: its volume flow is held.
        """
        if not self._is_inside:
            return source
        held, frequency = self.housing, source.frequency_hz
        if held.inside is None:
            raise FleetError(f'{self._path}: [masuda] placement = "inside" needs the air inside a parametric box')
        if not held.reaches(frequency):
            return None
        pressure_pa = math.sqrt(2.0) * _REFERENCE_PA * 10.0 ** (0.05 * (source.sound_power_level_db - SPHERE_OF_1_M_DB))
        moved = pressure_pa * held.inside.velocities(frequency, self._loss_factor, self._cavity_loss_factor)
        square = 0.5 * held.mean.of_modes(frequency, moved)
        if not square > 0.0:
            return None
        level = 10.0 * math.log10(square / _REFERENCE_PA**2) - self._surface_db
        return StructureSource("mesh", source.name, frequency, level, held.body.position_m, moved)

    def insertion_loss(self, states: Sequence[GearState]) -> InsertionLoss | None:
        """Return the housing's insertion loss with those at the mesh frequencies of states; None where it has none."""
        held = self.housing
        if held.insertion_loss is None or held.inside is None:
            return None
        factors = self._loss_factor, self._cavity_loss_factor
        return with_conditions(held.insertion_loss, states, held.inside, held.mean, self._surface_db, factors)

    def structure_sources(self, forces: BearingForces | None) -> tuple[StructureSource, ...]:
        """Return the tones of the housing under bearing forces, with ``[model] structure_gain_db``.

        Parameters
        ----------
        forces : BearingForces or None
        """
        if forces is None:
            return ()
        held = self.housing
        there = np.flatnonzero([held.reaches(frequency) for frequency in forces.frequency_hz])
        if not len(there):
            return ()
        frequencies = forces.frequency_hz[there]
        loads = seat_loads(held.box, forces)[:, :, there]
        velocities = held.modes.response(frequencies, loads, self._loss_factor)
        velocities = velocities * 10.0 ** (0.05 * self._gain_db)
        found = []
        for line, frequency, column in zip(there, frequencies.tolist(), velocities.T, strict=True):
            square = 0.5 * held.mean.of_modes(frequency, column)
            if square > 0.0:
                level = 10.0 * math.log10(square / _REFERENCE_PA**2) - self._surface_db
                name = _name(float(forces.harmonic[line]))
                found.append(StructureSource("structure", name, frequency, level, held.body.position_m, column))
        return tuple(found)

    def transfer_db(self, source: SoundSource, receivers: Sequence[Receiver]) -> Real:
        """Return the level at receivers less the sound power level of a source, shape (receivers,)."""
        if not self.housing.reaches(source.frequency_hz):
            return super().transfer_db(source, receivers)
        found = np.empty(len(receivers))
        placed, numbers = [], []
        for number, receiver in enumerate(receivers):
            if receiver.position_m is None:
                moved = 20.0 * math.log10(self.surface.distance_m / receiver.distance_m)
                found[number] = self._mean_db(source) + moved
                continue
            if receiver.position_m not in self.housing.places:
                raise FleetError(
                    f"{self._path}: the transfer vectors of the housing have no receiver {receiver.name} at "
                    f"{receiver.position_m} m"
                )
            placed.append(number)
            numbers.append(self.housing.places[receiver.position_m])
        if placed:
            found[placed] = self._points_db(source, numbers)
        return found

    def _mean_db(self, source: SoundSource) -> float:
        """Level on the surface less the sound power level."""
        if isinstance(source, StructureSource) or source.path == "mesh":
            return self._surface_db
        square = self.housing.mean.of_source(source.frequency_hz, _MOTOR)
        return float(_decibels(np.array(square))) - SPHERE_OF_1_M_DB

    def _points_db(self, source: SoundSource, numbers: Sequence[int]) -> Real:
        """Levels at some points less the sound power level."""
        held = self.housing
        if isinstance(source, StructureSource):
            squares = 0.5 * held.points.of_modes(source.frequency_hz, source.velocities, numbers)
            return _decibels(squares / _REFERENCE_PA**2) - source.sound_power_level_db
        squares = held.points.of_source(held.body, source.frequency_hz, number_of(source), numbers)
        return self._of_unit_db(source, squares)

    def _of_unit_db(self, source: SoundSource, squares: Real) -> Real:
        """Levels less the sound power level of a point source, of |p|² of that source with 1 Pa at 1 m."""
        if number_of(source) == _MOTOR:
            return _decibels(squares) - SPHERE_OF_1_M_DB
        return _decibels(squares / self.housing.mean.of_source(source.frequency_hz, _MESH)) + self._surface_db

    def doubts(self, sources: Sequence[SoundSource]) -> Iterator[str]:
        """Yield what the reader must know of the reach of the transfer vectors."""
        low, high = self.housing.range_hz
        beyond = [s.frequency_hz for s in sources if not self.housing.reaches(s.frequency_hz)]
        if beyond:
            yield (
                f"{len(beyond)} line{'s' if len(beyond) > 1 else ''} of point sources at {min(beyond):.0f} to "
                f"{max(beyond):.0f} Hz lie outside of the {low:.0f} to {high:.0f} Hz that the housing is computed for: "
                "they are not scattered by it"
            )


def number_of(source: SoundSource) -> int:
    """Return the number of a point source among those of the housing's body."""
    return _MESH if source.path == "mesh" else _MOTOR


def _decibels(squares: Real) -> Real:
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(squares))


def _name(harmonic: float) -> str:
    return f"mesh x{harmonic:g}" if math.isfinite(harmonic) else "bearing forces"
