"""Where the search of a fit starts."""

from __future__ import annotations

import math
from typing import Final

from tdacoustic.fitting.loss import Objective
from tdacoustic.fitting.parameters import FreeParameter, lmfit_parameters, values_of

__all__ = ["REFINED", "best_starts", "spread_starts"]

REFINED: Final = 4
"""Starts from which the search goes on."""


def spread_starts(parameters: tuple[FreeParameter, ...], n_starts: int, seed: int) -> list[dict[str, float]]:
    """Starts on the scale of the fit: the initial values, then a low-discrepancy spread over finite bounds."""
    initial = {parameter.name: parameter.inner(parameter.initial) for parameter in parameters}
    bounded = [p for p in parameters if p.is_moved and math.isfinite(p.inner(p.low)) and math.isfinite(p.inner(p.high))]
    if n_starts <= 1 or not bounded:
        return [initial]
    from scipy.stats import qmc

    spread = qmc.Halton(len(bounded), seed=seed).random(n_starts - 1)
    found = [initial]
    for row in spread:
        place = {
            p.name: p.inner(p.low) + float(part) * (p.inner(p.high) - p.inner(p.low))
            for p, part in zip(bounded, row, strict=True)
        }
        found.append({**initial, **place})
    return found


def best_starts(
    objective: Objective, parameters: tuple[FreeParameter, ...], starts: list[dict[str, float]]
) -> list[dict[str, float]]:
    """Return the initial values and the best of the other starts, those first that are better than all around them."""
    if len(starts) <= REFINED:
        return starts
    first, *others = starts

    def misfit(start: dict[str, float]) -> float:
        return objective.cost(values_of(parameters, lmfit_parameters(parameters, start)))

    ranked = sorted(others, key=misfit)
    kept = [first, *(start for start in ranked if _is_lowest_around(parameters, start, ranked))][:REFINED]
    return [*kept, *[start for start in ranked if start not in kept][: REFINED - len(kept)]]


def _is_lowest_around(
    parameters: tuple[FreeParameter, ...], start: dict[str, float], ranked: list[dict[str, float]]
) -> bool:
    """Whether a start is better than its nearest neighbours, two a parameter; `ranked` has the better ones first."""
    bounded = [p for p in parameters if p.is_moved and math.isfinite(p.width)]

    def distance(other: dict[str, float]) -> float:
        return max((abs(start[p.name] - other[p.name]) / p.width for p in bounded), default=0.0)

    nearest = sorted((other for other in ranked if other is not start), key=distance)[: 2 * len(bounded)]
    better = ranked[: next(index for index, other in enumerate(ranked) if other is start)]
    return not any(other is near for near in nearest for other in better)
