"""A fleet fitted to measured levels, with what the data can and cannot tell."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import DriveSound
from tdacoustic.errors import FittingError
from tdacoustic.fitting.intervals import ProfileInterval, profile_intervals
from tdacoustic.fitting.least_squares import Fit, Residuals, fit
from tdacoustic.fitting.levels import SILENCE_DB, LevelModel, MeasuredLevel
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fleet import Fleet

__all__ = ["Calibration", "FittedLevel", "FittedParameter", "LeftOut", "calibrate_fleet", "free_parameter"]

STARTS: Final = 16
CORRELATED: Final = 0.95
OUTLYING: Final = 2.5
"""Residual over its standard deviation from which a condition is called outlying [assumed]."""

CANNOT_REACH: Final = 2.0
"""Root mean square of the weighted residuals from which the model is said not to reach the data [assumed]."""

ON_A_BOUND: Final = 1e-4

Scale = Literal["linear", "log"]

_BOUNDS: Final[dict[str, tuple[float, float, Scale]]] = {
    "masuda.constant_db": (-100.0, 100.0, "linear"),
    "model.structure_gain_db": (-60.0, 60.0, "linear"),
    "gear_dynamics.mesh_damping_ratio": (0.005, 0.5, "log"),
    "gear_dynamics.bearing_damping_ratio": (0.005, 0.5, "log"),
}
"""Bounds and scale of parameters that are often freed [assumed]; others get a tenth to ten times their value."""


@dataclass(frozen=True)
class FittedParameter:
    """A parameter after the fit.

    Parameters
    ----------
    key : str
        Of the fleet.
    value, initial, low, high : float
        In the unit that the key names.
    stderr : float or None
        One standard deviation; None where it cannot be had.
    ci95 : (float or None, float or None) or None
        Profile-likelihood interval; an end is None where a bound comes before it.
    """

    key: str
    value: float
    initial: float
    low: float
    high: float
    stderr: float | None
    ci95: ProfileInterval | None


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
    """What a fit without a condition predicts for it: predicted less measured, the mean over its data; None where the
    others allow no fit.
    """

    condition: str
    error_db: float | None


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
        Of the parameters, in their order; None where it cannot be had.
    rank : int
        Directions among the parameters that the data see.
    chi_square : float
        Of the weighted residuals, priors included.
    before, after : tuple of DriveSound
        The drive's sound in each condition, by contributions.
    doubts : tuple of str
        What must be known before the values are used; empty of a fit without any.
    """

    fleet: Fleet
    parameters: tuple[FittedParameter, ...]
    levels: tuple[FittedLevel, ...]
    left_out: tuple[LeftOut, ...]
    correlation: NDArray[np.float64] | None
    rank: int
    chi_square: float
    before: tuple[DriveSound, ...]
    after: tuple[DriveSound, ...]
    doubts: tuple[str, ...]


def free_parameter(fleet: Fleet, key: str) -> FreeParameter:
    """Return a parameter of a fleet as one that a fit may move, with its usual bounds.

    Parameters
    ----------
    fleet : Fleet
    key : str
        Of a single number.

    Raises
    ------
    FittingError
        It is no single number, or zero without usual bounds.
    """
    value = fleet.get(key).value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FittingError(f"{fleet.path}: {key} is no single number and cannot be freed")
    low, high, scale = _BOUNDS.get(key, (0.1 * value, 10.0 * value, "log"))
    if scale == "log" and value <= 0.0:
        raise FittingError(
            f"{fleet.path}: {key} is {value:g}: a parameter is freed from a tenth to ten times its value"
        )
    return FreeParameter(key, float(value), min(low, float(value)), max(high, float(value)), None, scale)


def calibrate_fleet(
    fleet: Fleet,
    data: Sequence[MeasuredLevel],
    free: Sequence[FreeParameter],
    model_sigma_db: float,
    origin: str = "calibrated",
    starts: int = STARTS,
) -> Calibration:
    """Fit parameters of a fleet to measured levels.

    Parameters
    ----------
    fleet : Fleet
    data : sequence of MeasuredLevel
    free : sequence of FreeParameter
        By keys of the fleet.
    model_sigma_db : float
        Scatter of the model itself, one standard deviation; added to that of each datum in squares.
    origin : str
        Of the fitted values, written into the fleet.
    starts : int
        Of the search, spread over the bounds.

    Raises
    ------
    FittingError
        There are no data, or the model gives no level for them.
    """
    if not data:
        raise FittingError("there are no levels to calibrate with")
    model = LevelModel(fleet, data)
    before_db = model.levels_db({})
    silent = [d.condition.name for d, level in zip(data, before_db, strict=True) if level <= SILENCE_DB]
    if silent:
        raise FittingError(
            f"{fleet.path}: the model gives no level in condition {', '.join(dict.fromkeys(silent))}: none of the "
            "paths that the total adds has a sound there"
        )
    residuals = _residuals(model, model_sigma_db)
    found = fit(residuals, free, starts)
    intervals = profile_intervals(residuals, found) if found.covariance is not None else {}
    errors = found.standard_errors()
    parameters = tuple(_fitted(parameter, found, errors, intervals) for parameter in free)
    after_db = model.levels_db(found.values)
    levels = tuple(
        FittedLevel(datum, float(before), float(after), math.hypot(datum.sigma_db, model_sigma_db))
        for datum, before, after in zip(data, before_db, after_db, strict=True)
    )
    left_out = tuple(_left_out(model, condition.name, found, model_sigma_db) for condition in model.conditions)
    return Calibration(
        fleet.replaced(found.values, stderr=errors, origin=origin),
        parameters,
        levels,
        left_out,
        found.correlation(),
        found.rank,
        found.chi_square,
        model.sounds({}),
        model.sounds(found.values),
        tuple(_doubts(found, parameters, levels, fleet)),
    )


