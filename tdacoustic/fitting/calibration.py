"""A fleet fitted to measured levels, with what the data can and cannot tell."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from tdacoustic.drive import HousingSound
from tdacoustic.errors import FittingError
from tdacoustic.fitting.calibrated import Calibration, FittedLevel, FittedParameter, LeftOut
from tdacoustic.fitting.doubts import (
    ON_A_BOUND,
    doubts_of_data,
    doubts_of_failures,
    doubts_of_fleet,
    doubts_of_levels,
    doubts_of_posterior,
    doubts_of_scatter,
    doubts_of_transfer,
    doubts_of_values,
    is_blind,
)
from tdacoustic.fitting.free import checked_free, free_parameter
from tdacoustic.fitting.intervals import ProfileInterval, profile_intervals
from tdacoustic.fitting.least_squares import fit
from tdacoustic.fitting.levels import SILENCE_DB, LevelModel
from tdacoustic.fitting.loss import Objective
from tdacoustic.fitting.measured_level import LEVELS_OF_CALIBRATION, OFFSET, MeasuredLevel, fingerprint
from tdacoustic.fitting.next_measurement import Candidate, next_measurements
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.parameters import FreeParameter, lmfit_parameters, values_of
from tdacoustic.fitting.posterior import sample_posterior
from tdacoustic.fitting.residuals import LevelResiduals
from tdacoustic.fitting.scatter import FittedScatter, fitted_scatter
from tdacoustic.fitting.settings import MODEL_SIGMA_DB, FitSettings
from tdacoustic.fitting.transfer import Transferred
from tdacoustic.fleet import Fleet

__all__ = ["Calibration", "FittedLevel", "FittedParameter", "LeftOut", "calibrate_fleet", "free_parameter"]

RESOLUTION: Final = 1e-4
STEP: Final = 1e-3
"""Singular value over the largest below which the levels do not see a direction, and the step of differences over the
width of the bounds: the gears' motions are exact to some 1e-6 only."""

_EXACT_STEPS: Final = 4
_EXACT_CLOSE: Final = 1e-4

Intervals = dict[str, ProfileInterval]


def calibrate_fleet(
    fleet: Fleet,
    data: Sequence[MeasuredLevel],
    free: Sequence[FreeParameter],
    settings: FitSettings | None = None,
    origin: str = "calibrated",
    model: LevelModel | None = None,
    candidates: Sequence[Candidate] = (),
    transferred: Sequence[Transferred] = (),
    earlier: Fleet | None = None,
    housing: HousingSound | None = None,
) -> Calibration:
    """Fit parameters of a fleet to measured levels.

    Parameters
    ----------
    fleet : Fleet
    data : sequence of MeasuredLevel
        Those in which the model is silent are left out, and said.
    free : sequence of FreeParameter
        By keys of the fleet; level offsets of campaigns and auxiliary parameters among them.
    settings : FitSettings, optional
    origin : str
        Of the fitted values, written into the fleet.
    model : LevelModel, optional
        Of the same fleet and data (`LevelModel.with_data`), where levels were computed before.
    candidates : sequence of Candidate
        Measurements that could be made next.
    transferred : sequence of Transferred
        What the priors in `free` were taken from, to be compared with what the data say without them.
    earlier : Fleet, optional
        The calibrated fleet that they come from.
    housing : HousingSound, optional
        As of `LevelModel`.

    Raises
    ------
    FittingError
        A parameter that the transfer vectors of the housing depend on is free; there are no data, the model gives no
        level for any of them, or it cannot be computed where the fit starts.
    """
    settings = settings or FitSettings()
    checked_free(fleet, [parameter.name for parameter in free])
    held, said = _heard(fleet, data, housing)
    if model is None or len(held) != len(data):
        model = LevelModel(fleet, held, housing)
    _check_start(model, free)
    interpolated_db = model.prepare(free)
    sigma_db, scatter, doubts = _model_sigma_db(model, free, settings)
    residuals = LevelResiduals(model, sigma_db)
    searched = fit(residuals, free, settings.starts, settings.loss, polish=False, resolution=RESOLUTION, step=STEP)
    found = searched if interpolated_db is None else _exactly(searched, residuals.exactly())
    freedom = None if scatter is None else float(scatter.freedom)
    intervals = [profile_intervals(residuals, searched, level, freedom) for level in (0.95, 0.68)]
    parameters = tuple(_fitted(parameter, found, *intervals) for parameter in free)
    levels = _levels(model, residuals, found)
    groups = dict.fromkeys(datum.group for datum in model.data)
    left_out = tuple(_left_out(model, group, searched, sigma_db) for group in groups)
    sampled = settings.posterior if searched.moved else None
    posterior = None if sampled is None else sample_posterior(residuals, searched, sampled)
    compared = _compared(transferred, residuals, searched)
    return Calibration(
        _calibrated_fleet(fleet, residuals, found, parameters, origin),
        parameters,
        levels,
        left_out,
        found.correlation(),
        found.rank,
        found.condition_number,
        found.chi_square,
        found.n_free,
        sigma_db,
        settings,
        interpolated_db,
        model.sounds({}),
        model.sounds(found.values),
        next_measurements(residuals, found, candidates),
        posterior,
        compared,
        (
            *said,
            *doubts,
            *doubts_of_scatter(scatter),
            *doubts_of_levels(model.data, earlier),
            *doubts_of_values(residuals, searched, parameters),
            *doubts_of_data(levels, left_out, residuals, searched),
            *doubts_of_fleet(fleet),
            *doubts_of_failures(model.failures),
            *doubts_of_posterior(posterior),
            *doubts_of_transfer(compared),
        ),
        found,
    )


