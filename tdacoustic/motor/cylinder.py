"""Sound radiation of an infinitely long cylinder whose surface moves radially in a wave around it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import MotorError

__all__ = ["HIGHEST_ORDER", "relative_intensity"]

HIGHEST_ORDER = 60
"""Spatial orders beyond it are refused: nothing of them is heard, and Hankel functions leave the range of numbers."""


def relative_intensity(order: int, size: ArrayLike) -> NDArray[np.float64]:
    """Return I_c, the radiated power over that of a piston of the same surface and velocity (paper, equation (9)).

    I_c(r, x) = 2 / (π x |H_r^(1)'(x)|²) with x = k R, which Jordan's, Timar's and Gieras's forms equal by the
    Wronskian. It goes to 1 for x >> r, to πx/2 for r = 0 and x << 1, and to 4π (x/2)^(2r+1)/(r!)² for r >= 1 and
    x << 1. Neither of the two terms of the derivative cancels the other at any x, so none of its digits are lost.

    Parameters
    ----------
    order : int
        Spatial order r, 0 to `HIGHEST_ORDER`.
    size : array_like
        x = k R, above zero.

    Raises
    ------
    MotorError
        An order or a size out of range.

    Examples
    --------
    >>> round(float(relative_intensity(0, 1000.0)), 6)
    1.0
    >>> round(float(relative_intensity(0, 1e-3) / (math.pi * 1e-3 / 2)), 4)
    1.0
    """
    from scipy.special import hankel1

    x = np.asarray(size, dtype=np.float64)
    if not 0 <= order <= HIGHEST_ORDER:
        raise MotorError(f"spatial order must be from 0 to {HIGHEST_ORDER}, got {order!r}")
    if not (np.isfinite(x).all() and (x > 0.0).all()):
        raise MotorError("k R must be above 0")
    with np.errstate(over="ignore", invalid="ignore"):
        slope = -hankel1(1, x) if order == 0 else 0.5 * (hankel1(order - 1, x) - hankel1(order + 1, x))
        found = 2.0 / (math.pi * x * np.abs(slope) ** 2)
    return np.asarray(np.where(np.isfinite(found), found, 0.0))
