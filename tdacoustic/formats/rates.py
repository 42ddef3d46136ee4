"""Sampling rates a hair off a round number because the format rounds them."""

from __future__ import annotations

__all__ = ["SNAP_TOLERANCE", "snap_rate"]

SNAP_TOLERANCE = 1e-5
"""Relative distance to a whole number of hertz below which a rate is taken to be that number."""


def snap_rate(rate_hz: float, resolution: float = 0.0) -> tuple[float, float | None]:
    """Return the rate to use, and the rate as stored where it was snapped.

    Parameters
    ----------
    rate_hz : float
        As the file gives it.
    resolution : float
        Relative rounding of the stored number (half a unit of its last digit)
        where that is coarser than `SNAP_TOLERANCE`.

    Examples
    --------
    >>> snap_rate(1 / 1.95312e-05, resolution=3e-6)
    (51200.0, 51200.131072335...)
    >>> snap_rate(8192.5)
    (8192.5, None)
    """
    whole = float(round(rate_hz))
    if rate_hz == whole or whole <= 0.0:
        return rate_hz, None
    if abs(rate_hz - whole) <= max(SNAP_TOLERANCE, resolution) * rate_hz:
        return whole, rate_hz
    return rate_hz, None
