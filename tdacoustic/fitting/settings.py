"""How a calibration is done."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tdacoustic.errors import FittingError
from tdacoustic.fitting.loss import Loss

__all__ = ["MODEL_SIGMA_DB", "FitSettings", "PosteriorSettings"]

MODEL_SIGMA_DB = 4.0
"""Scatter of the rapid model, one standard deviation (physics.md section 6)."""


@dataclass(frozen=True)
class PosteriorSettings:
    """How a posterior is sampled.

    Parameters
    ----------
    walkers, steps : int
        Of the ensemble; the first part of the steps is left out.
    seed : int
    """

    walkers: int = 32
    steps: int = 2000
    seed: int = 0

    def __post_init__(self) -> None:
        if self.walkers < 4 or self.steps < 50:
            raise FittingError(
                f"a posterior needs at least 4 walkers and 50 steps, got {self.walkers} and {self.steps}"
            )


@dataclass(frozen=True)
class FitSettings:
    """How a calibration is done.

    Parameters
    ----------
    model_sigma_db : float or None
        Scatter of the model itself, one standard deviation, which the levels of a condition share; None where it is to
        be taken from the misfit.
    loss : str
        ``"linear"``, or one of scipy's robust losses: ``"soft_l1"``, ``"huber"``, ``"cauchy"``, ``"arctan"``.
    starts : int
        Of the search, spread over the bounds.
    posterior : PosteriorSettings, optional
        Default: no posterior is sampled.
    """

    model_sigma_db: float | None = MODEL_SIGMA_DB
    loss: Loss = "linear"
    starts: int = 16
    posterior: PosteriorSettings | None = None

    def __post_init__(self) -> None:
        sigma = self.model_sigma_db
        if sigma is not None and not (math.isfinite(sigma) and sigma >= 0.0):
            raise FittingError(f"model_sigma_db must be >= 0 dB, got {sigma!r}")
        if self.starts < 1:
            raise FittingError(f"a fit needs at least one start, got {self.starts}")
