"""Levels of a model less measured levels, over what both are uncertain by."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition
from tdacoustic.fitting.levels import LevelModel, MeasuredLevel

__all__ = ["LevelResiduals", "same_state"]

_SAME_STATE: Final = 1e-3

Real = NDArray[np.float64]


class LevelResiduals:
    """Weighted residuals of a model's levels.

    What a measurement is uncertain by is its own; what the model is off by it is off by for every receiver of a
    condition alike, and each time it is measured. So levels of one speed and torque and of one part of the sound share
    the model's scatter, and ten microphones do not make ten conditions of one [ours]. Multiplied by the inverse root of
    that covariance the residuals are independent and of unit variance.

    Parameters
    ----------
    model : LevelModel
    model_sigma_db : float
    without : str, optional
        Condition of the campaign whose levels are left out.
    exact : bool
        See `LevelModel.levels_db`.
    """

    def __init__(
        self, model: LevelModel, model_sigma_db: float, without: str | None = None, exact: bool = False
    ) -> None:
        self.model, self.model_sigma_db, self.exact = model, model_sigma_db, exact
        self.rows = np.array([i for i, datum in enumerate(model.data) if datum.group != without], dtype=int)
        self._measured = np.array([datum.level_db for datum in model.data])
        held = [model.data[row] for row in self.rows]
        covariance = model_sigma_db**2 * _shared(held) + np.diag([datum.sigma_db**2 for datum in held])
        self._root = np.linalg.inv(np.linalg.cholesky(covariance)) if held else np.zeros((0, 0))

    def __call__(self, values: Mapping[str, float]) -> Real:
        """Return the residuals, shape (n,)."""
        errors = self.model.levels_db(values, self.exact) - self._measured
        return np.asarray(self._root @ errors[self.rows])

    def exactly(self) -> LevelResiduals:
        """Return those of gears computed at each place, where the model interpolates."""
        made = LevelResiduals.__new__(LevelResiduals)
        made.__dict__.update(self.__dict__, exact=True)
        return made

    def sigma_db(self, row: int) -> float:
        """Standard deviation of a measured level and of the model together."""
        return math.hypot(self.model.data[row].sigma_db, self.model_sigma_db)


def _shared(data: Sequence[MeasuredLevel]) -> Real:
    """One where two levels are of one state of operation and one part of the sound, else zero."""
    shared = np.zeros((len(data), len(data)))
    for i, first in enumerate(data):
        for j, second in enumerate(data[: i + 1]):
            one = first.what == second.what and same_state(first.condition, second.condition)
            shared[i, j] = shared[j, i] = float(one)
    return shared


def same_state(first: Condition, second: Condition) -> bool:
    """Whether two conditions are one to the model, whatever their names: the same speed and torque."""
    pairs = (first.motor_hz, second.motor_hz), (first.torque_n_m, second.torque_n_m)
    return all(abs(a - b) <= _SAME_STATE * max(abs(a), abs(b)) for a, b in pairs)
