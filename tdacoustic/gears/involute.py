"""The involute function and its inverse."""

from __future__ import annotations

import math

__all__ = ["angle_of_involute", "involute"]

_STEPS = 50


def involute(angle_rad: float) -> float:
    """Return inv α = tan α - α.

    Examples
    --------
    >>> round(involute(math.radians(20.0)), 8)
    0.01490438
    """
    return math.tan(angle_rad) - angle_rad


def angle_of_involute(value: float) -> float:
    """Return the angle in rad whose involute is `value`, from 0 to below 90°.

    Parameters
    ----------
    value : float
        Zero or above.

    Raises
    ------
    ValueError
        A negative value: no angle has it.

    Examples
    --------
    >>> round(math.degrees(angle_of_involute(involute(math.radians(20.0)))), 9)
    20.0
    """
    if not value >= 0.0:
        raise ValueError(f"an involute must be >= 0, got {value!r}")
    if value == 0.0:
        return 0.0
    # In u = tan α: u - atan u is convex, its slope u²/(1 + u²); Newton from above descends to the root.
    tangent = (3.0 * value) ** (1.0 / 3.0) + value
    for _ in range(_STEPS):
        step = (tangent - math.atan(tangent) - value) * (1.0 + tangent**2) / tangent**2
        tangent -= step
        if abs(step) <= 1e-15 * tangent:
            break
    return math.atan(tangent)
