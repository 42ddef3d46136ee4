"""Transmissibilities from references to receivers over operating states, with small principal components cut off.

``y = T x``: operational transfer-path analysis (D. de Klerk, A. Ossipov, Mech. Syst. Signal Process. 24 (2010) 1950).
Cross-talk between references is allowed for by solving for all paths at once, ``T = S_yx S_xx^-1``; where references
are coherent, S_xx is nearly singular and its small principal components carry noise. They are cut by a stated rule:

- ``"none"``: only what is rounding (1e-6 of the largest component).
- ``"significance"``: a component is kept for a receiver where its coherence with the receiver (the virtual coherence
  of S. M. Price and R. J. Bernhard, IMAC 1986) exceeds what independent signals reach with 5 % probability.
- ``"noise_floor"``: references are scaled to their own noise (a background run, or the sensor's data sheet), which is
  taken off S_xx; a component is kept where it exceeded ``(1 + sqrt(q/n))²`` before, the largest eigenvalue that noise
  alone has with q references and n averages (V. A. Marchenko, L. A. Pastur, 1967).
- ``"ridge"``: no cut; Tikhonov's term is ``q s / (n |b|²)`` with the residual's density s and the transmissibilities b
  of the references scaled to unit power (A. E. Hoerl, R. W. Kennard, K. F. Baldwin, 1975).

References are otherwise scaled to unit power, so that a unit or a sensitivity does not decide.

*States.* S_xx is summed over operating states (speeds, torques, modes): a cross-talk path stays what it is while the
sources' mix changes, which makes references less coherent than in any one state. By default each state counts by its
averages alone (``"equal"``), its references' mean power normalised line by line; with ``"power"`` the loud ones decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions.coherence_statistics import significant_coherence
from tdacoustic.contributions.matrices import RANK, inverse_root
from tdacoustic.errors import AnalysisError

__all__ = ["Rule", "Transmissibility", "Weighting", "state_weights", "transmissibility"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

Rule = Literal["none", "significance", "noise_floor", "ridge"]
Weighting = Literal["equal", "power"]
LEVEL: Final = 0.05
"""Probability with which independent signals pass as coherent."""


@dataclass(frozen=True)
class Transmissibility:
    """Paths from references to receivers.

    Parameters
    ----------
    paths : ndarray of complex, shape (..., n_references, n_receivers)
        ``conj(T)`` transposed: the receiver is the sum of ``conj(paths) x``.
    freedom : ndarray, shape (..., n_receivers)
        Components kept, those of a ridge by their part.
    spread : ndarray of complex, shape (..., n_receivers, n_references, n_references)
        Covariance of the paths' estimation errors.
    residual : ndarray, shape (..., n_receivers)
        Density of what is not explained, corrected for the freedom used.
    """

    paths: Complex
    freedom: Array
    spread: Complex
    residual: Array


def state_weights(reference_power: Array, averages: Array, weighting: Weighting) -> Array:
    """Return how much each state's matrices count, shape (n_states, n_lines), summing to one for states alike.

    Parameters
    ----------
    reference_power : ndarray, shape (n_states, n_lines, n_references)
    averages : ndarray, shape (n_states,)
    weighting : str
    """
    share = (averages / averages.sum())[:, None]
    if weighting == "power" or len(averages) == 1:
        return np.broadcast_to(share, reference_power.shape[:2])
    mean = np.einsum("s,sfi->fi", averages / averages.sum(), reference_power)
    relative = (reference_power * inverse_root(mean) ** 2).mean(axis=-1)
    return share * inverse_root(relative) ** 2


def transmissibility(
    s_xx: Complex, s_xy: Complex, s_yy: Array, averages: float, rule: Rule, noise_density: Array | None = None
) -> Transmissibility:
    """Estimate the paths by a rule.

    Parameters
    ----------
    s_xx, s_xy, s_yy : ndarray, shapes (..., n, n), (..., n, p), (..., p)
        As in `CrossMatrices`, summed over states; for ``"noise_floor"`` without the references' noise.
    averages : float
    rule : str
        See the module.
    noise_density : ndarray, shape (..., n), optional
        Of the references; ``"noise_floor"`` takes it.

    Raises
    ------
    AnalysisError
        An unknown rule, one without the noise that it takes, or not more averages than references.
    """
    if rule not in get_args(Rule):
        raise AnalysisError(f"rule must be one of {', '.join(get_args(Rule))}, got {rule!r}")
    q = s_xx.shape[-1]
    if not averages > q:
        raise AnalysisError(
            f"paths from {q} references take more than {q} independent averages, got {averages:.3g}: with fewer "
            "everything is explained in full; take longer runs, more of them, a coarser resolution or fewer references"
        )
    own = np.diagonal(s_xx, axis1=-2, axis2=-1).real
    if rule == "noise_floor":
        if noise_density is None:
            raise AnalysisError("rule 'noise_floor' takes the references' noise density (a background run), got none")
        scale = np.where(own > 0.0, inverse_root(np.broadcast_to(noise_density, own.shape)), 0.0)
    else:
        scale = inverse_root(own)
    values, vectors = np.linalg.eigh(s_xx * scale[..., :, None] * scale[..., None, :])
    live = values > RANK * np.maximum(values[..., -1:], np.finfo(float).tiny)
    inverse = np.where(live, 1.0 / np.where(live, values, 1.0), 0.0)[..., None]
    parts = vectors.conj().swapaxes(-1, -2) @ (s_xy * scale[..., :, None])
    explained = np.abs(parts) ** 2 * inverse
    kept = _kept(rule, values, live, explained, parts * inverse, s_yy, averages)
    scaled = vectors * scale[..., :, None]
    freedom = kept.sum(axis=-2)
    filtered = (explained * kept * (2.0 - kept)).sum(axis=-2)  # of the receiver less its prediction, exact for a ridge
    residual = np.maximum(s_yy - filtered, 0.0) / (1.0 - np.minimum(freedom, q) / averages)
    weight = np.moveaxis(kept**2 * inverse, -1, -2) * (residual / averages)[..., None]
    spread = np.einsum("...ik,...pk,...jk->...pij", scaled, weight, scaled.conj(), optimize=True)
    return Transmissibility(scaled @ (kept * parts * inverse), freedom, spread, residual)


def _kept(
    rule: Rule, values: Array, live: NDArray[np.bool_], explained: Array, coefficients: Complex, s_yy: Array, n: float
) -> Array:
    """Part of each component that is kept for each receiver, shape (..., n_references, n_receivers)."""
    q = values.shape[-1]
    if rule == "significance":
        return (explained > significant_coherence(n, 1, LEVEL) * s_yy[..., None, :]).astype(np.float64)
    if rule == "noise_floor":
        live = live & (values + 1.0 > (1.0 + np.sqrt(q / n)) ** 2)
    if rule == "ridge":
        left = np.maximum(s_yy - explained.sum(axis=-2), 0.0) / (1.0 - q / n)
        square = (np.abs(coefficients) ** 2).sum(axis=-2)
        term = q * left / n / np.where(square > 0.0, square, np.inf)
        lam = np.where(live, values, 0.0)[..., None]
        return np.where(live[..., None], lam / np.where(live[..., None], lam + term[..., None, :], 1.0), 0.0)
    return np.broadcast_to(live[..., None].astype(np.float64), explained.shape)
