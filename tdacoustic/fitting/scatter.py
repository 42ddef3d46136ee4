"""The model's own scatter, taken from the misfit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.errors import FittingError
from tdacoustic.fitting.least_squares import fit
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.loss import Loss
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.residuals import LevelResiduals

__all__ = ["fitted_model_sigma_db"]

_LARGEST_DB: Final = 60.0
_CLOSE_DB: Final = 1e-2


def fitted_model_sigma_db(model: LevelModel, free: Sequence[FreeParameter], starts: int, loss: Loss) -> float:
    """Return the model's scatter at which the misfit is what scatter alone would leave.

    That is where the chi square equals the degrees of freedom (Mandel and Paule, J. Res. NBS 87 (1982) 377); zero where
    the misfit is smaller without any.

    Parameters
    ----------
    model : LevelModel
    free : sequence of FreeParameter
    starts : int
    loss : str

    Raises
    ------
    FittingError
        There are no more levels than parameters, and nothing is left to take it from.
    """
    from scipy.optimize import brentq

    first = fit(LevelResiduals(model, 1.0), free, starts, loss, polish=False)
    if first.n_free < 1:
        n_parameters = first.n_data - first.n_free
        raise FittingError(
            f"{first.n_data} levels and {n_parameters} parameters leave nothing to take model_sigma_db from"
        )
    place = [parameter.starting_at(first.values[parameter.name]) for parameter in free]

    def excess(sigma_db: float) -> float:
        found = fit(LevelResiduals(model, sigma_db), place, 1, loss, polish=False)
        return found.chi_square - found.n_free

    if excess(0.0) <= 0.0:
        return 0.0
    if excess(_LARGEST_DB) > 0.0:
        return _LARGEST_DB
    return float(brentq(excess, 0.0, _LARGEST_DB, xtol=_CLOSE_DB))
