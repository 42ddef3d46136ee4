"""Sets of values that the data allow: the inside and the edge of a likelihood region.

The range of a number over the region where chi square has risen by the square of the quantile is its profile-likelihood
interval, as `tdacoustic.fitting.intervals` has it of a parameter. It asks for no distribution between bounds: a level
that the data hold from above alone has an open end, not one that moves with a bound.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FittingError
from tdacoustic.fitting.least_squares import fit
from tdacoustic.fitting.loss import Objective, Residuals
from tdacoustic.fitting.optimum import Fit

__all__ = ["LikelihoodRegion", "likelihood_region"]

Real = NDArray[np.float64]
Rise = Callable[[Real], float]

RAYS: Final = (0, 2, 48, 160)
"""Directions in which the edge is sought, by the number of parameters; the last one for all more."""

RADII: Final = (0.15, 0.4, 0.7, 0.9, 1.0, 1.2, 1.6, 2.5, 4.0, 7.0, 12.0, 20.0)
"""Steps outward, over the distance of the edge if chi square were a parabola: a bent region is longer."""

HALVINGS: Final = 10
SCATTERED: Final = 300
"""Steps to an edge that was passed, and places around the optimum that are tried besides the rays."""

ON_THE_WAY: Final = (0.5, 0.98)
RAYS_THERE: Final = (0, 2, 12, 24)
"""Parts of the way to the end of a parameter's interval where the others are fitted again, and rays from there."""


@dataclass(frozen=True)
class LikelihoodRegion:
    """Places in a likelihood region, the optimum first.

    Parameters
    ----------
    keys : tuple of str
        Of the moved parameters.
    inner : ndarray, shape (places, parameters)
        On the scale of the fit.
    risen : ndarray, shape (places,)
        Chi square over that of the optimum, from 0 to `rise`.
    rise : float
    """

    keys: tuple[str, ...]
    inner: Real
    risen: Real
    rise: float


