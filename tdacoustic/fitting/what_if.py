"""Intervals of what a change of the drive does to its levels, from what a calibration leaves open.

Two things are uncertain after a calibration. Its parameters: every set of values that the data allow gives the levels
of the paths before and after the change. And the model itself, by its scatter: what a level of it is off by. A change
of a level is off by nothing where all paths are off alike, and by more where they are not; nobody knows which. So the
change holds the scatter as an error of each path by itself, in each condition anew [ours]: the relation between the
paths is then as uncertain as the levels are. The change with the parameters alone is given beside it, and is what
remains where the paths are off alike.

Both together are one profile-likelihood interval: the range of the change over all values and errors whose chi square
has risen by no more than the square of the quantile, an error counting with its square over the scatter's. Where a
posterior was sampled its quantiles are taken instead.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition, HousingSound, Receiver
from tdacoustic.drive.conditions import followed
from tdacoustic.drive.levels import WEIGHTINGS, Path, paths_of_total
from tdacoustic.drive.what_if import IntervalBasis, WhatIfAnswer, WhatIfLevel, changed_fleet, changed_total_db
from tdacoustic.errors import FittingError
from tdacoustic.fitting.calibrated import Calibration
from tdacoustic.fitting.intervals import quantile_of
from tdacoustic.fitting.levels import DYNAMIC, LevelModel
from tdacoustic.fitting.likelihood_region import likelihood_region
from tdacoustic.fitting.measured_level import OFFSET, MeasuredLevel
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.posterior import Posterior
from tdacoustic.fitting.residuals import LevelResiduals, states_of
from tdacoustic.fleet import Fleet, WhatIf

__all__ = ["WhatIfPlaces", "what_if_intervals"]

Real = NDArray[np.float64]
Values = dict[str, float]
Levels = Mapping[Path, Real]
Index = dict[tuple[str, str, str], int]
Ends = tuple[float, float]

LEVEL: Final = 0.95

MOST: Final = 4000
MOST_OF_COSTLY_GEARS: Final = 500
"""How often the residuals are computed to find the region, and where each time asks for motions of the gears."""

SAMPLES: Final = 600
SCATTERS: Final = 8000
"""Sets of values out of a posterior, and errors of the model drawn with them; the sets repeat."""

AS_IT_IS: Final = WhatIf(name="as it is", motor_db=0.0)


@dataclass(frozen=True)
class WhatIfPlaces:
    """Where and with what an answer's levels were computed.

    Parameters
    ----------
    conditions : tuple of Condition
        With the speeds and torques of the calibrated fleet.
    receivers : tuple of Receiver
        The surface first.
    housing : HousingSound or None
        Of the fleet as it is.
    changed_housings : mapping of str to HousingSound or None
        Of the cases with other parameters, by name.
    """

    conditions: tuple[Condition, ...]
    receivers: tuple[Receiver, ...]
    housing: HousingSound | None
    changed_housings: Mapping[str, HousingSound | None]


def what_if_intervals(
    answer: WhatIfAnswer, calibration: Calibration, model: LevelModel, places: WhatIfPlaces, seed: int = 0
) -> WhatIfAnswer:
    """Return an answer with intervals of 95 %; without them, the reason as a doubt, where there can be none.

    They hold the fitted parameters and the scatter of the model; not what parameters that were not fitted are off by,
    nor sound that the model does not have, nor whether a measure keeps what it promises.

    Parameters
    ----------
    answer : WhatIfAnswer
        Of the calibrated fleet.
    calibration : Calibration
        With its fit.
    model : LevelModel
        Of the uncalibrated fleet, at the levels of the calibration.
    places : WhatIfPlaces
    seed : int
    """
    fit = calibration.fit
    if fit is None:
        return answer
    try:
        cloud, sets = _cloud(calibration, fit, model, paths_of_total(calibration.fleet), seed)
    except FittingError as error:
        return replace(answer, doubts=(*answer.doubts, f"what changes would do has no interval: {error}"))
    before, index = _paths_db(calibration.fleet, places.conditions, places.housing, fit.moved, sets, places.receivers)
    after = dict.fromkeys((case.name for case in answer.cases), before)
    for case in answer.cases:
        if case.parameters:
            fleet = changed_fleet(calibration.fleet, case)
            changed = tuple(followed(condition, calibration.fleet, fleet) for condition in places.conditions)
            moved = [p for p in fit.moved if not _is_given(p.name, case)]
            kept = [{name: value for name, value in held.items() if not _is_given(name, case)} for held in sets]
            housing = places.changed_housings.get(case.name)
            after[case.name], _ = _paths_db(fleet, changed, housing, moved, kept, places.receivers)
    cases = {case.name: case for case in answer.cases}
    levels = []
    for level in answer.levels:
        row = index[level.condition, level.receiver, level.weighting]
        sides = [{path: held[:, row] for path, held in of.items()} for of in (before, after[level.case])]
        levels.append(_with_ends(level, cloud, cases[level.case], *sides))
    keys = tuple(p.name for p in fit.moved if not p.name.startswith(OFFSET))
    basis = IntervalBasis(cloud.method, len(sets), keys, calibration.model_sigma_db, _open(calibration))
    failed = [case for case, of in after.items() if any(np.isnan(held).any() for held in of.values())]
    doubts = [f"{case}: for some of the values that the data allow it cannot be computed" for case in failed]
    return replace(answer, levels=tuple(levels), basis=basis, doubts=(*answer.doubts, *doubts))


def _with_ends(level: WhatIfLevel, cloud: _Cloud, case: WhatIf, before: Levels, after: Levels) -> WhatIfLevel:
    if level.change_db is None or level.level_db is None:
        return level
    fit_after = changed_total_db(after, case)
    of_fit = fit_after - changed_total_db(before, AS_IT_IS)
    change = changed_total_db(cloud.shaken(after), case) - changed_total_db(cloud.shaken(before), AS_IT_IS)
    return replace(
        level,
        change_95_db=_holding(cloud.ends(change), level.change_db),
        fit_95_db=_holding(cloud.ends_of_sets(of_fit), level.change_db),
        level_95_db=_holding(cloud.ends_of_level(fit_after), level.level_db),
    )


def _holding(ends: Ends | None, value: float) -> Ends | None:
    """Ends that hold the value itself: the levels of the sets may be interpolated, and quantiles may miss it."""
    return None if ends is None else (min(ends[0], value), max(ends[1], value))


# ---------------------------------------------------------------- what is allowed


class _Cloud(Protocol):
    """Sets of values, and errors of the model with them."""

    method: str

    def shaken(self, levels: Levels) -> dict[Path, Real]: ...

    def ends(self, values: Real) -> Ends | None: ...

    def ends_of_sets(self, values: Real) -> Ends | None: ...

    def ends_of_level(self, levels: Real) -> Ends | None: ...


class _Region:
    """A likelihood region: each set with the errors of the paths that its chi square leaves room for."""

    method = "profile"

    def __init__(self, risen: Real, rise: float, sigma_db: float, paths: Sequence[Path]) -> None:
        self._room_db = sigma_db * np.sqrt(np.maximum(rise - risen, 0.0))
        grid = [np.array(signs) for signs in itertools.product((-1.0, -0.5, 0.0, 0.5, 1.0), repeat=len(paths))]
        unit = {tuple((place / np.linalg.norm(place)).round(9)) for place in grid if place.any()}
        directions = np.array(sorted(unit)) if sigma_db > 0.0 and unit else np.zeros((1, len(paths)))
        self._directions = dict(zip(paths, directions.T, strict=True))

    def shaken(self, levels: Levels) -> dict[Path, Real]:
        return {path: held[:, None] + np.outer(self._room_db, self._directions[path]) for path, held in levels.items()}

    def ends(self, values: Real) -> Ends | None:
        held = values[np.isfinite(values)]
        return (float(held.min()), float(held.max())) if held.size else None

    ends_of_sets = ends

    def ends_of_level(self, levels: Real) -> Ends | None:
        return self.ends(np.concatenate([levels - self._room_db, levels + self._room_db]))


class _Samples:
    """Samples of a posterior: each set with errors drawn at random."""

    method = "posterior"

    def __init__(self, n_sets: int, sigma_db: Real, paths: Sequence[Path], seed: int) -> None:
        random = np.random.default_rng(seed)
        self._sets = np.arange(sigma_db.size) % n_sets
        self._of_path = {path: sigma_db * random.standard_normal(sigma_db.size) for path in paths}
        self._of_level = sigma_db * random.standard_normal(sigma_db.size)

    def shaken(self, levels: Levels) -> dict[Path, Real]:
        return {path: held[self._sets] + self._of_path[path] for path, held in levels.items()}

    def ends(self, values: Real) -> Ends | None:
        held = values[np.isfinite(values)]
        if not held.size:
            return None
        low, high = np.quantile(held, (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))
        return float(low), float(high)

    ends_of_sets = ends

    def ends_of_level(self, levels: Real) -> Ends | None:
        return self.ends(levels[self._sets] + self._of_level)


def _cloud(
    calibration: Calibration, fit: Fit, model: LevelModel, paths: Sequence[Path], seed: int
) -> tuple[_Cloud, list[Values]]:
    """What is allowed, and the sets of values in it."""
    moved, sigma_db = fit.moved, calibration.model_sigma_db
    freedom = _freedom(calibration, model)
    keys = [parameter.name for parameter in moved]
    posterior = calibration.posterior
    if posterior is not None:
        inner = _of_posterior(posterior, moved)
        widened = np.full(SCATTERS, sigma_db)
        if freedom is not None:
            widened *= np.sqrt(freedom / np.random.default_rng([seed, 1]).chisquare(freedom, SCATTERS))
        return _Samples(len(inner), widened, paths, seed), [_at(fit, keys, place) for place in inner]
    interpolated = model.prepare(moved) is not None or not any(key.startswith(DYNAMIC) for key in keys)
    rise = quantile_of(LEVEL, freedom) ** 2
    residuals = LevelResiduals(model, sigma_db)
    most = MOST if interpolated else MOST_OF_COSTLY_GEARS
    region = likelihood_region(residuals, fit, rise, _ends_of(calibration), most, seed)
    sets = [_at(fit, keys, place) for place in region.inner]
    return _Region(region.risen, rise, sigma_db, paths), sets


def _ends_of(calibration: Calibration) -> dict[str, Ends]:
    """Ends of the parameters' intervals, of an open one the bound."""
    found = {}
    for p in calibration.moved:
        low, high = (None, None) if p.ci95 is None else p.ci95
        found[p.key] = (p.low if low is None else low, p.high if high is None else high)
    return found


