"""What a gear pair does at one speed and load: which motion, found how, and whether it is stable."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import GearError
from tdacoustic.gears.floquet import floquet_multipliers, samples_of_period
from tdacoustic.gears.harmonic_balance import HarmonicSolution, periodic_solution
from tdacoustic.gears.integration import (
    LONGEST_REPEAT,
    MOST_PERIODS,
    TimeSolution,
    integrate,
    real_state,
    settle,
)
from tdacoustic.gears.lines import Lines, lines_of_harmonics, lines_of_record, lines_of_repeat
from tdacoustic.gears.system import GearSystem

__all__ = ["STABLE", "SteadyState", "balanced_state", "steady_state"]

STABLE: Final = 1.0 + 1e-6
"""Largest Floquet multiplier of a solution that is taken; beyond it the time integration takes over. Without any
damping multipliers lie on the unit circle, up to the round-off of the monodromy matrix."""

FIRST_PERIODS: Final = 16
"""Mesh periods integrated from rest whose last one is where Newton's method starts when teeth separate. From there it
reached all of 84 random motions that separate and repeat; from teeth that cannot separate alone, 57."""

WAVEFORM_SAMPLES: Final = 512
"""Samples of δ kept of a mesh period."""


@dataclass(frozen=True)
class SteadyState:
    """The steady state of a gear pair at one speed and load.

    Parameters
    ----------
    mesh_hz : float
    torque_n_m : float
        On the pinion, signed: below zero the wheel drives and the other flanks touch.
    method : {"harmonic_balance", "time_integration", "at_rest"}
        Which way produced it; ``"at_rest"`` without torque, where the teeth do not touch.
    repeats_after : int or None
        Mesh periods after which the motion repeats: 1 of a periodic one, 2 after a period doubling, None of one that
        does not repeat.
    floquet_max : float
        Largest Floquet multiplier, in magnitude, without the rigid rotation: of the solution that repeats each mesh
        period, where one was found; above 1 that one is unstable and not the motion given here. Where none was found,
        of the motion given here. NaN of one that does not repeat.
    contact_part : float
        Part of the time in which teeth touch.
    dte_pp_m : float
        Peak to peak of δ; of the whole record where the motion does not repeat.
    static_compression_m : float
        F_0 / k̄.
    mean_displacement_m, mean_force_n : float
        Of δ and F.
    lines : Lines
        Of F.
    waveform_m : ndarray, shape (periods, samples)
        δ over the mesh periods of one repeat, or the first ones of the record.
    state : ndarray, shape (14,) or more
        As a mesh period begins, in the coordinates of `TimeSolution`. Empty where the balance found the motion of gears
        on a foundation: there it follows from the lines.
    residual : float
        Of the harmonic balance over its scale; NaN where it did not produce the motion.
    """

    mesh_hz: float
    torque_n_m: float
    method: Literal["harmonic_balance", "time_integration", "at_rest"]
    repeats_after: int | None
    floquet_max: float
    contact_part: float
    dte_pp_m: float
    static_compression_m: float
    mean_displacement_m: float
    mean_force_n: float
    lines: Lines
    waveform_m: NDArray[np.float64]
    state: NDArray[np.float64]
    residual: float

    @property
    def is_periodic(self) -> bool:
        """Whether the motion repeats after each mesh period."""
        return self.repeats_after == 1

    @property
    def separates(self) -> bool:
        """Whether teeth under torque leave each other."""
        return self.contact_part < 1.0 and self.torque_n_m != 0.0


def steady_state(
    system: GearSystem,
    mesh_hz: float,
    torque_n_m: float,
    start: SteadyState | None = None,
    most_periods: int = MOST_PERIODS,
) -> SteadyState:
    """Return the steady state at one speed and load.

    The harmonic balance is solved first. Where it finds no stable periodic solution the equations are integrated in
    time; if that ends in a periodic motion the balance is solved again from there, so that what is returned as periodic
    and found by the balance is always converged and stable.

    Parameters
    ----------
    system : GearSystem
    mesh_hz : float
        Above zero.
    torque_n_m : float
        On the pinion, signed; the wheel's balances it. Zero is a case: the teeth do not touch.
    start : SteadyState, optional
        Where to start, for sweeps. Default: teeth that do not separate; where several motions are stable, the one that
        is reached from there.
    most_periods : int
        Of the time integration, before a motion counts as not repeating.

    Raises
    ------
    GearError
        A speed or torque that is no number, or a speed not above zero.
    """
    if not (math.isfinite(mesh_hz) and mesh_hz > 0.0):
        raise GearError(f"mesh frequency must be > 0 Hz, got {mesh_hz!r}")
    if not math.isfinite(torque_n_m):
        raise GearError(f"torque must be a number, got {torque_n_m!r}")
    if torque_n_m == 0.0:
        return _at_rest(system, mesh_hz)
    force = system.mean_force_n(torque_n_m)
    found = _first_stable(system, mesh_hz, force, start)
    if found is not None and found[1] <= STABLE:
        return _of_balance(system, torque_n_m, *found)
    state = _state_at(system, start) if start is not None and start.method != "at_rest" else None
    settled = settle(system, mesh_hz, torque_n_m, state, most_periods)
    again = _from_time(system, force, settled)
    if again is not None and again[1] <= STABLE and (start is None or settled.repeats_after == 1):
        return _of_balance(system, torque_n_m, *again)
    unstable = next((pair for pair in (again, found) if pair is not None and pair[1] > STABLE), None)
    return _of_time(system, torque_n_m, settled, unstable)


def balanced_state(system: GearSystem, mesh_hz: float, torque_n_m: float) -> SteadyState | None:
    """Return the stable motion that the harmonic balance reaches from teeth that cannot separate, or None of none.

    Nothing is integrated in time, so it takes milliseconds whatever the gears do.

    Parameters
    ----------
    system, mesh_hz, torque_n_m
        As of `steady_state`.
    """
    if torque_n_m == 0.0:
        return _at_rest(system, mesh_hz)
    solution = periodic_solution(system, mesh_hz, system.mean_force_n(torque_n_m))
    judged = None if solution is None else _judged(system, solution)
    return _of_balance(system, torque_n_m, *judged) if judged is not None and judged[1] <= STABLE else None


Judged: TypeAlias = tuple[HarmonicSolution, float]
"""A solution and its largest multiplier."""


def _judged(system: GearSystem, solution: HarmonicSolution) -> Judged:
    samples = samples_of_period(system, solution.mesh_hz)
    finer = max(1, math.ceil(2 * solution.displacement_m.size / samples))
    displacement = solution.displacement_at(samples * finer)[::finer]
    multipliers = floquet_multipliers(system, solution.mesh_hz, displacement[None, :])
    return solution, float(np.abs(multipliers[0]))


def _first_stable(system: GearSystem, mesh_hz: float, force: float, start: SteadyState | None) -> Judged | None:
    """Return the first stable solution of the balance from several starts, else an unstable one, else None."""
    unstable = None
    for first in _starts(system, mesh_hz, force, start):
        solution = periodic_solution(system, mesh_hz, force, first)
        if solution is None:
            continue
        judged = _judged(system, solution)
        if judged[1] <= STABLE:
            return judged
        unstable = unstable or judged
    return unstable


def _starts(
    system: GearSystem, mesh_hz: float, force: float, start: SteadyState | None
) -> Iterator[NDArray[np.complex128] | None]:
    """Yield starts of Newton's method; from a motion that does not repeat each period there is none."""
    if start is not None and start.method != "at_rest":
        if start.is_periodic:
            yield np.fft.rfft(start.waveform_m[0], norm="forward")
        return
    yield None
    if system.foundation is not None:
        beside = periodic_solution(system.on_rigid_seats, mesh_hz, force)
        if beside is not None:
            yield beside.displacement_m
    torque_n_m = force * system.base_radii_m[0] * math.cos(system.base_helix_angle_rad)
    first = integrate(system, mesh_hz, torque_n_m, FIRST_PERIODS)
    yield np.fft.rfft(first.displacement_m[-1], norm="forward")


