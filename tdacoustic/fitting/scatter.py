"""The model's own scatter, taken from the misfit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import FittingError
from tdacoustic.fitting.least_squares import fit
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.residuals import StateResiduals

__all__ = ["FittedScatter", "fitted_scatter"]

LARGEST_DB: Final = 60.0
_CLOSE_DB: Final = 1e-2


@dataclass(frozen=True)
class FittedScatter:
    """The model's scatter with the degrees of freedom that it was taken from.

    Parameters
    ----------
    sigma_db : float
    freedom : int
        Speeds, torques and parts of the sound less parameters without a prior.
    """

    sigma_db: float
    freedom: int


def fitted_scatter(model: LevelModel, free: Sequence[FreeParameter], starts: int) -> FittedScatter:
    """Return the model's scatter at which the misfit is what scatter alone would leave.

    That is where the chi square of the mean level of each state equals the degrees of freedom (Mandel and Paule,
    J. Res. NBS 87 (1982) 377); zero where the misfit is smaller without any. Plain squares, whatever the fit's loss.

    Parameters
    ----------
    model : LevelModel
    free : sequence of FreeParameter
    starts : int

    Raises
    ------
    FittingError
        There are no more states than parameters, and nothing is left to take it from.
    """
    from scipy.optimize import brentq

    first = fit(StateResiduals(model, 1.0), free, starts, polish=False)
    if first.n_free < 1:
        n_parameters = first.n_data - first.n_free
        raise FittingError(
            f"{first.n_data} conditions and {n_parameters} parameters leave nothing to take model_sigma_db from"
        )
    place = [parameter.starting_at(first.values[parameter.name]) for parameter in free]

    def excess(sigma_db: float) -> float:
        found = fit(StateResiduals(model, sigma_db), place, polish=False)
        return found.chi_square - found.n_free

    if excess(0.0) <= 0.0:
        return FittedScatter(0.0, first.n_free)
    if excess(LARGEST_DB) > 0.0:
        return FittedScatter(LARGEST_DB, first.n_free)
    return FittedScatter(float(brentq(excess, 0.0, LARGEST_DB, xtol=_CLOSE_DB)), first.n_free)
