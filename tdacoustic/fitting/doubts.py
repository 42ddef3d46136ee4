"""What must be known before fitted values are used, one sentence each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from tdacoustic.fitting.calibrated import FittedLevel, FittedParameter, LeftOut
from tdacoustic.fitting.loss import Objective
from tdacoustic.fitting.measured_level import LEVELS_OF_CALIBRATION, MeasuredLevel, fingerprint
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.posterior import Posterior
from tdacoustic.fitting.residuals import LevelResiduals, same_state
from tdacoustic.fitting.scatter import LARGEST_DB, FittedScatter
from tdacoustic.fitting.transfer import Transferred
from tdacoustic.fleet import Fleet

__all__ = [
    "doubts_of_data",
    "doubts_of_failures",
    "doubts_of_fleet",
    "doubts_of_levels",
    "doubts_of_posterior",
    "doubts_of_scatter",
    "doubts_of_transfer",
    "doubts_of_values",
    "is_blind",
]

CORRELATED: Final = 0.95
OUTLYING: Final = 2.5
"""Error of a condition left out over its standard deviation from which it is called outlying [assumed]."""

UNREACHED: Final = 0.01
"""Probability of a misfit at least as large below which the model is said not to reach the data [assumed]."""

ON_A_BOUND: Final = 1e-4
UNSEEN: Final = 0.1
"""Largest change of a weighted residual, over the whole bounds, up to which the data are blind to a parameter."""

FEW: Final = 20
"""Degrees of freedom below which a fitted scatter is doubtful [assumed]."""

AS_WELL: Final = 4.0
BARRIER: Final = 0.1
"""Rise of chi square up to which another minimum fits about as well, and between two that makes them two."""


def doubts_of_values(residuals: LevelResiduals, found: Fit, parameters: tuple[FittedParameter, ...]) -> Iterator[str]:
    """Yield what is doubtful in the values: blind directions, bounds, correlations, other minima, priors."""
    if found.rank < len(found.moved) and found.is_left_open:
        yield (
            f"the data see {found.rank} of {len(found.moved)} directions among the parameters: these cannot all be "
            "determined"
        )
    blind = [parameter for parameter in found.moved if is_blind(residuals, found, parameter)]
    for parameter in blind:
        yield f"{parameter.name} changes none of the levels: the data cannot see it"
    fitted = {parameter.key: parameter for parameter in parameters}
    for parameter in found.moved:
        yield from _of_interval(parameter, fitted[parameter.name])
    undetermined = [name for name, held in fitted.items() if held.expression is None and held.ci95 is None]
    if undetermined and found.is_left_open:
        yield f"no interval can be given for {', '.join(undetermined)}"
    correlation = found.correlation()
    if correlation is not None:
        for j, i in itertools.combinations(range(len(found.moved)), 2):
            if abs(correlation[i, j]) > CORRELATED:
                yield (
                    f"{found.moved[j].name} and {found.moved[i].name} are correlated by {correlation[i, j]:+.3f}: each "
                    "hides the other"
                )
    if found.rank == len(found.moved):
        near = [values for chi, values in found.minima if chi < found.chi_square + AS_WELL]
        apart = [values for values in near if _is_apart(residuals, found, values)]
        if apart:
            others = "another set of values fits" if len(apart) == 1 else f"{len(apart)} other sets of values fit"
            shown = ", ".join(f"{p.name} {apart[0][p.name]:.4g}" for p in found.moved)
            yield f"there is more than one minimum: {others} about as well ({shown})"


def _of_interval(parameter: FreeParameter, fitted: FittedParameter) -> Iterator[str]:
    place, low, high = (parameter.inner(value) for value in (fitted.value, fitted.low, fitted.high))
    if math.isfinite(parameter.width) and min(place - low, high - place) <= ON_A_BOUND * parameter.width:
        end = fitted.low if place - low < high - place else fitted.high
        yield f"{parameter.name} ended on its bound {end:g}: the optimum may lie beyond it"
    elif fitted.ci95 is not None and None in fitted.ci95 and fitted.ci95 != (None, None):
        yield f"the interval of {parameter.name} reaches a bound before it ends: the data do not determine it"
    if fitted.ci95 == (None, None):
        yield f"the interval of {parameter.name} reaches from bound to bound: the data do not determine it"
    if parameter.prior is not None and fitted.ci95 is not None:
        ends = [
            parameter.inner(bound if end is None else end)
            for end, bound in zip(fitted.ci95, (fitted.low, fitted.high), strict=True)
        ]
        before = 2.0 * 1.96 * parameter.prior[1]
        if ends[1] - ends[0] > 0.95 * before:
            yield f"the interval of {parameter.name} is no narrower than its prior: the data add nothing to it"
        yield from _of_prior(parameter, fitted)


def _of_prior(parameter: FreeParameter, fitted: FittedParameter) -> Iterator[str]:
    """Say where the data pull a parameter out of its prior: the pull over its own standard deviation."""
    if parameter.prior is None or fitted.stderr is None:
        return
    mean, sigma = parameter.prior
    error = fitted.stderr / (fitted.value if parameter.scale == "log" else 1.0)
    room = sigma**2 - error**2
    pull = (parameter.inner(fitted.value) - mean) / math.sqrt(room) if room > 0.0 else 0.0
    if abs(pull) > OUTLYING:
        yield (
            f"the data contradict the prior of {parameter.name}: they pull it {abs(pull):.1f} standard deviations away "
            f"from {parameter.outer(mean):.4g}"
        )


def is_blind(residuals: LevelResiduals, found: Fit, parameter: FreeParameter) -> bool:
    """Whether all of the bounds, the other values staying, change next to nothing."""
    column = np.abs(found.jacobian[: found.n_data, found.moved.index(parameter)])
    reach = parameter.width if math.isfinite(parameter.width) else 10.0 * max(1.0, abs(found.values[parameter.name]))
    if float(column.max(initial=0.0)) * reach > UNSEEN:
        return False
    here = residuals(found.values)
    inner = {p.name: p.inner(found.values[p.name]) for p in found.moved}
    ends = [end for end in (parameter.inner(parameter.low), parameter.inner(parameter.high)) if math.isfinite(end)]
    changes = [float(np.abs(residuals(found.at({**inner, parameter.name: end})) - here).max()) for end in ends]
    return max(changes, default=0.0) <= UNSEEN


def _is_apart(residuals: LevelResiduals, found: Fit, values: dict[str, float]) -> bool:
    """Whether chi square rises between the optimum and other values; along a flat valley it does not."""
    objective = Objective(residuals, found.parameters, found.loss)
    first = {p.name: p.inner(found.values[p.name]) for p in found.moved}
    second = {p.name: p.inner(values[p.name]) for p in found.moved}
    higher = max(found.chi_square, objective.cost(values))
    for part in np.linspace(0.1, 0.9, 9):
        between = {name: (1.0 - part) * first[name] + part * second[name] for name in first}
        if objective.cost(found.at(between)) > higher + BARRIER:
            return True
    return False


def doubts_of_data(
    levels: Sequence[FittedLevel], left_out: Sequence[LeftOut], residuals: LevelResiduals, found: Fit
) -> Iterator[str]:
    """Yield what is doubtful in the data, and in how the model meets them."""
    from scipy.stats import chi2

    squares = float((residuals(found.values) ** 2).sum())  # plain ones: a robust loss hides what it leaves

    conditions = {(level.datum.campaign, level.datum.condition.name): level.datum for level in levels}
    first_state = levels[0].datum.condition
    if all(same_state(first_state, datum.condition) for datum in conditions.values()):
        yield "all data are of one condition: what depends on speed cannot be told from what does not"
    for first, second in itertools.combinations(conditions.values(), 2):
        if first.campaign == second.campaign and same_state(first.condition, second.condition):
            yield (
                f"conditions {first.condition.name} and {second.condition.name} are the same to the model, in speed "
                "and torque: they tell no more than one of them measured twice"
            )
    if found.n_free >= 1 and chi2.sf(squares, found.n_free) < UNREACHED:
        errors = [level.error_db for level in levels]
        rms = math.sqrt(sum(error**2 for error in errors) / len(errors))
        worst = max(levels, key=lambda level: abs(level.error_db))
        yield (
            f"the model does not reach the data: the misfit is {rms:.1f} dB rms where "
            f"{math.sqrt(sum(level.sigma_db**2 for level in levels) / len(levels)):.1f} dB are expected, at worst "
            f"{worst.error_db:+.1f} dB in condition {worst.datum.condition.name}"
        )
    for left in left_out:
        if left.error_db is not None and left.sigma_db and abs(left.error_db) > OUTLYING * left.sigma_db:
            yield (
                f"condition {left.condition} is outlying: from the others the model is {left.error_db:+.1f} dB off "
                f"there, {abs(left.error_db) / left.sigma_db:.1f} standard deviations"
            )


def doubts_of_fleet(fleet: Fleet) -> Iterator[str]:
    """Yield what the fleet's own choices make doubtful."""
    if fleet.model.gear_path.value == "sum":
        yield 'gear counted twice: gear_path = "sum" adds the bearing forces\' sound to a level that already holds it'
    if fleet.masuda.placement.value == "inside" and fleet.radiation.method.value == "point_sources":
        yield (
            "Masuda's source is inside the housing: nothing of it reaches a receiver, so its constant cannot be found"
        )
    elif fleet.masuda.placement.value == "inside":
        yield (
            "Masuda's source is inside the housing: a constant that is fitted there makes up for the insertion loss, "
            "which the level of a gear unit already holds"
        )


