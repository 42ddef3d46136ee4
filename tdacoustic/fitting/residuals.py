"""Levels of a model less measured levels, over what both are uncertain by."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.measured_level import MeasuredLevel

__all__ = ["LevelResiduals", "StateResiduals", "same_state", "shared", "states_of"]

Real = NDArray[np.float64]

_SAME_STATE: Final = 1e-3


class LevelResiduals:
    """Weighted residuals of a model's levels.

    What a measurement is uncertain by is its own; what the model is off by it is off by for every receiver of a
    condition alike, and each time it is measured. So levels of one speed and torque and of one part of the sound share
    the model's scatter, and ten microphones do not make ten conditions of one [ours]. Multiplied by the symmetric
    inverse root of that covariance the residuals are independent and of unit variance, in whatever order they stand.

    Parameters
    ----------
    model : LevelModel
    model_sigma_db : float
    without : str, optional
        Condition of the campaign whose levels are left out, and with it all others of its speed and torque.
    exact : bool
        See `LevelModel.levels_db`.
    """

    def __init__(
        self, model: LevelModel, model_sigma_db: float, without: str | None = None, exact: bool = False
    ) -> None:
        self.model, self.model_sigma_db, self.exact = model, model_sigma_db, exact
        left = [datum.condition for datum in model.data if datum.group == without]
        kept = (not any(same_state(datum.condition, held) for held in left) for datum in model.data)
        self.rows = np.flatnonzero(np.fromiter(kept, dtype=bool))
        self._measured = np.array([datum.level_db for datum in model.data])
        held = [model.data[row] for row in self.rows]
        self.covariance = np.diag([datum.sigma_db**2 for datum in held]) + model_sigma_db**2 * shared(held, held)
        values, directions = np.linalg.eigh(self.covariance)
        self._root = (directions / np.sqrt(values)) @ directions.T

    def __call__(self, values: Mapping[str, float]) -> Real:
        """Return the residuals, shape (n,)."""
        errors = self.model.levels_db(values, self.exact) - self._measured
        return np.asarray(self._root @ errors[self.rows])

    def unweighted(self, weighted: Real) -> Real:
        """Return what `weighted` was before it was divided by the root of the covariance; the data are the rows."""
        return np.asarray(np.linalg.solve(self._root, weighted))

    def exactly(self) -> LevelResiduals:
        """Return those of gears computed at each place, where the model interpolates."""
        made = LevelResiduals.__new__(LevelResiduals)
        made.__dict__.update(self.__dict__, exact=True)
        return made

    def sigma_db(self, row: int) -> float:
        """Standard deviation of a measured level and of the model together."""
        return math.hypot(self.model.data[row].sigma_db, self.model_sigma_db)


class StateResiduals:
    """Weighted residuals of the mean level of each state of operation and part of the sound.

    For the model's scatter: how far several levels of one state lie apart tells of the measurement, not of the model.

    Parameters
    ----------
    model : LevelModel
    model_sigma_db : float
    """

    def __init__(self, model: LevelModel, model_sigma_db: float) -> None:
        self._model = model
        self._measured = np.array([datum.level_db for datum in model.data])
        groups = states_of(model.data)
        self._means = np.zeros((len(groups), len(model.data)))
        variances = np.zeros(len(groups))
        for index, rows in enumerate(groups):
            weights = np.array([model.data[row].sigma_db ** -2.0 for row in rows])
            self._means[index, rows] = weights / weights.sum()
            variances[index] = 1.0 / weights.sum()
        self._sigma = np.sqrt(variances + model_sigma_db**2)

    def __call__(self, values: Mapping[str, float]) -> Real:
        """Return the residuals, one a state and part."""
        return np.asarray(self._means @ (self._model.levels_db(values) - self._measured) / self._sigma)


def states_of(data: Sequence[MeasuredLevel]) -> list[list[int]]:
    """Return the rows of each state of operation and part of the sound."""
    groups: list[list[int]] = []
    for row, datum in enumerate(data):
        for group in groups:
            if _one(data[group[0]], datum):
                group.append(row)
                break
        else:
            groups.append([row])
    return groups


def shared(first: Sequence[MeasuredLevel], second: Sequence[MeasuredLevel]) -> Real:
    """Return one where two levels are of one state and one part of the sound, else zero."""
    return np.array([[float(_one(a, b)) for b in second] for a in first]).reshape(len(first), len(second))


def _one(first: MeasuredLevel, second: MeasuredLevel) -> bool:
    return first.what == second.what and same_state(first.condition, second.condition)


def same_state(first: Condition, second: Condition) -> bool:
    """Whether two conditions are one to the model, whatever their names: the same speed and torque."""
    pairs = (first.motor_hz, second.motor_hz), (first.torque_n_m, second.torque_n_m)
    return all(abs(a - b) <= _SAME_STATE * max(abs(a), abs(b)) for a, b in pairs)
