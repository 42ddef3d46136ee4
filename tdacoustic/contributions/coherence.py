"""Ordinary, multiple and partial coherence, corrected for their bias, with intervals.

*Order.* What a reference explains *after* others have had their turn depends on the order. Nothing here takes an order
by default: a partial coherence is conditioned on **all** other references (or on those that are named), in which the
order among the conditioning ones plays no part; a multiple coherence has none. `sequential_parts` takes one, and the
caller has to give it: only where a cause is known to come before another (the motor drives the gearbox) is one order
right. Where it is not, `order_range` says between what a group's part lies over all orders.

Sources: J. S. Bendat and A. G. Piersol, Random Data, 4th ed., chapters 6, 7 and 9; D. O. Smallwood, "Using singular
value decomposition to compute the conditioned cross-spectral density matrix and coherence functions" (1995), on the
order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions.coherence_statistics import coherence_interval, corrected_coherence
from tdacoustic.contributions.matrices import RANK, CrossMatrices, explained_power, inverse_root
from tdacoustic.errors import AnalysisError

__all__ = [
    "Coherence",
    "multiple_coherence",
    "order_range",
    "ordinary_coherence",
    "partial_coherence",
    "reference_coherence",
    "sequential_parts",
]

Array = NDArray[np.float64]

MOST_GROUPS = 8
"""Groups of which all orders are tried: 2^8 sets."""


@dataclass(frozen=True)
class Coherence:
    """A squared coherence over frequency.

    Parameters
    ----------
    frequencies_hz : ndarray, shape (n_lines,)
    value : ndarray, shape (..., n_lines)
        As estimated; biased upwards.
    corrected : ndarray, same shape
        The true coherence of which `value` is the mean; 0 where there is no more than none at all would show.
    low, high : ndarray, same shape
        Interval of the true coherence.
    determined : ndarray of bool, same shape
        False where one of both has no power, or none is left after conditioning: there the interval is 0 to 1.
    averages : float
        Independent averages, less those that conditioning has used up.
    inputs : int
    probability : float
        Of the interval.
    """

    frequencies_hz: Array
    value: Array
    corrected: Array
    low: Array
    high: Array
    determined: NDArray[np.bool_]
    averages: float
    inputs: int
    probability: float


def _estimate(
    matrices: CrossMatrices,
    value: Array,
    determined: NDArray[np.bool_],
    inputs: int,
    conditioned: int,
    probability: float,
) -> Coherence:
    averages = matrices.averages - conditioned
    value = np.where(determined, np.clip(value, 0.0, 1.0), 0.0)
    low, high = coherence_interval(value, averages, inputs, probability)
    return Coherence(
        matrices.frequencies_hz,
        value,
        corrected_coherence(value, averages, inputs),
        np.where(determined, low, 0.0),
        np.where(determined, high, 1.0),
        determined,
        averages,
        inputs,
        probability,
    )


def ordinary_coherence(matrices: CrossMatrices, probability: float = 0.95) -> Coherence:
    """Return the coherence of each reference with each receiver, shape (n_references, n_receivers, n_lines)."""
    matrices.enough_averages(1, "the coherence")
    own = np.diagonal(matrices.s_xx, axis1=1, axis2=2).real
    value, determined = _normalised(matrices.s_xy, own, matrices.s_yy)
    return _estimate(matrices, value, determined, 1, 0, probability)


def reference_coherence(matrices: CrossMatrices, probability: float = 0.95) -> Coherence:
    """Return the coherence of each reference with each other, shape (n_references, n_references, n_lines)."""
    matrices.enough_averages(1, "the coherence")
    own = np.diagonal(matrices.s_xx, axis1=1, axis2=2).real
    value, determined = _normalised(matrices.s_xx, own, own)
    return _estimate(matrices, value, determined, 1, 0, probability)


def _normalised(cross: NDArray[np.complex128], left: Array, right: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Squared coherence and where it is determined, both with the line last."""
    scaled = cross * inverse_root(left)[:, :, None] * inverse_root(right)[:, None, :]
    determined = (left > 0.0)[:, :, None] & (right > 0.0)[:, None, :]
    return np.moveaxis(np.abs(scaled) ** 2, 0, -1), np.moveaxis(determined, 0, -1)


def multiple_coherence(
    matrices: CrossMatrices, references: Sequence[str] | None = None, probability: float = 0.95
) -> Coherence:
    """Return what the references together explain of each receiver, shape (n_receivers, n_lines).

    For independent noise at the receiver it is one minus the noise's share of the power.

    Parameters
    ----------
    matrices : CrossMatrices
    references : sequence of str, optional
        Those used. Default: all.
    probability : float

    Raises
    ------
    AnalysisError
        Not more averages than references, or no such reference.
    """
    chosen = [matrices.index(name) for name in (matrices.references if references is None else references)]
    if not chosen:
        raise AnalysisError("a multiple coherence takes a reference")
    matrices.enough_averages(len(chosen), "the multiple coherence")
    power, rank = explained_power(matrices.s_xx, matrices.s_xy, chosen)
    total = matrices.s_yy
    value = power * inverse_root(total) ** 2
    determined = (total > 0.0) & (rank > 0.0)[:, None]
    return _estimate(matrices, value.T, determined.T, len(chosen), 0, probability)


