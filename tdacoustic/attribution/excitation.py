"""Whose order is a line: the match of its frequency with the excitations that the kinematics expects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["Expected", "Match", "observed_scale", "owner_of", "refined"]

SIGMAS = 3.0
"""Distance of a line from an expected frequency, in standard deviations of both, that still matches."""
SCALE_STEP = 1e-4
CHANCE_MATCH = 0.05
"""A refined scale must match more than would fall on the same harmonics by chance with this probability."""


@dataclass(frozen=True)
class Expected:
    """A frequency at which the drive is excited.

    Parameters
    ----------
    name : str
        In words: ``"mesh x2"``, ``"carrier x2"``.
    kind : str
        ``mesh``, ``motor``, ``inverter`` or ``wheelset``.
    frequency_hz : float
    error_hz : float
        One standard deviation: speed, carrier, wander.
    base : str
        What it is a multiple of (``"mesh 1"``, ``"carrier"``, ``"motor shaft"``), so that all of one base
        move together.
    harmonic : float
    """

    name: str
    kind: str
    frequency_hz: float
    error_hz: float
    base: str
    harmonic: float


@dataclass(frozen=True)
class Match:
    """An expected frequency that a line fits, and how well.

    Parameters
    ----------
    expected : Expected
    distance_hz : float
        Line minus expected.
    sigmas : float
        The distance over its standard deviation.
    """

    expected: Expected
    distance_hz: float
    sigmas: float


def owner_of(frequency_hz: float, error_hz: float, expected: Sequence[Expected]) -> tuple[Match | None, Match | None]:
    """Return the best match of a line, and the nearest miss of another kind.

    Parameters
    ----------
    frequency_hz, error_hz : float
        Of the line; the error is one standard deviation.
    expected : sequence of Expected

    Returns
    -------
    match : Match or None
        None where no expected frequency lies within `SIGMAS`.
    rival : Match or None
        The nearest expected frequency of another kind within 3 %, matching or not.
    """
    matches = sorted(
        (
            Match(
                item, frequency_hz - item.frequency_hz, abs(frequency_hz - item.frequency_hz) / _sigma(item, error_hz)
            )
            for item in expected
        ),
        key=lambda match: (match.sigmas, abs(match.distance_hz)),
    )
    best = matches[0] if matches and matches[0].sigmas <= SIGMAS else None
    kind = best.expected.kind if best is not None else None
    others = [match for match in matches if match.expected.kind != kind]
    near = [match for match in others if abs(match.distance_hz) <= 0.06 * frequency_hz]
    return best, min(near, key=lambda match: abs(match.distance_hz), default=None)


def _sigma(item: Expected, error_hz: float) -> float:
    return max(math.hypot(item.error_hz, error_hz), 1e-9)


@dataclass(frozen=True)
class Scale:
    """Observed over expected frequency of a base.

    Parameters
    ----------
    value : float
    error : float
        One standard deviation, relative.
    """

    value: float
    error: float


def observed_scale(
    frequencies_hz: Sequence[float],
    errors_hz: Sequence[float],
    weights: Sequence[float],
    expected: Sequence[Expected],
    reach: float,
) -> Scale | None:
    """Find the factor by which a base's frequencies must be moved to fit the lines best.

    Parameters
    ----------
    frequencies_hz, errors_hz, weights : sequences of float
        Of the lines; the weight is how much a line counts.
    expected : sequence of Expected
        All of one base.
    reach : float
        Largest relative shift tried.

    Returns
    -------
    Scale or None
        None where too little matches: a single line that is not at the
        strongest expected frequency may lie anywhere by chance.
    """
    lines = np.asarray(frequencies_hz, dtype=np.float64)
    if lines.size == 0 or not expected:
        return None
    sigma = np.maximum(np.asarray(errors_hz, dtype=np.float64), 2e-4 * lines)
    weight = np.asarray(weights, dtype=np.float64)
    base = np.array([item.frequency_hz for item in expected])
    scales = np.arange(1.0 - reach, 1.0 + reach + 0.5 * SCALE_STEP, SCALE_STEP)
    distance = np.abs(lines[:, None, None] - base[None, :, None] * scales[None, None, :]).min(axis=1)
    width = sigma[:, None] + 5e-4 * lines[:, None]
    score = np.sum(weight[:, None] * np.exp(-0.5 * (distance / width) ** 2), axis=0) - 1e-3 * np.abs(scales - 1.0)
    best = int(np.argmax(score))
    hit = distance[:, best] <= SIGMAS * width[:, 0]
    covered = float(
        np.minimum(1.0, 2.0 * reach * base[base < lines.max() * 1.1].size * lines.mean() / max(lines.max(), 1.0))
    )
    if int(hit.sum()) < 2 and covered > CHANCE_MATCH and not _is_fundamental(lines[hit], base, reach):
        return None
    if not hit.any():
        return None
    nearest = base[np.argmin(np.abs(lines[hit][:, None] - base[None, :] * scales[best]), axis=1)]
    precision = (nearest / sigma[hit]) ** 2 * weight[hit] / weight[hit].max()
    ratio = float(np.sum(precision * lines[hit] / nearest) / precision.sum())
    scatter = float(np.sqrt(np.average((lines[hit] / nearest - ratio) ** 2, weights=precision)))
    error = max(scatter, float(1.0 / np.sqrt(precision.sum())), 2e-4)
    return Scale(ratio, error)


def _is_fundamental(lines: np.ndarray, base: np.ndarray, reach: float) -> bool:
    return bool(lines.size == 1 and abs(lines[0] / base.min() - 1.0) <= reach)


def refined(expected: Sequence[Expected], scale: Scale) -> tuple[Expected, ...]:
    """Return a base's expected frequencies moved by an observed scale, with its error."""
    return tuple(
        replace(
            item, frequency_hz=item.frequency_hz * scale.value, error_hz=item.frequency_hz * scale.value * scale.error
        )
        for item in expected
    )