def _from_time(system: GearSystem, force: float, settled: TimeSolution) -> Judged | None:
    """Return the solution of the balance that Newton's method reaches from an integrated motion's mean period."""
    if settled.repeats_after is None:
        return None
    start = np.fft.rfft(settled.displacement_m.mean(axis=0), norm="forward")
    solution = periodic_solution(system, settled.mesh_hz, force, start)
    return None if solution is None else _judged(system, solution)


def _at_rest(system: GearSystem, mesh_hz: float) -> SteadyState:
    """Without torque the teeth stand somewhere in the gap, which is wider than the transmission error."""
    nothing = np.zeros(0)
    lines = Lines(nothing, nothing, nothing.astype(np.complex128))
    still = np.zeros((1, WAVEFORM_SAMPLES))
    return SteadyState(mesh_hz, 0.0, "at_rest", 1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, lines, still, np.zeros(14), math.nan)


def _of_balance(system: GearSystem, torque_n_m: float, solution: HarmonicSolution, multiplier: float) -> SteadyState:
    force = float(solution.force_n[0].real)
    finer = math.ceil(2 * solution.displacement_m.size / WAVEFORM_SAMPLES)
    return SteadyState(
        solution.mesh_hz,
        torque_n_m,
        "harmonic_balance",
        1,
        multiplier,
        solution.contact_part,
        solution.dte_pp_m,
        force / system.mesh_stiffness_n_per_m,
        float(solution.displacement_m[0].real),
        force,
        lines_of_harmonics(solution.mesh_hz, solution.force_n),
        solution.displacement_at(WAVEFORM_SAMPLES * finer)[None, ::finer],
        _state_of(system, solution),
        solution.residual,
    )