def _residuals(model: LevelModel, model_sigma_db: float) -> Residuals:
    measured = np.array([datum.level_db for datum in model.data])
    sigma = np.array([math.hypot(datum.sigma_db, model_sigma_db) for datum in model.data])

    def residuals(values: Mapping[str, float]) -> NDArray[np.float64]:
        return np.asarray((model.levels_db(values) - measured) / sigma)

    return residuals


def _fitted(
    parameter: FreeParameter, found: Fit, errors: dict[str, float] | None, intervals: dict[str, ProfileInterval]
) -> FittedParameter:
    return FittedParameter(
        parameter.name,
        found.values[parameter.name],
        parameter.initial,
        parameter.low,
        parameter.high,
        None if errors is None else errors.get(parameter.name),
        intervals.get(parameter.name),
    )


def _left_out(model: LevelModel, condition: str, found: Fit, model_sigma_db: float) -> LeftOut:
    others = model.without(condition)
    if not others.data:
        return LeftOut(condition, None)
    started = [parameter.starting_at(found.values[parameter.name]) for parameter in found.parameters]
    again = fit(_residuals(others, model_sigma_db), started, polish=False)
    predicted = model.levels_db(again.values)
    errors = [
        float(level) - datum.level_db
        for level, datum in zip(predicted, model.data, strict=True)
        if datum.condition.name == condition
    ]
    return LeftOut(condition, sum(errors) / len(errors))


def _doubts(
    found: Fit, parameters: tuple[FittedParameter, ...], levels: tuple[FittedLevel, ...], fleet: Fleet
) -> Iterator[str]:
    yield from _doubts_of_values(found, parameters)
    conditions = {level.datum.condition.name for level in levels}
    if len(conditions) == 1:
        yield "all data are of one condition: what depends on speed cannot be told from what does not"
    rms = math.sqrt(sum((level.error_db / level.sigma_db) ** 2 for level in levels) / len(levels))
    worst = max(levels, key=lambda level: abs(level.error_db))
    if rms > CANNOT_REACH:
        yield (
            f"the model does not reach the data: the misfit is {rms:.1f} standard deviations rms, at worst "
            f"{worst.error_db:+.1f} dB in condition {worst.datum.condition.name}"
        )
    scatter = np.array([level.error_db / level.sigma_db for level in levels])
    for index, (level, ratio) in enumerate(zip(levels, scatter, strict=True)):
        others = np.delete(scatter, index)
        if abs(ratio) > OUTLYING and others.size and abs(ratio) > 3.0 * float(np.abs(others).mean()):
            yield (
                f"condition {level.datum.condition.name} is outlying: the model is {level.error_db:+.1f} dB off there, "
                f"{abs(ratio):.1f} standard deviations"
            )
    if fleet.model.gear_path.value == "sum":
        yield 'gear counted twice: gear_path = "sum" adds the bearing forces\' sound to a level that already holds it'
    if fleet.masuda.placement.value == "inside":
        yield (
            "Masuda's source is inside the housing: nothing of it reaches a receiver, so its constant cannot be found"
        )


def _doubts_of_values(found: Fit, parameters: tuple[FittedParameter, ...]) -> Iterator[str]:
    if found.rank < len(found.moved):
        yield (
            f"the data see {found.rank} of {len(found.moved)} directions among the parameters: these cannot all be "
            "determined"
        )
    data = found.jacobian[: found.n_data]
    for column, parameter in zip(data.T, found.moved, strict=True):
        if float(np.abs(column).max(initial=0.0)) * max(1.0, abs(parameter.inner(found.values[parameter.name]))) < 1e-9:
            yield f"{parameter.name} changes none of the levels: the data cannot see it"
    for parameter, fitted in zip(found.parameters, parameters, strict=True):
        place, low, high = (parameter.inner(value) for value in (fitted.value, fitted.low, fitted.high))
        width = high - low
        if math.isfinite(width) and min(place - low, high - place) <= ON_A_BOUND * width:
            end = fitted.low if place - low < high - place else fitted.high
            yield f"{parameter.name} ended on its bound {end:g}: the optimum may lie beyond it"
        elif fitted.ci95 is not None and None in fitted.ci95:
            yield f"the interval of {parameter.name} reaches a bound before it ends: the data do not determine it"
    correlation = found.correlation()
    if correlation is not None:
        for i, first in enumerate(found.moved):
            for j, second in enumerate(found.moved[:i]):
                if abs(correlation[i, j]) > CORRELATED:
                    yield (
                        f"{second.name} and {first.name} are correlated by {correlation[i, j]:+.3f}: each hides the "
                        "other"
                    )
    near = [chi for chi, _ in found.minima if chi < found.chi_square + 4.0]
    if near:
        others = "another set of values fits" if len(near) == 1 else f"{len(near)} other sets of values fit"
        yield f"there is more than one minimum: {others} about as well"