def partial_coherence(
    matrices: CrossMatrices,
    references: Sequence[str] | None = None,
    given: Sequence[str] | None = None,
    probability: float = 0.95,
) -> Coherence:
    """Return the coherence of references with receivers after what others explain of both has been taken off.

    Shape (n_references asked for, n_receivers, n_lines). A reference that others explain to rounding (an identical
    channel) leaves nothing to be coherent with: not determined.

    Parameters
    ----------
    matrices : CrossMatrices
    references : sequence of str, optional
        Asked for. Default: all.
    given : sequence of str, optional
        Conditioned on; their order plays no part. Default: all references but the one asked for.
    probability : float

    Raises
    ------
    AnalysisError
        Too few averages, no such reference, or one given and asked for.
    """
    asked = [matrices.index(name) for name in (matrices.references if references is None else references)]
    if given is not None and set(given) & {matrices.references[index] for index in asked}:
        raise AnalysisError("a reference cannot be asked for and conditioned on at once")
    values, known, count = [], [], 0
    for index in asked:
        others = (
            [place for place in range(len(matrices.references)) if place != index]
            if given is None
            else [matrices.index(name) for name in given]
        )
        count = len(others)
        matrices.enough_averages(count + 1, "the partial coherence")
        value, determined = _partial(matrices, index, others)
        values.append(value)
        known.append(determined)
    return _estimate(matrices, np.array(values), np.array(known), 1, count, probability)


def _partial(matrices: CrossMatrices, index: int, others: Sequence[int]) -> tuple[Array, NDArray[np.bool_]]:
    """Of one reference, with the line last: the part of what is left that it explains on top of the others."""
    before, rank_before = explained_power(matrices.s_xx, matrices.s_xy, others)
    after, rank_after = explained_power(matrices.s_xx, matrices.s_xy, [*others, index])
    left = matrices.s_yy - before
    determined = (rank_after > rank_before)[:, None] & (left > RANK * matrices.s_yy)
    value = np.divide(after - before, left, out=np.zeros_like(left), where=determined)
    return value.T, determined.T


def sequential_parts(matrices: CrossMatrices, groups: Mapping[str, Sequence[str]], order: Sequence[str]) -> Array:
    """Return what each group explains after those before it, shape (n_groups, n_receivers, n_lines), per Hz.

    The first takes all that it shares with later ones: right where its cause comes first, else not.

    Parameters
    ----------
    matrices : CrossMatrices
    groups : mapping of str to sequence of str
        References of each.
    order : sequence of str
        All groups, first cause first.

    Raises
    ------
    AnalysisError
        The order does not hold each group once, or there are too few averages.
    """
    if sorted(order) != sorted(groups):
        raise AnalysisError(f"the order {list(order)} must hold each of {list(groups)} once")
    matrices.enough_averages(sum(len(names) for names in groups.values()), "the conditioned power")
    taken: list[int] = []
    before = np.zeros_like(matrices.s_yy)
    parts = []
    for name in order:
        taken += [matrices.index(reference) for reference in groups[name]]
        after, _ = explained_power(matrices.s_xx, matrices.s_xy, taken)
        parts.append((after - before).T)
        before = after
    return np.array(parts)


def order_range(matrices: CrossMatrices, groups: Mapping[str, Sequence[str]]) -> tuple[Array, Array]:
    """Return the smallest and largest part of each group over all orders, each (n_groups, n_receivers, n_lines).

    Raises
    ------
    AnalysisError
        More than 8 groups, or too few averages.
    """
    if len(groups) > MOST_GROUPS:
        raise AnalysisError(f"all orders are tried for {MOST_GROUPS} groups at most, got {len(groups)}")
    matrices.enough_averages(sum(len(names) for names in groups.values()), "the conditioned power")
    members = [[matrices.index(name) for name in names] for names in groups.values()]
    number = range(len(members))
    power = {
        chosen: explained_power(matrices.s_xx, matrices.s_xy, [i for group in chosen for i in members[group]])[0]
        for size in range(len(members) + 1)
        for chosen in combinations(number, size)
    }
    low, high = [], []
    for group in number:
        gains = [power[tuple(sorted((*chosen, group)))] - held for chosen, held in power.items() if group not in chosen]
        low.append(np.min(gains, axis=0).T)
        high.append(np.max(gains, axis=0).T)
    return np.array(low), np.array(high)
