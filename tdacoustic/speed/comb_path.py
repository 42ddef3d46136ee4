"""The way of a speed through a likelihood over time and speed: the likeliest path, and how sure it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["NEVER", "CombPath", "find_path", "likeliest", "moves", "path_evidence"]

Array = NDArray[np.float64]
Grid = NDArray[np.float32]

UNHEARD: Final = 0.1
"""Probability that nothing of a comb is heard in a frame [assumed]."""
TYPICAL_PART: Final = 0.5
"""Standard deviation of the acceleration over its limit [assumed]."""
TEMPER: Final = 0.5
"""Power to which likelihoods are taken [tests/evidence: confidences are as often right as they say]; neighbouring
frames and orders are not as independent as the likelihood has it."""
NEVER: Final = -1e4
"""Logarithm of a probability that counts as none."""
TINY: Final = 1e-300
NEAR: Final = 0.02
"""A speed this near to the path, relative, counts as the path's [assumed]."""


@dataclass(frozen=True)
class CombPath:
    """The likeliest speed over time.

    Parameters
    ----------
    speeds_hz : ndarray, shape (n_frames,)
    confidence : ndarray, shape (n_frames,)
        Probability, given that there is a comb, that the speed lies within 2 % (or a grid step and a half) of the path.
    log_evidence : float
        ln of the likelihood of a comb, all its paths taken together, over that of floor alone.
    """

    speeds_hz: Array
    confidence: Array
    log_evidence: float


def find_path(scores: Grid, prior: Array, speeds_hz: Array, hop_s: float, acceleration_hz_s: float) -> CombPath:
    """Return the likeliest path through scores, by dynamic programming, with its confidence by the sum over all paths.

    From frame to frame the speed moves by at most `acceleration_hz_s` times the time between, less more likely than
    more.

    Parameters
    ----------
    scores : ndarray, shape (n_frames, n_speeds)
        Logarithmic likelihood ratios.
    prior : ndarray, shape (n_frames, n_speeds)
        Logarithmic weight of each speed, 0 where nothing is known, -inf where it is ruled out.
    speeds_hz : ndarray, shape (n_speeds,)
    hop_s : float
    acceleration_hz_s : float
    """
    step = float(speeds_hz[1] - speeds_hz[0])
    heard = _heard(scores, prior)
    kernel = moves(acceleration_hz_s * hop_s, step, speeds_hz.size)
    _, best = likeliest(heard, kernel)
    speeds = speeds_hz[best]
    forward, evidence = _summed(heard, kernel)
    backward, _ = _summed(heard[::-1], kernel)
    marginal = forward + backward[::-1] - heard
    marginal -= marginal.max(axis=1, keepdims=True)
    chance = np.exp(marginal)
    chance /= chance.sum(axis=1, keepdims=True)
    reach = np.maximum(NEAR * speeds, 1.5 * step)[:, None]
    near = np.abs(speeds_hz[None, :] - speeds[:, None]) <= reach
    confidence = np.sum(chance * near, axis=1)
    return CombPath(speeds, np.asarray(confidence), evidence)


def path_evidence(scores: Grid, prior: Array, speeds_hz: Array, hop_s: float, acceleration_hz_s: float) -> float:
    """Return `CombPath.log_evidence` alone; the arguments are those of `find_path`."""
    kernel = moves(acceleration_hz_s * hop_s, float(speeds_hz[1] - speeds_hz[0]), speeds_hz.size)
    return _summed(_heard(scores, prior), kernel)[1]


def _heard(scores: Grid, prior: Array) -> Array:
    """Logarithmic likelihood ratio of each speed where the comb may also be silent, and the weight of the speed."""
    silent = np.logaddexp(math.log1p(-UNHEARD) + TEMPER * scores, math.log(UNHEARD))
    return np.asarray(silent + np.maximum(prior, NEVER))


def moves(reach_hz: float, step: float, count: int) -> Array:
    """Return the logarithmic probability of each move from frame to frame, in steps of a grid; the middle one is none.

    Parameters
    ----------
    reach_hz : float
        The longest move.
    step : float
        Of the grid.
    count : int
        Speeds of the grid.
    """
    half = min(max(1, math.ceil(reach_hz / step)), (count - 1) // 2)
    moves = np.arange(-half, half + 1) * step
    spread = math.hypot(TYPICAL_PART * reach_hz, 0.5 * step)
    weight = -0.5 * (moves / spread) ** 2
    return np.asarray(weight - np.log(np.exp(weight).sum()))


def _shifted(values: Array, by: int) -> Array:
    moved = np.full(values.size, -np.inf)
    if by >= 0:
        moved[by:] = values[: values.size - by]
    else:
        moved[:by] = values[-by:]
    return moved


def likeliest(heard: Array, kernel: Array) -> tuple[float, NDArray[np.intp]]:
    """Return the logarithmic likelihood of the likeliest path (A. J. Viterbi, 1967), and its place in each frame.

    Parameters
    ----------
    heard : ndarray, shape (n_frames, n_speeds)
    kernel : ndarray
        Of `moves`.
    """
    half, frames = kernel.size // 2, heard.shape[0]
    came = np.zeros(heard.shape, dtype=np.int16)
    value = heard[0].astype(np.float64)
    for frame in range(1, frames):
        best = np.full(value.size, -np.inf)
        for index, weight in enumerate(kernel):
            moved = _shifted(value, index - half) + weight
            better = moved > best
            best[better] = moved[better]
            came[frame][better] = index - half
        value = best + heard[frame]
    path = np.zeros(frames, dtype=np.intp)
    path[-1] = int(np.argmax(value))
    for frame in range(frames - 1, 0, -1):
        path[frame - 1] = path[frame] - came[frame, path[frame]]
    return float(value.max()), path


def _summed(heard: Array, kernel: Array) -> tuple[Array, float]:
    """Logarithm of the summed likelihood of all paths up to each frame and speed, and of all paths together."""
    weights = np.exp(kernel)
    result = np.empty(heard.shape)
    value = heard[0].astype(np.float64)
    for frame in range(heard.shape[0]):
        if frame:
            top = float(value.max())
            value = np.log(np.convolve(np.exp(value - top), weights, mode="same") + TINY) + top + heard[frame]
        result[frame] = value
    top = float(value.max())
    return result, top + math.log(float(np.exp(value - top).sum())) - math.log(heard.shape[1])