def _at(fit: Fit, keys: Sequence[str], place: Real) -> Values:
    return fit.at(dict(zip(keys, place.tolist(), strict=True)))


def _of_posterior(posterior: Posterior, moved: Sequence[FreeParameter]) -> Real:
    chosen = np.linspace(0, posterior.samples.shape[1] - 1, SAMPLES).round().astype(int)
    rows = zip(moved, posterior.samples, strict=True)
    return np.array([[parameter.inner(float(value)) for value in row[chosen]] for parameter, row in rows]).T


def _freedom(calibration: Calibration, model: LevelModel) -> float | None:
    """Degrees of freedom that the scatter was taken from; None where it was given."""
    if not calibration.model_sigma_is_fitted:
        return None
    freedom = len(states_of(model.data)) - sum(p.prior is None for p in calibration.moved)
    return float(freedom) if freedom >= 1 else None


def _open(calibration: Calibration) -> tuple[str, ...]:
    """Fitted parameters of the fleet that a bound holds and not the data."""
    of_fleet = [p for p in calibration.moved if "." in p.key and not p.key.startswith(OFFSET)]
    return tuple(p.key for p in of_fleet if p.ci95 is None or None in p.ci95)


# ---------------------------------------------------------------- levels of the paths


def _is_given(name: str, case: WhatIf) -> bool:
    """Whether a case states a fitted parameter, or the list that it is an entry of."""
    return any(name == key or name.startswith(f"{key}.") for key, _ in case.parameters)


def _paths_db(
    fleet: Fleet,
    conditions: Sequence[Condition],
    housing: HousingSound | None,
    moved: Sequence[FreeParameter],
    sets: Sequence[Values],
    receivers: Sequence[Receiver],
) -> tuple[dict[Path, Real], Index]:
    """Levels of the paths for each set of values, shape (sets, rows), and the rows by condition, place, weighting."""
    asked = [
        MeasuredLevel(condition, receiver, 0.0, 1.0, weighting, "", "")
        for condition, receiver, weighting in itertools.product(conditions, receivers, WEIGHTINGS)
    ]
    model = LevelModel(fleet, asked, housing)
    model.prepare(moved)
    found = [model.paths_db(values) for values in sets]
    index = {(d.condition.name, d.receiver.name, str(d.weighting)): row for row, d in enumerate(asked)}
    return {path: np.stack([held[path] for held in found]) for path in paths_of_total(fleet)}, index