def _check_start(model: LevelModel, free: Sequence[FreeParameter]) -> None:
    """Raise for values to start from with which the model cannot be computed."""
    start = values_of(free, lmfit_parameters(free))
    if not np.isfinite(model.levels_db(start)).all():
        shown = ", ".join(f"{name} {value:.4g}" for name, value in start.items())
        why = f": {model.failures[-1]}" if model.failures else ""
        raise FittingError(f"{model.fleet.path}: the model cannot be computed where the fit starts ({shown}){why}")


def _calibrated_fleet(
    fleet: Fleet, residuals: LevelResiduals, found: Fit, parameters: Sequence[FittedParameter], origin: str
) -> Fleet:
    """The fleet with what the data have changed in it, and with fingerprints of these data."""
    blind = {parameter.name for parameter in found.moved if is_blind(residuals, found, parameter)}
    keys = [p.key for p in parameters if "." in p.key and not p.key.startswith(OFFSET) and p.key not in blind]
    errors = {p.key: p.stderr for p in parameters if p.stderr is not None and p.key in keys}
    made = fleet.replaced({key: found.values[key] for key in keys}, stderr=errors, origin=origin)
    prints = ", ".join(sorted({fingerprint(datum) for datum in residuals.model.data}))
    meta = dict(fleet.meta) | {LEVELS_OF_CALIBRATION: prints}
    return replace(made, meta=tuple(meta.items()))


def _heard(
    fleet: Fleet, data: Sequence[MeasuredLevel], housing: HousingSound | None
) -> tuple[list[MeasuredLevel], list[str]]:
    """Return the data for which the model has a sound, and what was left out in words."""
    if not data:
        raise FittingError("there are no levels to calibrate with")
    levels = LevelModel(fleet, data, housing).levels_db({})
    silent = [datum for datum, level in zip(data, levels, strict=True) if level <= SILENCE_DB]
    if len(silent) == len(data):
        names = ", ".join(dict.fromkeys(datum.condition.name for datum in silent))
        raise FittingError(
            f"{fleet.path}: the model gives no level in condition {names}: none of the paths that the total adds has a "
            "sound there"
        )
    overall = dict.fromkeys(d.condition.name for d in silent if d.band_hz is None)
    said = []
    if overall:
        said.append(
            f"the model gives no level in condition {', '.join(overall)}, none of the paths that the total adds has a "
            "sound there: what was measured there is not used"
        )
    n_bands = sum(datum.band_hz is not None for datum in silent)
    if n_bands:
        said.append(
            f"{n_bands} of {sum(d.band_hz is not None for d in data)} levels of bands and orders are not used: the "
            "model has no line there"
        )
    return [datum for datum, level in zip(data, levels, strict=True) if level > SILENCE_DB], said


def _model_sigma_db(
    model: LevelModel, free: Sequence[FreeParameter], settings: FitSettings
) -> tuple[float, FittedScatter | None, list[str]]:
    if settings.model_sigma_db is not None:
        return settings.model_sigma_db, None, []
    try:
        found = fitted_scatter(model, free, settings.starts)
    except FittingError as error:
        return (
            MODEL_SIGMA_DB,
            None,
            [f"the model's scatter cannot be fitted: {error}; {MODEL_SIGMA_DB:g} dB are assumed"],
        )
    return found.sigma_db, found, []


