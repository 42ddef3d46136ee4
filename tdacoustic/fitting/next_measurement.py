"""Which measurement would tell most about the parameters, before it is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition, Receiver
from tdacoustic.fitting.levels import SILENCE_DB, LevelModel
from tdacoustic.fitting.measured_level import OFFSET, MeasuredLevel
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.residuals import LevelResiduals, shared

__all__ = ["Candidate", "NextMeasurement", "next_measurements"]

Real = NDArray[np.float64]

_STEP: Final = 1e-3
_ALIKE: Final = 3
"""Decimals of what remains of the intervals within which candidates tell alike."""

_OPEN: Final = 100.0
"""Standard error on the scale of the fit of a parameter of which nothing is known, and which has no bounds."""


@dataclass(frozen=True)
class Candidate:
    """A measurement that could be made.

    Parameters
    ----------
    condition : Condition
    receiver : Receiver
    sigma_db : float
        One standard deviation of its level.
    """

    condition: Condition
    receiver: Receiver
    sigma_db: float


@dataclass(frozen=True)
class NextMeasurement:
    """What a measurement is expected to do to the intervals.

    Parameters
    ----------
    condition : Condition
    receiver : Receiver
    expected_db : float
        Level that the model expects.
    remaining : dict of str to float
        By parameter: length of its interval after the measurement over that before it; level offsets of campaigns
        are left out.
    """

    condition: Condition
    receiver: Receiver
    expected_db: float
    remaining: dict[str, float]

    @property
    def mean_remaining(self) -> float:
        """Geometric mean of `remaining`: what the search goes by."""
        return math.exp(sum(math.log(part) for part in self.remaining.values()) / len(self.remaining))


def next_measurements(
    residuals: LevelResiduals, found: Fit, candidates: Sequence[Candidate]
) -> tuple[NextMeasurement, ...]:
    """Return what each candidate would tell, the most telling first; of those that tell alike, the slowest.

    To first order: the information of one more level is added to that of the data; at a speed and torque that is
    measured already it shares what the model is off by there. Of a parameter that the data do not determine the bounds
    are taken as what is known (a uniform spread between them).

    Parameters
    ----------
    residuals : LevelResiduals
        Of the data of the fit.
    found : Fit
    candidates : sequence of Candidate
        Those where the model is silent are left out.
    """
    moved = found.moved
    if not candidates or all(p.name.startswith(OFFSET) for p in moved):
        return ()
    model, sigma_db = residuals.model, residuals.model_sigma_db
    asked = [MeasuredLevel(c.condition, c.receiver, 0.0, c.sigma_db, "Z", "", "") for c in candidates]
    new = LevelModel(model.fleet, asked, model.housing)
    levels = new.levels_db(found.values)
    slopes = np.stack([_slope(new, found, parameter) for parameter in moved], axis=1)
    of_data = residuals.unweighted(found.jacobian[: found.n_data])
    of_priors = found.jacobian[found.n_data :]
    bounds = np.diag([_within_bounds(parameter) ** -2.0 for parameter in moved])
    known = of_data.T @ np.linalg.solve(residuals.covariance, of_data) + of_priors.T @ of_priors + bounds
    before = np.sqrt(np.diag(np.linalg.inv(known)))
    data = [model.data[row] for row in residuals.rows]
    together = sigma_db**2 * shared(data, asked)
    results = []
    for index, (datum, level) in enumerate(zip(asked, levels, strict=True)):
        if not level > SILENCE_DB:
            continue
        carried = np.linalg.solve(residuals.covariance, together[:, index])
        variance = datum.sigma_db**2 + sigma_db**2 - float(together[:, index] @ carried)
        seen = (slopes[index] - carried @ of_data) / math.sqrt(variance)
        after = np.sqrt(np.diag(np.linalg.inv(known + np.outer(seen, seen))))
        parts = zip(moved, after / before, strict=True)
        remaining = {p.name: float(part) for p, part in parts if not p.name.startswith(OFFSET)}
        results.append(NextMeasurement(datum.condition, datum.receiver, float(level), remaining))
    return tuple(sorted(results, key=lambda r: (round(r.mean_remaining, _ALIKE), r.condition.train_speed_km_h)))


def _slope(asked: LevelModel, found: Fit, parameter: FreeParameter) -> Real:
    """Change of each candidate's level with a parameter on the scale of the fit."""
    place = parameter.inner(found.values[parameter.name])
    step = _STEP * (parameter.width if math.isfinite(parameter.width) else max(abs(place), 1.0))
    low = max(place - step, parameter.inner(parameter.low))
    high = min(place + step, parameter.inner(parameter.high))
    inner = {p.name: p.inner(found.values[p.name]) for p in found.moved}
    below, above = (asked.levels_db(found.at({**inner, parameter.name: side})) for side in (low, high))
    slope = (above - below) / (high - low)
    return np.where(np.isfinite(slope), slope, 0.0)  # beside values for which there is no model, nothing is promised


def _within_bounds(parameter: FreeParameter) -> float:
    """Standard deviation of what is known without data: a uniform spread within the bounds."""
    return parameter.width / math.sqrt(12.0) if math.isfinite(parameter.width) else _OPEN
