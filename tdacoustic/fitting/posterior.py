"""The posterior of fitted parameters, sampled by an ensemble of walkers (emcee)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FittingError, MissingPackageError
from tdacoustic.fitting.loss import Objective, Residuals
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.settings import PosteriorSettings

__all__ = ["Posterior", "SampledParameter", "sample_posterior"]

Real = NDArray[np.float64]

ENOUGH: Final = 50.0
"""Steps over the autocorrelation time from which emcee's authors trust it."""

ALIKE: Final = 1.05
"""Scatter between halves of the walkers' ways over that within them (split R-hat) up to which they agree."""

_BURNT: Final = 0.25


@dataclass(frozen=True)
class SampledParameter:
    """A parameter in the posterior, in its own unit.

    Parameters
    ----------
    key : str
    median : float
    ci68, ci95 : (float, float)
        Between quantiles.
    autocorrelation : float
        Steps after which a walker has forgotten where it was.
    effective_samples : float
    r_hat : float
        1 where all parts of the chains tell the same.
    """

    key: str
    median: float
    ci68: tuple[float, float]
    ci95: tuple[float, float]
    autocorrelation: float
    effective_samples: float
    r_hat: float


@dataclass(frozen=True)
class Posterior:
    """A sampled posterior.

    Parameters
    ----------
    parameters : tuple of SampledParameter
    walkers, steps : int
        Kept steps.
    acceptance : float
        Part of the proposed steps that were taken.
    samples : ndarray, shape (parameters, samples)
        A thinned part, in the parameters' own units.
    """

    parameters: tuple[SampledParameter, ...]
    walkers: int
    steps: int
    acceptance: float
    samples: Real

    @property
    def has_converged(self) -> bool:
        """Whether every parameter was sampled long enough and alike."""
        return all(self.steps >= ENOUGH * p.autocorrelation and p.r_hat <= ALIKE for p in self.parameters)


def sample_posterior(residuals: Residuals, found: Fit, settings: PosteriorSettings) -> Posterior:
    """Sample the posterior around a fit: even within the bounds, times the priors, on the scale of the fit.

    Walkers move along differences of others (ter Braak, Stat. Comput. 16 (2006) 239), which in narrow valleys forgets
    four times as fast as the stretch of emcee's default.

    Parameters
    ----------
    residuals : callable
        Those of the fit.
    found : Fit
    settings : PosteriorSettings

    Raises
    ------
    MissingPackageError
        emcee is not installed.
    FittingError
        A parameter without bounds and prior: its posterior need not exist.
    """
    try:
        import emcee
    except ImportError:
        raise MissingPackageError(
            'a posterior needs the package emcee, which is not installed: pip install "tdacoustic[posterior]"'
        ) from None
    moved = found.moved
    if not moved:
        raise FittingError("a posterior needs a parameter that the fit moves")
    for parameter in moved:
        if parameter.prior is None and not math.isfinite(parameter.width):
            raise FittingError(f"{parameter.name} needs bounds or a prior for a posterior")
    objective = Objective(residuals, found.parameters, found.loss)
    lows = np.array([p.inner(p.low) for p in moved])
    highs = np.array([p.inner(p.high) for p in moved])

    def log_probability(place: Real) -> float:
        if (place < lows).any() or (place > highs).any():
            return -math.inf
        values = found.at({p.name: float(inner) for p, inner in zip(moved, place, strict=True)})
        return -0.5 * objective.cost(values)

    random = np.random.default_rng(settings.seed)
    start = _start(found, lows, highs, max(settings.walkers, 2 * len(moved) + 2), random)
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    sampler: Any = emcee.EnsembleSampler(start.shape[0], len(moved), log_probability, moves=moves)
    sampler.random_state = np.random.RandomState(settings.seed).get_state()
    sampler.run_mcmc(start, settings.steps)
    burnt = int(_BURNT * settings.steps)
    chain = np.asarray(sampler.get_chain(discard=burnt))  # steps, walkers, parameters
    times = np.asarray(emcee.autocorr.integrated_time(chain, tol=0, quiet=True), dtype=np.float64)
    parameters = tuple(_sampled(p, chain[:, :, i], float(times[i])) for i, p in enumerate(moved))
    thin = max(1, chain.shape[0] * chain.shape[1] // 4000)
    flat = chain.reshape(-1, len(moved))[::thin]
    samples = np.array([[p.outer(float(v)) for v in flat[:, i]] for i, p in enumerate(moved)])
    acceptance = float(np.mean(sampler.acceptance_fraction))
    return Posterior(parameters, start.shape[0], chain.shape[0], acceptance, samples)


def _start(found: Fit, lows: Real, highs: Real, n_walkers: int, random: np.random.Generator) -> Real:
    """Walkers in a ball around the optimum, of its standard errors where these are known."""
    best = np.array([p.inner(found.values[p.name]) for p in found.moved])
    errors = found.inner_errors() or {}
    width = np.where(np.isfinite(highs - lows), highs - lows, 1.0)
    size = np.array([min(errors.get(p.name, math.inf), 0.05 * w) for p, w in zip(found.moved, width, strict=True)])
    start = best + size * random.standard_normal((n_walkers, best.size))
    inner = 1e-6 * width
    return np.asarray(np.clip(start, lows + inner, highs - inner) + inner * random.uniform(-0.5, 0.5, start.shape))


def _sampled(parameter: Any, chain: Real, autocorrelation: float) -> SampledParameter:
    places = np.quantile(chain, [0.5, 0.16, 0.84, 0.025, 0.975])
    median, low68, high68, low95, high95 = (parameter.outer(float(place)) for place in places)
    time = autocorrelation if math.isfinite(autocorrelation) and autocorrelation > 0.0 else float(chain.shape[0])
    return SampledParameter(
        parameter.name, median, (low68, high68), (low95, high95), time, chain.size / time, _split_r_hat(chain)
    )


def _split_r_hat(chain: Real) -> float:
    """Gelman and Rubin's ratio over the halves of each walker's way; 1 where nothing moves at all."""
    half = chain.shape[0] // 2
    parts = np.concatenate([chain[:half], chain[half : 2 * half]], axis=1)
    within = float(parts.var(axis=0, ddof=1).mean())
    between = float(parts.mean(axis=0).var(ddof=1))
    return math.sqrt((half - 1) / half + between / within) if within > 0.0 else 1.0