def doubts_of_scatter(scatter: FittedScatter | None) -> Iterator[str]:
    """Yield what a fitted scatter of the model cannot hold."""
    if scatter is None:
        return
    if scatter.sigma_db >= LARGEST_DB:
        yield f"the model's scatter ended on its largest value, {LARGEST_DB:g} dB: the misfit has no end"
    elif scatter.freedom < FEW:
        yield (
            f"the model's scatter of {scatter.sigma_db:.2g} dB is taken from a misfit with {scatter.freedom} degrees "
            "of freedom: an error of the model that the parameters can absorb is not in it, and not in the intervals"
        )


def doubts_of_levels(data: Sequence[MeasuredLevel], earlier: Fleet | None) -> Iterator[str]:
    """Yield where levels count twice: in two campaigns, or in the calibration that the priors come from."""
    prints = [fingerprint(datum) for datum in data]
    twice = len(prints) - len(set(prints))
    if twice:
        yield f"{twice} of {len(prints)} levels stand twice: they count as independent, and are not"
    known = set() if earlier is None else set(dict(earlier.meta).get(LEVELS_OF_CALIBRATION, "").split(", ")) - {""}
    again = sum(held in known for held in set(prints))
    if again:
        yield (
            f"{again} of {len(prints)} levels are those that the earlier fleet was calibrated to: with its priors they "
            "count twice"
        )


