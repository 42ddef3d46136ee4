"""What a calibration gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import DriveSound
from tdacoustic.fitting.intervals import ProfileInterval
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.fitting.next_measurement import NextMeasurement
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.posterior import Posterior
from tdacoustic.fitting.settings import FitSettings
from tdacoustic.fitting.transfer import Transferred
from tdacoustic.fleet import Fleet

__all__ = ["Calibration", "FittedLevel", "FittedParameter", "LeftOut"]


@dataclass(frozen=True)
class FittedParameter:
    """A parameter after the fit.

    Parameters
    ----------
    key : str
        Of the fleet; a level offset of a campaign or an auxiliary parameter has a name of its own.
    value, initial, low, high : float
        In the unit that the key names.
    stderr : float or None
        One standard deviation; None where it cannot be had.
    ci95, ci68 : (float or None, float or None) or None
        Profile-likelihood intervals; an end is None where a bound comes before it.
    prior : (float, float) or None
        Mean and standard deviation before, in the unit that the key names (to first order on a logarithmic scale).
    expression : str or None
        Where it was not fitted but follows from others.
    """

    key: str
    value: float
    initial: float
    low: float
    high: float
    stderr: float | None
    ci95: ProfileInterval | None
    ci68: ProfileInterval | None = None
    prior: tuple[float, float] | None = None
    expression: str | None = None


@dataclass(frozen=True)
class FittedLevel:
    """A datum beside the model.

    Parameters
    ----------
    datum : MeasuredLevel
    before_db, predicted_db : float
        The model's level with the fleet's values, and with the fitted ones.
    sigma_db : float
        One standard deviation of the measurement and of the model together.
    """

    datum: MeasuredLevel
    before_db: float
    predicted_db: float
    sigma_db: float

    @property
    def error_db(self) -> float:
        """Predicted less measured."""
        return self.predicted_db - self.datum.level_db


@dataclass(frozen=True)
class LeftOut:
    """What a fit without a condition predicts for it.

    Parameters
    ----------
    condition : str
    error_db : float or None
        Predicted less measured, the mean over its data; None where the others allow no fit.
    sigma_db : float or None
        One standard deviation that this error should have: of the measurement, the model, and the values found without
        it; None where the others do not determine these.
    """

    condition: str
    error_db: float | None
    sigma_db: float | None = None


@dataclass(frozen=True)
class Calibration:
    """A calibrated fleet.

    Parameters
    ----------
    fleet : Fleet
        With the fitted values, their standard deviations and their origin.
    parameters : tuple of FittedParameter
    levels : tuple of FittedLevel
    left_out : tuple of LeftOut
    correlation : ndarray or None
        Of the moved parameters, in their order; None where it cannot be had.
    rank : int
        Directions among the parameters that the data see.
    condition_number : float or None
        Of the Jacobian, its columns of length one: 1 where each parameter is seen apart, above 1000 hardly at all.
    chi_square : float
        Of the weighted residuals, priors included.
    degrees_of_freedom : int
        Levels less parameters without a prior; may be below one.
    model_sigma_db : float
        Scatter of the model that the intervals contain.
    settings : FitSettings
    interpolated_db : float or None
        Largest difference between the levels that the search used and the computed ones at checked places; None where
        every level was computed.
    before, after : tuple of DriveSound
        The drive's sound in each condition, by contributions.
    next_measurements : tuple of NextMeasurement
        The most telling first; empty where none were asked for.
    posterior : Posterior or None
    transferred : tuple of Transferred
        What an earlier calibration said.
    doubts : tuple of str
        What must be known before the values are used; empty of a fit without any.
    fit : Fit or None
        The optimum with its neighbourhood, from which the parameters can be drawn together.
    """

    fleet: Fleet
    parameters: tuple[FittedParameter, ...]
    levels: tuple[FittedLevel, ...]
    left_out: tuple[LeftOut, ...]
    correlation: NDArray[np.float64] | None
    rank: int
    condition_number: float | None
    chi_square: float
    degrees_of_freedom: int
    model_sigma_db: float
    settings: FitSettings
    interpolated_db: float | None
    before: tuple[DriveSound, ...]
    after: tuple[DriveSound, ...]
    next_measurements: tuple[NextMeasurement, ...]
    posterior: Posterior | None
    transferred: tuple[Transferred, ...]
    doubts: tuple[str, ...]
    fit: Fit | None = None

    @property
    def moved(self) -> tuple[FittedParameter, ...]:
        """Parameters that the fit moved, in the order of `correlation`."""
        return tuple(parameter for parameter in self.parameters if parameter.expression is None)

    @property
    def model_sigma_is_fitted(self) -> bool:
        """Whether the model's scatter was taken from the misfit."""
        return self.settings.model_sigma_db is None