def _state_of(system: GearSystem, solution: HarmonicSolution) -> NDArray[np.float64]:
    """Return the state as the mesh period begins."""
    if system.foundation is not None:
        return np.zeros(0)
    lines = lines_of_harmonics(solution.mesh_hz, solution.force_n)
    reduced = system.reduced
    motion = reduced.response(lines.force_n, lines.frequency_hz)
    state = np.zeros(14)
    state[:6] = -reduced.direction[:6] * float(solution.force_n[0].real) / reduced.stiffness[:6]
    mean = float(solution.displacement_m[0].real)
    state[6] = (mean - float(reduced.direction[:6] @ state[:6])) / reduced.direction[6]
    state[:7] += motion.real.sum(axis=0)
    state[7:] = (2.0j * np.pi * lines.frequency_hz[:, None] * motion).real.sum(axis=0)
    return state


def _state_at(system: GearSystem, steady: SteadyState) -> NDArray[np.float64]:
    """Return the state as a mesh period begins; on a foundation what the mesh force beyond bonded teeth makes of it."""
    if steady.state.size:
        return steady.state
    held, lines = system.mesh_poles, steady.lines
    bonded = system.mesh_stiffness_n_per_m + 2j * np.pi * lines.frequency_hz * system.mesh_damping_n_s_per_m
    beyond = lines.force_n * (1.0 + bonded * system.receptance_m_per_n(lines.frequency_hz))
    mean = steady.mean_force_n - system.mesh_stiffness_n_per_m * steady.mean_displacement_m
    return real_state(held.at_rest(mean, steady.torque_n_m) + held.response(beyond, lines.frequency_hz))


def _of_time(system: GearSystem, torque_n_m: float, settled: TimeSolution, unstable: Judged | None) -> SteadyState:
    delta, force, repeat = settled.displacement_m, settled.force_n, settled.repeats_after
    lines = (lines_of_record if repeat is None else lines_of_repeat)(settled.mesh_hz, force)
    error = system.transmission_error_at(np.arange(delta.shape[1]) / delta.shape[1])
    multiplier = math.nan
    if unstable is not None:
        multiplier = unstable[1]
    elif repeat is not None:
        multiplier = float(np.abs(floquet_multipliers(system, settled.mesh_hz, delta)[0]))
    return SteadyState(
        settled.mesh_hz,
        torque_n_m,
        "time_integration",
        repeat,
        multiplier,
        float(np.mean(np.abs(delta - error) > system.half_backlash_m)),
        float(delta.max() - delta.min()),
        system.mean_force_n(torque_n_m) / system.mesh_stiffness_n_per_m,
        float(delta.mean()),
        float(force.mean()),
        lines,
        delta[:LONGEST_REPEAT],
        settled.state,
        math.nan,
    )