def likelihood_region(
    residuals: Residuals,
    found: Fit,
    rise: float,
    ends: Mapping[str, tuple[float, float]] | None = None,
    most: int = 2000,
    seed: int = 0,
) -> LikelihoodRegion:
    """Return places in the region around an optimum, and around others that fit as well, where chi square is lower.

    The edge is sought along rays; at a bound a ray goes on along it. A region may be bent away from them: so there are
    rays too from the ends of the parameters' intervals, where the others are fitted again, and a spread of places.

    Parameters
    ----------
    residuals : callable
        Those of the fit.
    found : Fit
    rise : float
        Of chi square, above 0.
    ends : mapping of str to (float, float), optional
        Of the parameters' intervals for that rise, in their own units; a bound where it comes first.
    most : int
        How often the residuals may be computed, about.
    seed : int

    Raises
    ------
    FittingError
        A parameter that neither the data nor bounds hold.
    """
    moved = found.moved
    keys = tuple(parameter.name for parameter in moved)
    if not moved:
        return LikelihoodRegion((), np.zeros((1, 0)), np.zeros(1), rise)
    _check_held(found)
    objective = Objective(residuals, found.parameters, found.loss)
    lows, highs = (np.array([p.inner(end) for p, end in zip(moved, ends, strict=True)]) for ends in _ends(found))

    def cost(place: Real) -> float:
        return objective.cost(found.at(dict(zip(keys, place.tolist(), strict=True))))

    others = [values for chi, values in found.minima if chi < found.chi_square + rise]
    on_the_way = _on_the_way(residuals, found, ends or {})
    places = [np.array([p.inner(v[p.name]) for p in moved]) for v in (found.values, *others, *on_the_way)]
    lowest = cost(places[0])

    def risen(place: Real) -> float:
        return max(cost(place) - lowest, 0.0)

    random = np.random.default_rng(seed)
    root = _root(found, highs - lows)
    known: list[tuple[Real, float]] = [(place, risen(place)) for place in places]
    size = min(len(moved), len(RAYS) - 1)
    for number, centre in enumerate(places):
        whole = RAYS if number <= len(others) else RAYS_THERE
        n_rays = min(whole[size], max(2, most * whole[size] // (2 * len(RADII) * RAYS[size] * (1 + len(others)))))
        if known[number][1] > rise:
            continue
        for direction in _directions(len(moved), n_rays, random):
            known += _along(risen, centre, math.sqrt(rise) * (root @ direction), (lows, highs), rise)
    n_more = min(SCATTERED, most // 4)
    for step in random.standard_normal((n_more, len(moved))) / np.sqrt(random.chisquare(3.0, (n_more, 1)) / 3.0):
        place = np.clip(places[0] + root @ step, lows, highs)
        known.append((place, risen(place)))
    inside = [(place, up) for place, up in known if up <= rise]
    return LikelihoodRegion(keys, np.array([p for p, _ in inside]), np.array([up for _, up in inside]), rise)


def _on_the_way(residuals: Residuals, found: Fit, ends: Mapping[str, tuple[float, float]]) -> list[dict[str, float]]:
    """Values with one parameter held on the way to an end of its interval, and the others fitted again."""
    made = []
    for parameter in found.moved:
        best = parameter.inner(found.values[parameter.name])
        for end, part in itertools.product(ends.get(parameter.name, ()), ON_THE_WAY):
            held = parameter.outer(best + part * (parameter.inner(end) - best))
            if parameter.inner(end) == best or not math.isfinite(held):
                continue
            others = [
                p.fixed_at(held) if p.name == parameter.name else p.starting_at(found.values[p.name])
                for p in found.parameters
            ]
            if np.isfinite(residuals({**found.values, parameter.name: held})).all():
                made.append(fit(residuals, others, loss=found.loss, polish=False).values)
    return made


def _along(risen: Rise, centre: Real, step: Real, bounds: tuple[Real, Real], rise: float) -> list[tuple[Real, float]]:
    """Places along a ray, and every edge between them."""
    found: list[tuple[Real, float]] = []
    inside, last = True, 0.0
    before = centre
    for radius in RADII:
        place = np.clip(centre + radius * step, *bounds)
        if np.array_equal(place, before):
            break  # a corner of the bounds, or a ray that leads out of them
        up = risen(place)
        found.append((place, up))
        if (up <= rise) != inside:
            found += _edge(risen, centre, step, bounds, rise, (last, radius) if inside else (radius, last))
            inside = not inside
        if up > 25.0 * rise:
            break
        last, before = radius, place
    return found


def _edge(
    risen: Rise, centre: Real, step: Real, bounds: tuple[Real, Real], rise: float, between: tuple[float, float]
) -> list[tuple[Real, float]]:
    """Places ever closer to the edge between a radius inside and one outside."""
    inside, outside = between
    found = []
    for _ in range(HALVINGS):
        radius = 0.5 * (inside + outside)
        place = np.clip(centre + radius * step, *bounds)
        up = risen(place)
        if up <= rise:
            found, inside = [(place, up)], radius
        else:
            outside = radius
    return found


def _ends(found: Fit) -> tuple[list[float], list[float]]:
    return [p.low for p in found.moved], [p.high for p in found.moved]


def _check_held(found: Fit) -> None:
    known = found.inner_errors() or {}
    free = [p.name for p in found.moved if p.name not in known and not math.isfinite(p.width)]
    if free:
        raise FittingError(f"neither the data nor bounds hold {', '.join(free)}")


def _root(found: Fit, width: Real) -> Real:
    """Root of the covariance, with what the bounds leave (an even spread) of directions that the data do not see."""
    bounded = np.isfinite(width)
    of_bounds = np.where(bounded, math.sqrt(12.0) / np.where(bounded, width, 1.0), 0.0)
    values, directions = np.linalg.eigh(found.jacobian.T @ found.jacobian + np.diag(of_bounds**2))
    return np.asarray(directions / np.sqrt(np.maximum(values, 1e-300)))


def _directions(size: int, count: int, random: np.random.Generator) -> Real:
    """Directions of length one, shape (count, size)."""
    if size == 1:
        return np.array([[1.0], [-1.0]])
    if size == 2:
        turns = 2.0 * math.pi * np.arange(count) / count
        return np.stack([np.cos(turns), np.sin(turns)], axis=1)
    half = random.standard_normal(((count + 1) // 2, size))
    both = np.concatenate([half, -half])
    return np.asarray(both / np.linalg.norm(both, axis=1, keepdims=True))
