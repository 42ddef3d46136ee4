"""Sweeps of speed, up and down, each from where the last speed ended: they show where two motions are stable."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.gears.steady_state import SteadyState, steady_state
from tdacoustic.gears.system import GearSystem

__all__ = ["Branch", "branch_of_sweep", "coexisting"]

SWEEP_PERIODS: Final = 256
"""Mesh periods of a time integration inside of a sweep, before a motion counts as not repeating."""

DIFFERENT: Final = 0.02
"""Relative difference of two peak-to-peak values from which two motions are taken for different ones."""


@dataclass(frozen=True)
class Branch:
    """What a gear pair does while its speed goes up or down slowly.

    Parameters
    ----------
    mesh_hz : ndarray, shape (n,)
        In the order in which they were passed.
    torque_n_m, dte_pp_m, floquet_max, contact_part : ndarray, shape (n,)
        As of `SteadyState`.
    repeats_after : tuple of int
        Mesh periods; 0 of a motion that does not repeat.
    method : tuple of str
    """

    mesh_hz: NDArray[np.float64]
    torque_n_m: NDArray[np.float64]
    dte_pp_m: NDArray[np.float64]
    floquet_max: NDArray[np.float64]
    contact_part: NDArray[np.float64]
    repeats_after: tuple[int, ...]
    method: tuple[str, ...]


def branch_of_sweep(
    system: GearSystem,
    mesh_hz: Sequence[float],
    torque_n_m: Sequence[float],
    on_speed: Callable[[int], None] | None = None,
) -> Branch:
    """Return the steady states of speeds that follow each other, each started from the one before.

    Parameters
    ----------
    system : GearSystem
    mesh_hz : sequence of float
        Ascending for a sweep up, descending for one down, in steps small enough that a motion can be followed.
    torque_n_m : sequence of float
        At each of them.
    on_speed : callable, optional
        Called with how many are done.
    """
    states = []
    for state in _following(system, mesh_hz, torque_n_m):
        states.append(state)
        if on_speed is not None:
            on_speed(len(states))
    return Branch(
        np.array(mesh_hz, dtype=np.float64),
        np.array(torque_n_m, dtype=np.float64),
        np.array([state.dte_pp_m for state in states]),
        np.array([state.floquet_max for state in states]),
        np.array([state.contact_part for state in states]),
        tuple(state.repeats_after or 0 for state in states),
        tuple(state.method for state in states),
    )


def _following(system: GearSystem, mesh_hz: Sequence[float], torque_n_m: Sequence[float]) -> Iterator[SteadyState]:
    last: SteadyState | None = None
    for speed, torque in zip(mesh_hz, torque_n_m, strict=True):
        last = steady_state(system, speed, torque, last, SWEEP_PERIODS)
        yield last


def coexisting(up: Branch, down: Branch) -> NDArray[np.bool_]:
    """Return where two sweeps over the same speeds end in different motions, in the order of the first, shape (n,).

    Motions that do not repeat are compared with nothing: their peak to peak depends on the length of the record.
    """
    other = {float(speed): index for index, speed in enumerate(down.mesh_hz)}
    found = np.zeros(up.mesh_hz.size, dtype=bool)
    for index, speed in enumerate(up.mesh_hz):
        twin = other[float(speed)]
        if up.repeats_after[index] and down.repeats_after[twin]:
            first, second = up.dte_pp_m[index], down.dte_pp_m[twin]
            found[index] = abs(first - second) > DIFFERENT * max(first, second)
    return found
