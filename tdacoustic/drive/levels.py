"""Levels of a drive's sources on the 4 m surface, at microphones and around a circle."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.sources import SoundSource
from tdacoustic.fleet import Fleet
from tdacoustic.radiation import Air, mean_over_sphere_db, overall_level_db, transfer_db
from tdacoustic.spectra.weighting import a_weighting_db

__all__ = ["LevelAt", "PointField", "Receiver"]

Path = Literal["structure", "mesh", "motor", "total"]
PATHS: tuple[Path, ...] = ("structure", "mesh", "motor", "total")
Weighting = Literal["Z", "A"]
WEIGHTINGS: tuple[Weighting, ...] = ("Z", "A")


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
    adds : tuple of str
        Paths that the total adds.
    """

    def __init__(self, fleet: Fleet) -> None:
        radiation = fleet.radiation
        self._space = radiation.space.value
        self._sound_speed_m_s = Air(fleet.number("radiation.temperature_degc")).sound_speed_m_s
        self._ground_m = -0.5 * fleet.train.wheel_diameter_m if self._space == "half" else None
        self.surface = Receiver(f"{radiation.sphere_radius_m.value:g} m", radiation.sphere_radius_m.value)
        self._circle_m = radiation.circle_radius_m.value
        self.adds = paths_of_total(fleet)

    def transfer_db(self, source: SoundSource, receiver: Receiver) -> float:
        """Level at a receiver less the sound power level of a source."""
        if receiver.position_m is None:
            return mean_over_sphere_db(receiver.distance_m, self._space)
        found = transfer_db(
            source.position_m, receiver.position_m, source.frequency_hz, self._sound_speed_m_s, self._ground_m
        )
        return float(found)

    def levels(self, sources: Sequence[SoundSource], receivers: Iterable[Receiver]) -> tuple[LevelAt, ...]:
        """Return the level of each path and of the total at each receiver, unweighted and A-weighted.

        Parameters
        ----------
        sources : sequence of SoundSource
        receivers : iterable of Receiver
        """
        found = []
        for receiver in receivers:
            for weighting in WEIGHTINGS:
                held = self.received_db(sources, receiver, weighting)
                found += [LevelAt(receiver.name, path, weighting, self._of_path(path, sources, held)) for path in PATHS]
        return tuple(found)

    def received_db(
        self, sources: Sequence[SoundSource], receiver: Receiver, weighting: Weighting = "Z"
    ) -> list[float]:
        """Return the level of each source at a receiver.

        Parameters
        ----------
        sources : sequence of SoundSource
        receiver : Receiver
        weighting : {"Z", "A"}
        """
        at = [source.sound_power_level_db + self.transfer_db(source, receiver) for source in sources]
        if weighting == "Z":
            return at
        return [level + float(a_weighting_db(s.frequency_hz)) for level, s in zip(at, sources, strict=True)]

    def _of_path(self, path: Path, sources: Sequence[SoundSource], levels_db: Sequence[float]) -> float | None:
        wanted = self.adds if path == "total" else (path,)
        return overall_level_db([level for s, level in zip(sources, levels_db, strict=True) if s.path in wanted])

    def around_db(self, sources: Sequence[SoundSource], angles_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the total level around the circle in the plane z = 0, at angles from x towards y; NaN of no sound."""
        around = []
        for angle in np.radians(angles_deg):
            place = (self._circle_m * math.cos(angle), self._circle_m * math.sin(angle), 0.0)
            receiver = Receiver("circle", self._circle_m, place)
            held = [s for s in sources if s.path in self.adds]
            level = overall_level_db([s.sound_power_level_db + self.transfer_db(s, receiver) for s in held])
            around.append(math.nan if level is None else level)
        return np.array(around)


def paths_of_total(fleet: Fleet) -> tuple[Path, ...]:
    """Return the paths that the total adds: the motor, and the gear by ``[model] gear_path`` and Masuda's placement.

    Masuda's source inside of the housing or off adds nothing here: what the housing lets through is part of the
    housing's model.
    """
    gear_path = fleet.model.gear_path.value
    mesh: tuple[Path, ...] = ("mesh",) if fleet.masuda.placement.value == "free" else ()
    structure: tuple[Path, ...] = ("structure",)
    of_gear = {"masuda": mesh, "structure": structure, "sum": (*structure, *mesh)}[gear_path]
    return ("motor", *of_gear)
