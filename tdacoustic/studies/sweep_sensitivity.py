"""Which of a study's parameters decide the level, over the whole of their ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.studies.design_sweeps import SweepResult
from tdacoustic.studies.designs import coordinates, seed_of
from tdacoustic.studies.indices import Estimate, Regression, regression_of, variance_indices

__all__ = ["LevelInStudy", "SweepSensitivity", "energy_mean_db", "sweep_sensitivity_of"]

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LevelInStudy:
    """How one level varies over a study, and what makes it vary.

    Parameters
    ----------
    condition : str or None
        None of the energy mean over the conditions.
    level_db : ndarray, shape (points,)
        NaN of points that are left out.
    n_rattling : int
        Points left out as the gears rattle.
    n_silent : int
        Points left out as there is no sound.
    regression : Regression or None
        Of the level on the parameters, each from 0 at the lower end of its range to 1. None of too few points, or of a
        level that does not vary.
    first_order, total : Estimate or None
        Sobol' indices, of Saltelli's design.
    """

    condition: str | None
    level_db: Real
    n_rattling: int
    n_silent: int
    regression: Regression | None
    first_order: Estimate | None
    total: Estimate | None

    @property
    def n_used(self) -> int:
        """Points that have the level."""
        return int(np.isfinite(self.level_db).sum())

    @property
    def weights(self) -> Estimate | None:
        """What parameters are ranked by: total indices, else standardised regression coefficients."""
        if self.total is not None:
            return self.total
        return None if self.regression is None else self.regression.standardised


@dataclass(frozen=True, eq=False)
class SweepSensitivity:
    """What a study over ranges says of the level on the surface.

    Parameters
    ----------
    found : SweepResult
    n_refused : int
        Points that cannot be.
    levels : tuple of LevelInStudy
        Of each condition, then, of several, of their energy mean.
    """

    found: SweepResult
    n_refused: int
    levels: tuple[LevelInStudy, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Of the parameters."""
        return self.found.sweep.keys

    @property
    def overall(self) -> LevelInStudy | None:
        """The energy mean over the conditions, or the only condition; None without a condition."""
        return self.levels[-1] if self.levels else None

    def ranking(self) -> tuple[int, ...]:
        """Return the numbers of the parameters, the one that decides the overall level most first."""
        weights = None if self.overall is None else self.overall.weights
        if weights is None:
            return tuple(range(len(self.keys)))
        return tuple(np.argsort(-np.abs(np.nan_to_num(weights.value)), kind="stable").tolist())


def sweep_sensitivity_of(found: SweepResult) -> SweepSensitivity | None:
    """Return what a sweep over ranges says of the level; None of a grid, whose values were chosen one by one.

    Regressions take the points of a hypercube, or the rows A and B of Saltelli's design. A base point of the latter
    counts where all of its rows have the level.

    Parameters
    ----------
    found : SweepResult
    """
    if found.sweep.sampling == "grid":
        return None
    levels_db, rattles = found.of("spl_4m_db"), found.rattles
    names: list[str | None] = list(found.conditions)
    columns: list[tuple[Real, NDArray[np.bool_]]]
    columns = [(levels_db[:, place], rattles[:, place]) for place in range(len(names))]
    if len(names) > 1:
        names.append(None)
        columns.append((energy_mean_db(levels_db), np.asarray(rattles.any(axis=1))))
    can_be = found.can_be
    unit = coordinates(found.sweep, found.points)
    levels = []
    for name, (level_db, rattling) in zip(names, columns, strict=True):
        silent = can_be & ~rattling & ~np.isfinite(level_db)
        levels.append(
            LevelInStudy(name, level_db, int(rattling.sum()), int(silent.sum()), *_found(found, unit, level_db))
        )
    return SweepSensitivity(found, int((~can_be).sum()), tuple(levels))


def energy_mean_db(levels_db: Real) -> Real:
    """Return the energy mean over the conditions, shape (points,); NaN where one of them has no level.

    Parameters
    ----------
    levels_db : ndarray, shape (points, conditions)
    """
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(np.mean(10.0 ** (0.1 * levels_db), axis=-1)))


def _found(
    found: SweepResult, unit: Real, level_db: Real
) -> tuple[Regression | None, Estimate | None, Estimate | None]:
    seed = seed_of(found.sweep)
    if found.sweep.sampling == "latin_hypercube":
        there = np.isfinite(level_db)
        return regression_of(unit[there], level_db[there], seed), None, None
    rows = len(found.sweep.keys) + 2
    of_base = level_db.reshape(-1, rows)
    whole = of_base[np.isfinite(of_base).all(axis=1)]
    indices = variance_indices(whole[:, 0], whole[:, 1], whole[:, 2:].T, seed)
    if indices is None:
        return None, None, None
    plain = np.isfinite(of_base[:, :2])
    regression = regression_of(unit.reshape(-1, rows, rows - 2)[:, :2][plain], of_base[:, :2][plain], seed)
    return regression, *indices
