"""Levels of a drive's sources on the 4 m surface, at microphones and around a circle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.sources import SoundSource, StructureSource
from tdacoustic.fleet import Fleet
from tdacoustic.gears import BearingForces
from tdacoustic.radiation import Air, absorption_db_per_m, mean_over_sphere_db, overall_level_db, transfer_db
from tdacoustic.spectra.weighting import a_weighting_db

__all__ = ["CIRCLE_DEG", "LevelAt", "PointField", "Receiver", "circle_of"]

Real = NDArray[np.float64]
Point = tuple[float, float, float]
Path = Literal["structure", "mesh", "motor", "total"]
PATHS: tuple[Path, ...] = ("structure", "mesh", "motor", "total")
Weighting = Literal["Z", "A"]
WEIGHTINGS: tuple[Weighting, ...] = ("Z", "A")

CIRCLE_DEG: Final = tuple(5.0 * number for number in range(72))
"""Angles of the directivity in degrees, from x towards y."""


@dataclass(frozen=True)
class Receiver:
    """Where a level is wanted.

    Parameters
    ----------
    name : str
    distance_m : float
        From the drive's centre.
    position_m : (float, float, float), optional
        In the drive's frame; without it only the distance is known, and the level is the mean over the sphere of that
        radius (over the half sphere above ground).
    """

    name: str
    distance_m: float
    position_m: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class LevelAt:
    """A level of one path at one receiver.

    Parameters
    ----------
    receiver : str
    path : {"structure", "mesh", "motor", "total"}
    weighting : {"Z", "A"}
    level_db : float or None
        None of a path that has no sound, or that the model does not have.
    """

    receiver: str
    path: Path
    weighting: Weighting
    level_db: float | None


class PointField:
    """The sound field of a fleet's point sources in the space of ``[radiation]``.

    Over rigid ground the ground lies at the rail, half a wheel diameter below the drive's centre [assumed].

    Parameters
    ----------
    fleet : Fleet

    Attributes
    ----------
    surface : Receiver
        That of ``[radiation] sphere_radius_m``.
    circle : tuple of Receiver
        Around the circle of ``[radiation] circle_radius_m`` in the plane z = 0, every 5°.
    adds : tuple of str
        Paths that the total adds.
    mesh_position_m : (float, float, float) or None
        Where the mesh's free source stands; None of the fleet's own.
    """

    mesh_position_m: Point | None = None

    def __init__(self, fleet: Fleet) -> None:
        radiation = fleet.radiation
        self._space = radiation.space.value
        self._sound_speed_m_s = Air(fleet.number("radiation.temperature_degc")).sound_speed_m_s
        self._ground_m = -0.5 * fleet.train.wheel_diameter_m if self._space == "half" else None
        self.surface = Receiver(f"{radiation.sphere_radius_m.value:g} m", radiation.sphere_radius_m.value)
        self._absorbing = fleet.radiation.air_absorption.value
        self._air = (fleet.number("radiation.temperature_degc"), fleet.radiation.humidity_percent.value)
        self.circle = circle_of(fleet)
        self.adds = paths_of_total(fleet)

    def structure_sources(self, forces: BearingForces | None) -> tuple[StructureSource, ...]:
        """Return the tones of the housing under bearing forces: none of a field without housing."""
        return ()

    def meshing(self, source: SoundSource) -> SoundSource | None:
        """Return the meshing noise as the field has it: the free source, wherever it is put."""
        return source

    def doubts(self, sources: Sequence[SoundSource]) -> Iterator[str]:
        """Yield what the reader must know of the field of sources."""
        yield from ()

    def transfer_db(self, source: SoundSource, receivers: Sequence[Receiver]) -> Real:
        """Return the level at receivers less the sound power level of a source, shape (receivers,)."""
        return np.array([self._free_db(source, receiver) for receiver in receivers])

    def _free_db(self, source: SoundSource, receiver: Receiver) -> float:
        if receiver.position_m is None:
            return mean_over_sphere_db(receiver.distance_m, self._space)
        found = transfer_db(
            source.position_m, receiver.position_m, source.frequency_hz, self._sound_speed_m_s, self._ground_m
        )
        return float(found)

    def levels(self, sources: Sequence[SoundSource], receivers: Sequence[Receiver]) -> tuple[LevelAt, ...]:
        """Return the level of each path and of the total at each receiver, unweighted and A-weighted.

        Parameters
        ----------
        sources : sequence of SoundSource
        receivers : sequence of Receiver
        """
        found = []
        plain = self._received_db(sources, receivers)
        received = {weighting: plain + _weights_db(sources, weighting) for weighting in WEIGHTINGS}
        for number, receiver in enumerate(receivers):
            for weighting in WEIGHTINGS:
                held = received[weighting][:, number]
                found += [LevelAt(receiver.name, path, weighting, self._of_path(path, sources, held)) for path in PATHS]
        return tuple(found)

    def received_db(self, sources: Sequence[SoundSource], receiver: Receiver, weighting: Weighting = "Z") -> Real:
        """Return the level of each source at a receiver.

        Parameters
        ----------
        sources : sequence of SoundSource
        receiver : Receiver
        weighting : {"Z", "A"}
        """
        return (self._received_db(sources, (receiver,)) + _weights_db(sources, weighting))[:, 0]

    def _received_db(self, sources: Sequence[SoundSource], receivers: Sequence[Receiver]) -> Real:
        """Return the unweighted level of each source at each receiver, shape (sources, receivers)."""
        at = np.empty((len(sources), len(receivers)))
        for row, source in zip(at, sources, strict=True):
            row[:] = source.sound_power_level_db + self.transfer_db(source, receivers)
            if self._absorbing:
                row -= self.absorbed_db(source, receivers)
        return at

    def absorbed_db(self, source: SoundSource, receivers: Sequence[Receiver]) -> Real:
        """Return what the air takes on the straight way from a source to receivers; reflections go as far.

        Parameters
        ----------
        source : SoundSource
        receivers : sequence of Receiver

        Returns
        -------
        ndarray, shape (receivers,)
            In dB.
        """
        ways = [r.distance_m if r.position_m is None else math.dist(r.position_m, source.position_m) for r in receivers]
        return np.array(ways) * float(absorption_db_per_m(source.frequency_hz, *self._air))

    def _of_path(self, path: Path, sources: Sequence[SoundSource], levels_db: Real) -> float | None:
        wanted = self.adds if path == "total" else (path,)
        return overall_level_db([level for s, level in zip(sources, levels_db, strict=True) if s.path in wanted])

    def around_db(self, sources: Sequence[SoundSource]) -> Real:
        """Return the total level around the circle, shape (72,); NaN of no sound."""
        held = [source for source in sources if source.path in self.adds]
        if not held:
            return np.full(len(self.circle), math.nan)
        with np.errstate(divide="ignore"):  # silent: minus infinity
            return np.asarray(10.0 * np.log10(np.sum(10.0 ** (0.1 * self._received_db(held, self.circle)), axis=0)))


def _weights_db(sources: Sequence[SoundSource], weighting: Weighting) -> Real:
    """Return what a weighting adds to the level of each source, shape (sources, 1)."""
    if weighting == "Z":
        return np.zeros((len(sources), 1))
    return a_weighting_db(np.array([source.frequency_hz for source in sources]))[:, None]


def circle_of(fleet: Fleet) -> tuple[Receiver, ...]:
    """Return the receivers around the circle of ``[radiation] circle_radius_m``, from x towards y."""
    radius_m = fleet.radiation.circle_radius_m.value
    return tuple(
        Receiver(f"{angle:g}°", radius_m, (radius_m * math.cos(turn), radius_m * math.sin(turn), 0.0))
        for angle, turn in zip(CIRCLE_DEG, np.radians(CIRCLE_DEG).tolist(), strict=True)
    )


def paths_of_total(fleet: Fleet) -> tuple[Path, ...]:
    """Return the paths that the total adds: the motor, and the gear by ``[model] gear_path`` and Masuda's placement.

    Masuda's source inside of the housing adds what the housing lets through where the housing is computed, and nothing
    with point sources.
    """
    gear_path, placement = fleet.model.gear_path.value, fleet.masuda.placement.value
    heard = placement == "free" or (placement == "inside" and fleet.radiation.method.value == "boundary_elements")
    mesh: tuple[Path, ...] = ("mesh",) if heard else ()
    structure: tuple[Path, ...] = ("structure",)
    of_gear = {"masuda": mesh, "structure": structure, "sum": (*structure, *mesh)}[gear_path]
    return ("motor", *of_gear)
