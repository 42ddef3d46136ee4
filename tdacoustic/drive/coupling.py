"""What a housing that gives way changes at the gears: one-way against two-way coupling, by frequency and condition."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.gears import DIRECTIONS, GEARS, GearSystem, SteadyState

if TYPE_CHECKING:
    from tdacoustic.drive.prediction import GearState

__all__ = [
    "COUPLINGS",
    "CoupledCondition",
    "Coupling",
    "CouplingCurves",
    "ForceDifference",
    "coupling_curves",
    "coupling_doubts",
    "values_of",
]

Real = NDArray[np.float64]
Kind = Literal["one_way", "two_way"]

COUPLINGS: Final[tuple[Kind, Kind]] = ("one_way", "two_way")
"""In the order of every array over couplings."""

LOWEST_HZ: Final = 20.0
POINTS_A_WIDTH: Final = 4.0
"""Points of the frequency axis within the width η f of a resonance; steps are no finer than 0.4 % of the frequency."""

_NO_FORCE: Final = 1e-3
"""Part of a gear's largest bearing force below which a direction has none to speak of."""

WORTH_SAYING_DB: Final = 1.0
"""Change of a level from which a reader of one-way results is told of the other coupling [assumed]."""


@dataclass(frozen=True)
class ForceDifference:
    """Two-way less one-way bearing force in one direction, over a range of frequency.

    Parameters
    ----------
    gear, direction : str
    lowest, highest : (float, float)
        In dB, and at which frequency in Hz.
    median_db : float
        Of its magnitude.
    """

    gear: str
    direction: str
    lowest: tuple[float, float]
    highest: tuple[float, float]
    median_db: float

    @property
    def worst(self) -> tuple[float, float]:
        """The one of larger magnitude."""
        return max(self.lowest, self.highest, key=lambda pair: abs(pair[0]))


@dataclass(frozen=True, eq=False)
class CouplingCurves:
    """The gears as the mesh feels them, with teeth in contact at the mean stiffness.

    Parameters
    ----------
    frequency_hz : ndarray, shape (n,)
        Ascending: a fine axis, and the mesh harmonics of the conditions.
    lines : tuple of (str, int) or None, length n
        Condition and harmonic of a mesh line.
    receptance_m_per_n : ndarray, shape (2, n)
        Magnitude of H, by `COUPLINGS`.
    mesh_force_n_per_um : ndarray, shape (2, n)
        Of the mesh per amplitude of a transmission error.
    bearing_force_n_per_um : ndarray, shape (2, 2, 3, n)
        By `COUPLINGS`, pinion and wheel, x, y, z of the gears.
    """

    frequency_hz: Real
    lines: tuple[tuple[str, int] | None, ...]
    receptance_m_per_n: Real
    mesh_force_n_per_um: Real
    bearing_force_n_per_um: Real

    @property
    def difference_db(self) -> Real:
        """Two-way less one-way bearing force, shape (2, 3, n); NaN of a direction that has next to no one-way force."""
        one_way, two_way = self.bearing_force_n_per_um
        there = one_way > _NO_FORCE * one_way.max(axis=1, keepdims=True)
        ratio = np.divide(two_way, one_way, out=np.full_like(one_way, math.nan), where=there)
        return np.asarray(20.0 * np.log10(ratio))

    def differences(self, low_hz: float, high_hz: float) -> tuple[ForceDifference, ...]:
        """Return how far the bearing forces differ between two frequencies: pinion x, y, z, then wheel x, y, z.

        Directions without one-way force (along the shafts of spur gears) are left out.
        """
        held = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        frequency_hz, difference_db = self.frequency_hz[held], self.difference_db
        found = []
        for g, gear in enumerate(GEARS):
            for d, direction in enumerate(DIRECTIONS):
                values = difference_db[g, d, held]
                if not np.isfinite(values).all():
                    continue
                low, high = int(values.argmin()), int(values.argmax())
                lowest = (float(values[low]), float(frequency_hz[low]))
                highest = (float(values[high]), float(frequency_hz[high]))
                found.append(ForceDifference(gear, direction, lowest, highest, float(np.median(np.abs(values)))))
        return tuple(found)


