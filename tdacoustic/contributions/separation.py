"""Contributions of independent sources out of contributions of references, where operating states differ enough.

In state r the cross spectra of the groups' contributions are ``K_r = B P_r B^H``: P_r diagonal, the powers that the
independent sources send to the receiver in that state; B, how they are seen across the groups, the same in all states,
its columns summing to one. One state leaves B open. Two whose mix of sources differs fix it, more over-determine it:
``W = B^-1`` makes all ``W K_r W^H`` diagonal at once (joint diagonalisation; D.-T. Pham, J.-F. Cardoso, IEEE Trans.
Signal Process. 49 (2001) 1837). It is found by first-order steps (I + V) W (A. Ziehe et al., J. Mach. Learn. Res. 5
(2004) 777): for each pair, V_ij and conj(V_ji) from ``E_ij + V_ij D_j + conj(V_ji) D_i = 0`` over the states, by least
squares with the scatter ``D_i D_j / n_r`` of E_ij.

The inverse of the same normal matrix is how well B is known, and so the power: ``var ln P_j = 2 sum_k var V_kj``.
States that are alike leave it large, or differ by no more than their scatter: then nothing is claimed. A prior of
variance 100 on each V (cross-talk 20 dB above the contribution itself) [assumed] keeps it finite. Off-diagonal parts
beyond their scatter (more sources than groups, coherent sources, paths that changed) widen it.

Which source is which group's rests on one assumption: of all groups' references, its own are those of whose power it
makes up the largest part. Where that gives a group two sources, or two groups like parts (`MARGIN`), nothing is
claimed. Cross-talk stronger than a sensor's own source breaks it, and nothing in the signals says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions.matrices import inverse_root

__all__ = ["Separated", "seen_shares", "separate"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ITERATIONS: Final = 30
LARGEST_STEP: Final = 0.5
PRIOR: Final = 0.01
FLOOR: Final = 1e-4
"""A source's power in a state is not taken below this part of its largest."""
MARGIN: Final = 1.5
"""Share of a source in its own references over that in any others', at least: 1.8 dB [assumed]."""
WORST_CONDITION: Final = 1e6
DIVERSITY: Final = 20.0
"""Spread of the sources' ratio over the states (variance of its logarithm), over what scatter alone would show: below,
part of the cross-talk is left in, a twentieth at this value, on all lines alike."""
SILENT: Final = 1e-4
"""Part of all groups' power below which a group contributes nothing."""
SMALLEST: Final = 1e-4
"""Smallest eigenvalue of the contributions' coherency over all states; below, they are one signal."""


@dataclass(frozen=True)
class Separated:
    """Sources' contributions.

    Parameters
    ----------
    power : ndarray, shape (n_lines, n_states, n_groups)
        The references' own contributions where it cannot be told.
    variance : ndarray, shape (n_lines, n_groups)
        Of the logarithm of the power, from what is not known of B; infinite where it cannot be told.
    unmix : ndarray of complex, shape (n_lines, n_groups, n_groups)
        W: a source's sound is the sum of W times the groups' contributions; the identity where it cannot be told.
    """

    power: Array
    variance: Array
    unmix: Complex


def separate(
    shared: Complex, averages: Array, seen: Complex | None = None, members: Sequence[int] | None = None
) -> Separated:
    """Separate the sources of each line.

    Parameters
    ----------
    shared : ndarray of complex, shape (n_lines, n_states, n_groups, n_groups)
        K_r of each line.
    averages : ndarray, shape (n_states,)
    seen : ndarray of complex, shape (n_lines, n_references, n_groups), optional
        Cross spectra of references, scaled to unit power, and groups' contributions, over all states. Default: the
        contributions are the references.
    members : sequence of int, optional
        Number of references of each group, in their order.
    """
    n_lines, _, n, _ = shared.shape
    own = np.maximum(np.diagonal(shared, axis1=2, axis2=3).real, 0.0)
    if n == 1:
        return Separated(own, np.zeros((n_lines, 1)), np.ones((n_lines, 1, 1), dtype=np.complex128))
    shared = _without_silent(shared, averages)
    pooled = np.einsum("r,frij->fij", averages / averages.sum(), shared)
    if seen is None or members is None:
        seen, members = pooled * inverse_root(np.diagonal(pooled, axis1=1, axis2=2).real)[:, :, None], [1] * n
    whiten, sound = _whitening(pooled)
    scaled = np.where(sound[:, None, None, None], _unmixed(whiten, shared), np.eye(n))
    turn = np.broadcast_to(np.eye(n, dtype=np.complex128), (n_lines, n, n)).copy()
    for _ in range(ITERATIONS):
        step, _ = _step(_unmixed(turn, scaled), averages)
        size = np.sqrt((np.abs(step) ** 2).sum(axis=(1, 2)))
        step *= np.minimum(1.0, LARGEST_STEP / np.maximum(size, 1e-300))[:, None, None]
        turn = turn + step @ turn
        turn /= np.sqrt((np.abs(turn) ** 2).sum(axis=2, keepdims=True))  # only a row's direction counts
        if size.max(initial=0.0) < 1e-6:
            break
    sound &= np.linalg.cond(turn) < WORST_CONDITION
    turn[~sound] = np.eye(n)
    unmix = turn @ whiten
    mix = np.linalg.inv(unmix)
    sums = mix.sum(axis=1)
    sound &= (np.abs(sums) > 1e-3 * np.abs(mix).max(axis=1)).all(axis=1)
    sums[~sound] = 1.0
    unmix = unmix * sums[:, :, None]  # each source in its sound at the receiver
    share = seen_shares(unmix, seen, members)
    owner = share.argmax(axis=1)
    ranked = np.sort(share, axis=1)
    sound &= (np.sort(owner, axis=1) == np.arange(n)).all(axis=1) & (ranked[:, -1] > MARGIN * ranked[:, -2]).all(axis=1)
    place = np.where(sound[:, None], np.argsort(owner, axis=1), np.arange(n))
    unmix = np.take_along_axis(unmix, place[:, :, None], axis=1)
    matrices = _unmixed(unmix, shared)
    _, variance = _step(np.where(sound[:, None, None, None], matrices, np.eye(n)), averages)
    spread = 2.0 * variance.sum(axis=1)
    spread[~sound] = np.inf
    power = np.maximum(np.diagonal(matrices, axis1=2, axis2=3).real, 0.0)
    told = sound[:, None, None]
    return Separated(np.where(told, power, own), spread, np.where(told, unmix, np.eye(n)))


