"""Compiled loops: the equations in time, and their monodromy matrix.

This module imports numba; others import it where they use it. Arrays are of the seven coordinates of
`tdacoustic.gears.system.ReducedSystem`; a state is their displacements and then their velocities. On a foundation they
are of the vibrations of `tdacoustic.gears.mesh_poles.MeshPoles`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["march", "march_of_poles", "monodromy"]

Real = NDArray[np.float64]


def _compiled(function: Any) -> Any:
    """Compile on first use, and keep the result where a place for it can be written."""
    try:
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # numba found no such place
        return njit(error_model="numpy")(function)


@_compiled
def _rates(  # type: ignore[no-untyped-def]
    state, rate, stiffness_now, error_now, direction, inverse_mass, stiffness, damping, drive, mesh
):
    """Write the time derivative of a state and return the mesh force; `mesh` is (c_m, b, 1 if c_m needs contact)."""
    n = direction.size
    delta, speed = 0.0, 0.0
    for j in range(n):
        delta += direction[j] * state[j]
        speed += direction[j] * state[n + j]
    gap = delta - error_now
    touching, force = True, 0.0
    if gap > mesh[1]:
        force = stiffness_now * (gap - mesh[1])
    elif gap < -mesh[1]:
        force = stiffness_now * (gap + mesh[1])
    else:
        touching = False
    if touching or mesh[2] == 0.0:
        force += mesh[0] * speed
    for j in range(n):
        rate[j] = state[n + j]
        rate[n + j] = inverse_mass[j] * (
            drive[j] - stiffness[j] * state[j] - damping[j] * state[n + j] - direction[j] * force
        )
    return force


@_compiled
def march(  # type: ignore[no-untyped-def]
    state, periods, stiffness_half_steps, error_half_steps, step_s, direction, inverse_mass, stiffness, damping, drive,
    mesh, deltas, forces,
):  # fmt: skip
    """Integrate whole mesh periods with the classical Runge-Kutta method of fourth order.

    Parameters
    ----------
    state : ndarray, shape (14,)
        Start; overwritten with the end.
    periods : int
    stiffness_half_steps, error_half_steps : ndarray, shape (2 steps,)
        k_m and e over one period, at the steps and between them.
    step_s : float
    direction, inverse_mass, stiffness, damping, drive : ndarray, shape (7,)
        V, 1/M, K, C and the outer forces.
    mesh : ndarray, shape (3,)
        c_m, b, and 1 where c_m needs contact.
    deltas, forces : ndarray, shape (periods, steps)
        Receive δ and F at the steps.
    """
    n, steps = direction.size, stiffness_half_steps.size // 2
    k1, k2, k3, k4 = np.empty(2 * n), np.empty(2 * n), np.empty(2 * n), np.empty(2 * n)
    trial = np.empty(2 * n)
    for period in range(periods):
        for step in range(steps):
            here, between, following = 2 * step, 2 * step + 1, (2 * step + 2) % (2 * steps)
            force = _rates(
                state, k1, stiffness_half_steps[here], error_half_steps[here], direction, inverse_mass, stiffness,
                damping, drive, mesh,
            )  # fmt: skip
            delta = 0.0
            for j in range(n):
                delta += direction[j] * state[j]
            deltas[period, step] = delta
            forces[period, step] = force
            for j in range(2 * n):
                trial[j] = state[j] + 0.5 * step_s * k1[j]
            _rates(
                trial, k2, stiffness_half_steps[between], error_half_steps[between], direction, inverse_mass, stiffness,
                damping, drive, mesh,
            )  # fmt: skip
            for j in range(2 * n):
                trial[j] = state[j] + 0.5 * step_s * k2[j]
            _rates(
                trial, k3, stiffness_half_steps[between], error_half_steps[between], direction, inverse_mass, stiffness,
                damping, drive, mesh,
            )  # fmt: skip
            for j in range(2 * n):
                trial[j] = state[j] + step_s * k3[j]
            _rates(
                trial, k4, stiffness_half_steps[following], error_half_steps[following], direction, inverse_mass,
                stiffness, damping, drive, mesh,
            )  # fmt: skip
            for j in range(2 * n):
                state[j] += step_s / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])


@_compiled
def monodromy(mesh_stiffness, mesh_damping, step_s, direction, inverse_mass, stiffness, damping, terms) -> Any:  # type: ignore[no-untyped-def]
    """Return the monodromy matrix of the linearised motion, shape (14, 14).

    Over each step the mesh has the stiffness and damping of that step's mean; the exponential of the step's matrix is
    applied by its Taylor series.

    Parameters
    ----------
    mesh_stiffness, mesh_damping : ndarray, shape (steps,)
        k_m and c_m where teeth touch (or always), over one period.
    step_s : float
    direction, inverse_mass, stiffness, damping : ndarray, shape (7,)
    terms : int
        Of the series.
    """
    n = direction.size
    whole = np.eye(2 * n)
    term, following = np.empty((2 * n, 2 * n)), np.empty((2 * n, 2 * n))
    shape = inverse_mass * direction
    own_stiffness, own_damping = inverse_mass * stiffness, inverse_mass * damping
    for step in range(mesh_stiffness.size):
        k, c = mesh_stiffness[step], mesh_damping[step]
        term[:, :] = whole
        for order in range(1, terms + 1):
            part = step_s / order
            for column in range(2 * n):
                force = 0.0
                for j in range(n):
                    force += direction[j] * (k * term[j, column] + c * term[n + j, column])
                for j in range(n):
                    following[j, column] = part * term[n + j, column]
                    following[n + j, column] = -part * (
                        own_stiffness[j] * term[j, column] + own_damping[j] * term[n + j, column] + shape[j] * force
                    )
            for row in range(2 * n):
                for column in range(2 * n):
                    whole[row, column] += following[row, column]
                    term[row, column] = following[row, column]
    return whole


@_compiled
def _rates_of_poles(state, rate, stiffness_now, error_now, poles, driven, felt, steady, mesh):  # type: ignore[no-untyped-def]
    """Write the time derivative of the vibrations and return δ and the mesh force.

    `mesh` is (c_m, b, 1 if c_m needs contact, k̄); the vibrations hold k̄ and c_m, the rest of the force drives them.
    """
    delta, speed = 0.0, 0.0
    for j in range(poles.size):
        part = felt[j] * state[j]
        delta += part.real
        speed += (part * poles[j]).real
    gap = delta - error_now
    touching, force = True, 0.0
    if gap > mesh[1]:
        force = stiffness_now * (gap - mesh[1])
    elif gap < -mesh[1]:
        force = stiffness_now * (gap + mesh[1])
    else:
        touching = False
    if touching or mesh[2] == 0.0:
        force += mesh[0] * speed
    beyond = force - mesh[3] * delta - mesh[0] * speed
    for j in range(poles.size):
        rate[j] = poles[j] * state[j] + driven[j] * beyond + steady[j]
    return delta, force


@_compiled
def march_of_poles(  # type: ignore[no-untyped-def]
    state, periods, stiffness_half_steps, error_half_steps, step_s, poles, driven, felt, steady, mesh, deltas, forces
):
    """Integrate whole mesh periods of the vibrations with the classical Runge-Kutta method of fourth order.

    Parameters
    ----------
    state : ndarray of complex, shape (n,)
        Start; overwritten with the end.
    periods, stiffness_half_steps, error_half_steps, step_s, deltas, forces
        As of `march`.
    poles, driven, felt : ndarray of complex, shape (n,)
        λ, b and c of `MeshPoles`.
    steady : ndarray of complex, shape (n,)
        t T1.
    mesh : ndarray, shape (4,)
        c_m, b, 1 where c_m needs contact, and k̄.
    """
    n, steps = poles.size, stiffness_half_steps.size // 2
    k1, k2, k3 = np.empty(n, np.complex128), np.empty(n, np.complex128), np.empty(n, np.complex128)
    k4, trial = np.empty(n, np.complex128), np.empty(n, np.complex128)
    for period in range(periods):
        for step in range(steps):
            here, between, following = 2 * step, 2 * step + 1, (2 * step + 2) % (2 * steps)
            k, e = stiffness_half_steps[here], error_half_steps[here]
            delta, force = _rates_of_poles(state, k1, k, e, poles, driven, felt, steady, mesh)
            deltas[period, step] = delta
            forces[period, step] = force
            for j in range(n):
                trial[j] = state[j] + 0.5 * step_s * k1[j]
            k, e = stiffness_half_steps[between], error_half_steps[between]
            _rates_of_poles(trial, k2, k, e, poles, driven, felt, steady, mesh)
            for j in range(n):
                trial[j] = state[j] + 0.5 * step_s * k2[j]
            _rates_of_poles(trial, k3, k, e, poles, driven, felt, steady, mesh)
            for j in range(n):
                trial[j] = state[j] + step_s * k3[j]
            k, e = stiffness_half_steps[following], error_half_steps[following]
            _rates_of_poles(trial, k4, k, e, poles, driven, felt, steady, mesh)
            for j in range(n):
                state[j] += step_s / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
