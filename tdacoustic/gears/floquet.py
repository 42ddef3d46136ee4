"""Stability of a periodic motion: its Floquet multipliers."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.gears.system import GearSystem

__all__ = ["floquet_multipliers", "samples_of_period"]

Real = NDArray[np.float64]

_FEWEST_STEPS: Final = 128
_RADIANS_PER_STEP: Final = 0.3
_TERMS: Final = 6
_SUBSAMPLES: Final = 4


def floquet_multipliers(system: GearSystem, mesh_hz: float, displacement_m: Real) -> NDArray[np.complex128]:
    """Return the multipliers of a motion that repeats, largest first, shape (14,).

    The rigid rotation is not among them: its two unit multipliers (a Jordan block) are taken out by the reduction to
    seven coordinates. A motion whose largest multiplier is beyond 1 is not what the gear does. With a foundation there
    are two more for each of its modes, which are damped viscously here (`MeshPoles`).

    Parameters
    ----------
    system : GearSystem
    mesh_hz : float
    displacement_m : ndarray, shape (periods, samples)
        δ over the mesh periods after which it repeats, from the start of a period; the samples of a period are a
        multiple of 4, as `samples_of_period` gives them.
    """
    sample_s = 1.0 / (displacement_m.shape[1] * mesh_hz)
    step_s = _SUBSAMPLES * sample_s
    stiffness, touching = _mesh_of_steps(system, displacement_m)
    damping = np.full(touching.size, system.mesh_damping_n_s_per_m)
    if system.mesh_damping == "contact":
        damping *= touching
        stiffness += _kicks(system, displacement_m, sample_s) / step_s
    if system.foundation is None:
        values = np.linalg.eigvals(_monodromy(system, stiffness, damping, step_s))
    else:
        beyond = stiffness - system.mesh_stiffness_n_per_m, damping - system.mesh_damping_n_s_per_m
        values = system.main_mesh_poles.multipliers(*beyond, step_s)
    return np.asarray(values[np.argsort(-np.abs(values))], dtype=np.complex128)


def _monodromy(system: GearSystem, stiffness: Real, damping: Real, step_s: float) -> Real:
    """Return what a repeat does to a small change of the state, on seats that do not move."""
    from tdacoustic.gears.kernels import monodromy

    reduced = system.reduced
    masses, springs, dampers = 1.0 / reduced.masses, reduced.stiffness, reduced.damping
    return np.asarray(monodromy(stiffness, damping, step_s, reduced.direction, masses, springs, dampers, _TERMS))


def samples_of_period(system: GearSystem, mesh_hz: float) -> int:
    """Return how many samples of a mesh period the multipliers need."""
    turning = 2.0 * math.pi * system.fastest_hz / mesh_hz
    return _SUBSAMPLES * max(_FEWEST_STEPS, math.ceil(turning / _RADIANS_PER_STEP))


def _mesh_of_steps(system: GearSystem, displacement_m: Real) -> tuple[Real, Real]:
    """Return the mean mesh stiffness of each step, none while teeth are apart, and the part of it they touch."""
    periods, samples = displacement_m.shape
    stiffness = system.mesh_stiffness_n_per_m * system.contact_lines.relative((np.arange(samples) + 0.5) / samples)
    error = system.transmission_error_at(np.arange(samples) / samples)
    touching = _part_above_zero((np.abs(displacement_m - error) - system.half_backlash_m).ravel())
    whole = np.tile(stiffness, periods) * touching
    return whole.reshape(-1, _SUBSAMPLES).mean(axis=1), touching.reshape(-1, _SUBSAMPLES).mean(axis=1)


def _kicks(system: GearSystem, displacement_m: Real, sample_s: float) -> Real:
    """Return what a damper that needs contact adds to the time integral of the stiffness of each step, in N s/m.

    As teeth meet at the speed δ' the force jumps by c_m δ'; a motion shifted by dδ meets them dδ/(δ' - e') earlier. So
    the linearised motion gets c_m δ'/(δ' - e') dδ as an impulse (the saltation matrix of the switch), and its negative
    as they part.
    """
    samples = displacement_m.shape[1]
    error = np.tile(system.transmission_error_at(np.arange(samples) / samples), displacement_m.shape[0])
    displacement = displacement_m.ravel()
    gap = np.abs(displacement - error) - system.half_backlash_m
    meets = (gap <= 0.0) & (np.roll(gap, -1) > 0.0)
    parts = (gap > 0.0) & (np.roll(gap, -1) <= 0.0)
    speed = (np.roll(displacement, -1) - displacement) / sample_s
    closing = speed - (np.roll(error, -1) - error) / sample_s
    with np.errstate(divide="ignore", invalid="ignore"):
        kick = np.where(meets | parts, system.mesh_damping_n_s_per_m * speed / closing, 0.0)
    kick = np.where(parts, -kick, kick)
    return np.asarray(np.where(np.isfinite(kick), kick, 0.0).reshape(-1, _SUBSAMPLES).sum(axis=1))


def _part_above_zero(values: Real) -> Real:
    """Part of each interval from a sample to the next of a period in which straight lines between them are above 0."""
    following = np.roll(values, -1)
    above, below = np.maximum(values, following), np.minimum(values, following)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = above / (above - below)
    return np.where(below > 0.0, 1.0, np.where(above <= 0.0, 0.0, part))