def doubts_of_posterior(posterior: Posterior | None) -> Iterator[str]:
    """Yield whether the sampling of the posterior was long enough."""
    if posterior is not None and not posterior.has_converged:
        worst = max(posterior.parameters, key=lambda p: p.autocorrelation)
        times = posterior.steps / worst.autocorrelation
        yield (
            f"the posterior has not converged: {posterior.steps} steps are {times:.0f} autocorrelation times of "
            f"{worst.key}, R-hat is {max(p.r_hat for p in posterior.parameters):.3f}; take more steps"
        )


def doubts_of_failures(failures: Sequence[str]) -> Iterator[str]:
    """Yield whether the model could not be computed somewhere within the bounds."""
    if failures:
        places = f"{len(failures)} place{'s' if len(failures) > 1 else ''}"
        yield (
            f"at {places} of the search the model could not be computed, and intervals end before them; the first: "
            f"{failures[0]}"
        )


def doubts_of_transfer(transferred: Sequence[Transferred]) -> Iterator[str]:
    """Yield where an earlier calibration and the new data contradict each other."""
    for held in transferred:
        apart = held.difference
        if apart is not None and abs(apart) > OUTLYING:
            yield (
                f"{held.key} is {held.alone:.4g} by these data alone and {held.earlier:.4g} by the earlier "
                f"calibration: {abs(apart):.1f} standard deviations apart"
            )
