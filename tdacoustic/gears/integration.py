"""The equations integrated in time: the second, independent way to a steady state, and the only one without a period.

Nothing of the harmonic balance is used: the stiffness is the trapezoid of equations (5) and (6) itself, not its series.
Steps do not stop where the stiffness of spur teeth jumps, nor where teeth meet: there the method is of first order
(0.4 % of the waveform of spur teeth; with a mesh damper that needs contact a settled motion may be missed).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import GearError
from tdacoustic.gears.system import GearSystem

__all__ = [
    "LONGEST_REPEAT",
    "MOST_PERIODS",
    "TimeSolution",
    "integrate",
    "real_state",
    "settle",
    "static_state",
]

Real = NDArray[np.float64]

MOST_PERIODS: Final = 6000
"""Mesh periods after which a motion that repeats after none of `LONGEST_REPEAT` counts as not periodic."""

LONGEST_REPEAT: Final = 8
"""Mesh periods: a motion that repeats only after more counts as one that does not repeat."""

SETTLED: Final = 1e-9
"""Largest change of δ from one repeat to the next, over its peak to peak, of a settled motion."""

DISTINCT: Final = 1e-4
"""Change beyond which a motion does not repeat after so many periods; between `SETTLED` and this it may yet."""

RECORD_PERIODS: Final = 512
"""Mesh periods of the record of a motion that does not repeat; a quarter of `most_periods`, where that is less."""

_RADIANS_PER_STEP: Final = 0.06
_FEWEST_STEPS: Final = 256
_BLOCK: Final = 32


@dataclass(frozen=True)
class TimeSolution:
    """The end of a time integration.

    Parameters
    ----------
    mesh_hz : float
    displacement_m, force_n : ndarray, shape (periods, steps)
        δ and F at equal steps of the last mesh periods: as many as the motion takes to repeat, or `RECORD_PERIODS`.
    repeats_after : int or None
        Mesh periods after which the motion repeats; None where it does not.
    state : ndarray, shape (14,) or more
        At the end: displacements and velocities of the seven coordinates of `ReducedSystem`. With a foundation, the
        real and then the imaginary parts of the vibrations of `MeshPoles`.
    periods : int
        Mesh periods that were integrated.
    """

    mesh_hz: float
    displacement_m: Real
    force_n: Real
    repeats_after: int | None
    state: Real
    periods: int


class _March:
    """Integrates block by block."""

    def __init__(self, system: GearSystem, mesh_hz: float, torque_n_m: float, steps: int | None) -> None:
        moving = system.foundation is not None
        fastest_hz = max(system.fastest_hz, system.mesh_poles.fastest_hz if moving else 0.0)
        turning = 2.0 * math.pi * fastest_hz / mesh_hz
        self.steps = steps or max(_FEWEST_STEPS, 16 * math.ceil(turning / _RADIANS_PER_STEP / 16))
        half_steps = np.arange(2 * self.steps) / (2 * self.steps)
        self._stiffness = system.mesh_stiffness_n_per_m * system.contact_lines.relative(half_steps)
        self._error = system.transmission_error_at(half_steps)
        self._step_s = 1.0 / (mesh_hz * self.steps)
        needs_contact = 1.0 if system.mesh_damping == "contact" else 0.0
        mesh = [system.mesh_damping_n_s_per_m, system.half_backlash_m, needs_contact]
        self._is_of_poles = moving
        self._arrays: tuple[NDArray[Any], ...]
        if moving:
            held = system.mesh_poles
            self._arrays = (held.poles, held.driven, held.felt, held.turned * torque_n_m)
            self._mesh = np.array([*mesh, system.mesh_stiffness_n_per_m])
        else:
            reduced, drive = system.reduced, np.zeros(7)
            drive[6] = torque_n_m / system.base_radii_m[0]
            self._arrays = (reduced.direction, 1.0 / reduced.masses, reduced.stiffness, reduced.damping, drive)
            self._mesh = np.array(mesh)

    def run(self, state: Real, periods: int) -> tuple[Real, Real]:
        """Integrate from a state, which becomes the end; return δ and F, shape (periods, steps)."""
        from tdacoustic.gears.kernels import march, march_of_poles

        deltas, forces = np.empty((periods, self.steps)), np.empty((periods, self.steps))
        given = self._stiffness, self._error, self._step_s, *self._arrays, self._mesh, deltas, forces
        if self._is_of_poles:
            vibrations = complex_state(state)
            march_of_poles(vibrations, periods, *given)
            state[:] = real_state(vibrations)
        else:
            march(state, periods, *given)
        if not np.isfinite(state).all():
            raise GearError(f"the time integration at {1.0 / (self._step_s * self.steps):.6g} Hz left all bounds")
        return deltas, forces


def real_state(vibrations: NDArray[np.complex128]) -> Real:
    """Return the vibrations of `MeshPoles` as real numbers: real parts, then imaginary ones."""
    return np.concatenate([vibrations.real, vibrations.imag])


def complex_state(state: Real) -> NDArray[np.complex128]:
    """Return the vibrations that `real_state` took apart."""
    half = state.size // 2
    return np.asarray(state[:half] + 1j * state[half:])


def static_state(system: GearSystem, torque_n_m: float) -> Real:
    """Return the state of rest under a torque with the mesh at its mean stiffness, as `TimeSolution` has it."""
    force = system.mean_force_n(torque_n_m)
    if system.foundation is not None:
        side = math.copysign(system.half_backlash_m, force) if force else 0.0
        return real_state(system.mesh_poles.at_rest(-system.mesh_stiffness_n_per_m * side, torque_n_m))
    reduced = system.reduced
    state = np.zeros(14)
    state[:6] = -reduced.direction[:6] * force / reduced.stiffness[:6]
    delta = force / system.mesh_stiffness_n_per_m + (math.copysign(system.half_backlash_m, force) if force else 0.0)
    state[6] = (delta - float(reduced.direction[:6] @ state[:6])) / reduced.direction[6]
    return state


def integrate(
    system: GearSystem,
    mesh_hz: float,
    torque_n_m: float,
    periods: int,
    start: Real | None = None,
    steps: int | None = None,
) -> TimeSolution:
    """Integrate a number of mesh periods.

    Parameters
    ----------
    system : GearSystem
    mesh_hz : float
        Above zero.
    torque_n_m : float
        On the pinion; the wheel's balances it.
    periods : int
    start : ndarray, shape (14,) or more, optional
        As `TimeSolution` has it. Default: `static_state`.
    steps : int, optional
        Of a mesh period. Default: 0.06 rad of the fastest natural frequency.

    Returns
    -------
    TimeSolution
        With every period; whether it repeats is not looked at.
    """
    held = _March(system, mesh_hz, torque_n_m, steps)
    state = static_state(system, torque_n_m) if start is None else np.array(start, dtype=np.float64)
    deltas, forces = held.run(state, periods)
    return TimeSolution(mesh_hz, deltas, forces, None, state, periods)


def settle(
    system: GearSystem, mesh_hz: float, torque_n_m: float, start: Real | None = None, most_periods: int = MOST_PERIODS
) -> TimeSolution:
    """Integrate until the motion repeats after 1 to 8 mesh periods, or is known not to.

    Parameters
    ----------
    system, mesh_hz, torque_n_m, start
        As of `integrate`.
    most_periods : int
    """
    held = _March(system, mesh_hz, torque_n_m, None)
    state = static_state(system, torque_n_m) if start is None else np.array(start, dtype=np.float64)
    done = 0
    for block in _blocks(most_periods):
        deltas, forces = held.run(state, block)
        done += block
        repeat = _repeats_after(deltas)
        if repeat is not None:
            return TimeSolution(mesh_hz, deltas[-repeat:], forces[-repeat:], repeat, state, done)
    record = min(RECORD_PERIODS, most_periods // 4)
    deltas, forces = held.run(state, record)
    return TimeSolution(mesh_hz, deltas, forces, None, state, done + record)


def _blocks(most_periods: int) -> Iterator[int]:
    done, block = 0, _BLOCK
    while done < most_periods:
        yield block
        done += block
        block = min(2 * block, 16 * _BLOCK)


def _repeats_after(deltas: Real) -> int | None:
    """Return after how many periods the end of a record repeats within `SETTLED`."""
    swing = float(deltas[-LONGEST_REPEAT:].max() - deltas[-LONGEST_REPEAT:].min()) + 1e-18
    for repeat in range(1, LONGEST_REPEAT + 1):
        change = float(np.abs(deltas[-repeat:] - deltas[-2 * repeat : -repeat]).max()) / swing
        if change <= SETTLED:
            return repeat
        if change <= DISTINCT:
            return None  # on its way to repeat after so many, and not after a multiple of them
    return None