def _exactly(searched: Fit, residuals: LevelResiduals) -> Fit:
    """Return the optimum of the computed levels, next to that of the interpolated ones, whose slopes serve."""
    objective = Objective(residuals, searched.parameters, searched.loss)
    moved, values = searched.moved, searched.values
    chi_square = objective.cost(values)
    if searched.loss == "linear" and moved:
        scale = np.linalg.norm(searched.jacobian, axis=0)
        for _ in range(_EXACT_STEPS):
            columns = searched.jacobian / np.where(scale > 0.0, scale, 1.0)
            step = np.linalg.lstsq(columns, -objective.rows(values), rcond=RESOLUTION)[0]
            inner = {
                p.name: min(max(p.inner(values[p.name]) + float(d / s), p.inner(p.low)), p.inner(p.high))
                for p, d, s in zip(moved, step, np.where(scale > 0.0, scale, math.inf), strict=True)
            }
            trial = searched.at(inner)
            reached = objective.cost(trial)
            if not reached < chi_square:
                break
            chi_square, values = reached, trial
            if float(np.abs(step).max()) < _EXACT_CLOSE:
                break
    return replace(searched, values=values, chi_square=chi_square)


def _fitted(parameter: FreeParameter, found: Fit, ci95: Intervals, ci68: Intervals) -> FittedParameter:
    name = parameter.name
    value = found.values[name]
    errors = found.standard_errors()
    stderr = None if errors is None else errors.get(name)
    if not parameter.is_moved:
        stderr = found.error_of(lambda values: values[name])
    elif _is_on_a_bound(parameter, value) or ci95.get(name) == (None, None) or _is_wide(parameter, found):
        stderr = None  # a curvature there is no deviation
    prior = parameter.prior
    if prior is not None and parameter.scale == "log":
        prior = (math.exp(prior[0]), math.exp(prior[0]) * prior[1])
    bounds = parameter.low, parameter.high
    intervals = ci95.get(name), ci68.get(name)
    return FittedParameter(name, value, parameter.initial, *bounds, stderr, *intervals, prior, parameter.expression)


def _is_wide(parameter: FreeParameter, found: Fit) -> bool:
    """Whether a standard error is longer than the bounds are apart."""
    return (found.inner_errors() or {}).get(parameter.name, 0.0) > parameter.width


def _is_on_a_bound(parameter: FreeParameter, value: float) -> bool:
    place = parameter.inner(value)
    near = min(place - parameter.inner(parameter.low), parameter.inner(parameter.high) - place)
    return math.isfinite(near) and near <= ON_A_BOUND * parameter.width


def _levels(model: LevelModel, residuals: LevelResiduals, found: Fit) -> tuple[FittedLevel, ...]:
    before, after = model.levels_db({}), model.levels_db(found.values, exact=True)
    return tuple(
        FittedLevel(datum, float(before[row]), float(after[row]), residuals.sigma_db(row))
        for row, datum in enumerate(model.data)
    )


def _left_out(model: LevelModel, group: str, found: Fit, model_sigma_db: float) -> LeftOut:
    others = LevelResiduals(model, model_sigma_db, without=group)
    if not others.rows.size:
        return LeftOut(group, None)
    started = [parameter.starting_at(found.values[parameter.name]) for parameter in found.parameters]
    again = fit(others, started, loss=found.loss, polish=False, resolution=RESOLUTION, step=STEP)
    rows = [row for row, datum in enumerate(model.data) if datum.group == group]
    measured = float(np.mean([model.data[row].level_db for row in rows]))
    mean_level = _mean_level(model, rows)
    spread = again.error_of(mean_level)
    own = math.sqrt(float(np.mean([model.data[row].sigma_db ** 2 for row in rows])) / len(rows))
    sigma_db = None if spread is None else math.hypot(spread, own, model_sigma_db)
    error_db = mean_level(again.values) - measured
    return LeftOut(group, error_db, sigma_db) if math.isfinite(error_db) else LeftOut(group, None)


def _mean_level(model: LevelModel, rows: Sequence[int]) -> Callable[[Mapping[str, float]], float]:
    return lambda values: float(model.levels_db(values)[list(rows)].mean())


def _compared(transferred: Sequence[Transferred], residuals: LevelResiduals, found: Fit) -> tuple[Transferred, ...]:
    """What the data say of the transferred parameters without what was carried over."""
    if not transferred:
        return ()
    keys = {held.key for held in transferred}
    started = [
        replace(p.starting_at(found.values[p.name]), prior=None if p.name in keys else p.prior)
        for p in found.parameters
    ]
    alone = fit(residuals, started, 4, found.loss, polish=False, resolution=RESOLUTION, step=STEP)
    errors = alone.standard_errors() or {}
    by_name = {parameter.name: parameter for parameter in alone.parameters}
    return tuple(
        replace(held, alone=alone.values[held.key], alone_stderr=errors[held.key])
        if held.key in errors and not _is_on_a_bound(by_name[held.key], alone.values[held.key])
        else held
        for held in transferred
    )