@dataclass(frozen=True)
class CoupledCondition:
    """A condition with either coupling, by `COUPLINGS`.

    Parameters
    ----------
    condition : str
    mesh_hz : float
    dte_pp_m : (float or None, float or None)
    floquet_max : (float or None, float or None)
    structure_db, mesh_db, total_db : (float or None, float or None)
        Levels on the surface; the structure's whether or not the total adds it.
    in_contact : (bool or None, bool or None)
        Whether teeth stay in contact; None of teeth that no torque presses, and of a motion that is not known.

    Values of the coupling that the fleet does not have are None where the harmonic balance finds no stable motion with
    it.
    """

    condition: str
    mesh_hz: float
    dte_pp_m: tuple[float | None, float | None]
    floquet_max: tuple[float | None, float | None]
    structure_db: tuple[float | None, float | None]
    mesh_db: tuple[float | None, float | None]
    total_db: tuple[float | None, float | None]
    in_contact: tuple[bool | None, bool | None]


@dataclass(frozen=True, eq=False)
class Coupling:
    """One-way against two-way coupling of a drive.

    Parameters
    ----------
    used : {"one_way", "two_way"}
        What all other results have.
    highest_hz : float
        Up to which the housing's modes are computed; beyond, the sum of the same modes stands for it.
    curves : CouplingCurves
    conditions : tuple of CoupledCondition
    """

    used: Kind
    highest_hz: float
    curves: CouplingCurves
    conditions: tuple[CoupledCondition, ...]


def coupling_curves(system: GearSystem, highest_hz: float, mesh_hz: Sequence[tuple[str, float]]) -> CouplingCurves:
    """Return the curves of gears on a foundation and of the same gears on seats that do not move.

    Parameters
    ----------
    system : GearSystem
        On a foundation.
    highest_hz : float
    mesh_hz : sequence of (str, float)
        Conditions and their mesh frequencies.
    """
    assert system.foundation is not None
    step = max(system.foundation.loss_factor / POINTS_A_WIDTH, 0.004)
    number = max(2, math.ceil(math.log(highest_hz / LOWEST_HZ) / step) + 1)
    places: list[tuple[float, tuple[str, int] | None]] = [
        (float(frequency), None) for frequency in np.geomspace(LOWEST_HZ, highest_hz, number)
    ]
    for name, mesh in mesh_hz:
        places += [(mesh * k, (name, k)) for k in range(1, int(highest_hz / mesh) + 1)]
    places.sort(key=lambda place: place[0])
    frequency_hz = np.array([place[0] for place in places])
    found = [_of_one(held, frequency_hz) for held in (system.on_rigid_seats, system)]
    receptance, mesh_force, bearing = (np.stack(values) for values in zip(*found, strict=True))
    return CouplingCurves(frequency_hz, tuple(place[1] for place in places), receptance, mesh_force, bearing)


def _of_one(system: GearSystem, frequency_hz: Real) -> tuple[Real, Real, Real]:
    """Magnitudes of H, of the mesh force and of the bearing forces per um of transmission error."""
    receptance = system.receptance_m_per_n(frequency_hz)
    omega = 2.0 * np.pi * frequency_hz
    bonded = system.mesh_stiffness_n_per_m + 1j * omega * system.mesh_damping_n_s_per_m
    mesh_force = 1e-6 * system.mesh_stiffness_n_per_m / (1.0 + receptance * bonded)
    _, per_force = system.per_mesh_force(frequency_hz)
    bearing = np.abs(per_force * mesh_force[:, None]).T.reshape(2, 3, -1)
    return np.abs(receptance), np.abs(mesh_force), bearing


def coupling_doubts(coupling: Coupling, states: Sequence[GearState]) -> Iterator[str]:
    """Yield what the reader must know of the coupling before using the numbers."""
    if coupling.used == "two_way":
        in_time = [state.condition.name for state in states if state.steady.method == "time_integration"]
        if in_time:
            yield (
                f"condition{'s' if len(in_time) > 1 else ''} {', '.join(in_time)}: with two-way coupling the "
                "integration in time takes the housing's loss factor as viscous dampers"
            )
        return
    worst = max(
        (
            (abs(two - one), held.condition, two - one)
            for held in coupling.conditions
            for one, two in [held.total_db]
            if one is not None and two is not None
        ),
        default=None,
    )
    if worst is not None and worst[0] >= WORTH_SAYING_DB:
        yield (
            "one-way coupling: with a housing that gives way under the gears the total would be "
            f"{worst[0]:.1f} dB {'higher' if worst[2] > 0.0 else 'lower'} in condition {worst[1]}, where it differs "
            'most ([model] coupling = "two_way")'
        )


def values_of(state: SteadyState | None) -> tuple[float | None, float | None, bool | None]:
    """Return peak to peak, largest multiplier and whether teeth stay in contact, of a motion that may not be known."""
    if state is None:
        return None, None, None
    multiplier = state.floquet_max if math.isfinite(state.floquet_max) else None
    return state.dte_pp_m, multiplier, None if state.method == "at_rest" else not state.separates