def seen_shares(unmix: Complex, seen: Complex, members: Sequence[int]) -> Array:
    """Return each source's share of the references of each group up to a factor a source, (n_lines, group, source).

    Parameters
    ----------
    unmix : ndarray of complex, shape (n_lines, n_groups, n_groups)
    seen : ndarray of complex, shape (n_lines, n_references, n_groups)
        As in `separate`.
    members : sequence of int
    """
    power = np.abs(seen @ unmix.conj().swapaxes(1, 2)) ** 2
    starts = np.cumsum([0, *members[:-1]])
    return np.asarray(np.add.reduceat(power, starts, axis=1) / np.array(members)[None, :, None])


def _without_silent(shared: Complex, averages: Array) -> Complex:
    """Groups with next to no contribution of their own take no part: nothing of the others is in them."""
    mean = np.einsum("r,frii->fi", averages / averages.sum(), shared).real
    least = SILENT * np.maximum(mean, 0.0).sum(axis=1)
    silent = mean <= least[:, None]
    heard = ~(silent[:, :, None] | silent[:, None, :])
    held = np.where(heard[:, None], shared, 0.0)
    place = np.arange(shared.shape[2])
    held[:, :, place, place] += np.where(silent, least[:, None], 0.0)[:, None]
    return np.asarray(held)


def _whitening(pooled: Complex) -> tuple[Complex, NDArray[np.bool_]]:
    """Hermitian root of the inverse, and where there is one; the identity where not."""
    own = np.maximum(np.diagonal(pooled, axis1=1, axis2=2).real, 0.0)
    scale = inverse_root(own)
    values, vectors = np.linalg.eigh(pooled * scale[:, :, None] * scale[:, None, :])
    sound = (own > 0.0).all(axis=1) & (values[:, 0] > SMALLEST)
    root = np.where(sound[:, None], 1.0 / np.sqrt(np.where(sound[:, None], values, 1.0)), 1.0)
    found = (vectors * root[:, None, :]) @ vectors.conj().swapaxes(1, 2) * scale[:, None, :]
    return np.where(sound[:, None, None], found, np.eye(own.shape[1])), sound


def _unmixed(unmix: Complex, shared: Complex) -> Complex:
    return unmix[:, None] @ shared @ unmix.conj().swapaxes(1, 2)[:, None]


def _step(matrices: Complex, averages: Array) -> tuple[Complex, Array]:
    """V and the variance of each of its entries, both (n_lines, n_groups, n_groups)."""
    n_lines, n_states, n, _ = matrices.shape
    power = np.diagonal(matrices, axis1=2, axis2=3).real
    # A source that is off in a state still has scatter there.
    power = np.maximum(power, np.maximum(FLOOR * power.max(axis=1, keepdims=True), 1e-300))
    step, variance = np.zeros((n_lines, n, n), dtype=np.complex128), np.zeros((n_lines, n, n))
    for i in range(n):
        for j in range(i + 1, n):
            ratio = power[:, :, j] / power[:, :, i]
            off = matrices[:, :, i, j]
            scale = np.sqrt(power[:, :, i] * power[:, :, j])
            # rows [D_j, D_i] / sqrt(D_i D_j), right side -E / sqrt(D_i D_j), each with the weight n_r
            a11, a22 = ratio @ averages + PRIOR, (1.0 / ratio) @ averages + PRIOR
            a12 = averages.sum()
            r1 = -(off / scale * np.sqrt(ratio)) @ averages
            r2 = -(off / scale / np.sqrt(ratio)) @ averages
            determinant = a11 * a22 - a12**2
            first, second = (a22 * r1 - a12 * r2) / determinant, (a11 * r2 - a12 * r1) / determinant
            step[:, i, j], step[:, j, i] = first, second.conj()
            rest = off / scale + first[:, None] * np.sqrt(ratio) + second[:, None] / np.sqrt(ratio)
            misfit = (np.abs(rest) ** 2) @ averages / max(1.0, n_states - 2.0)
            wider = np.maximum(1.0, misfit) if n_states > 2 else 1.0
            variance[:, i, j], variance[:, j, i] = wider * a22 / determinant, wider * a11 / determinant
            diverse = (ratio @ averages) * ((1.0 / ratio) @ averages) / averages.sum() ** 2 - 1.0
            alike = diverse < DIVERSITY * 2.0 * (n_states - 1) / averages.sum()
            variance[alike, i, j] = variance[alike, j, i] = np.inf
    return step, variance
