"""Integers without a unit: fractions of a full scale that the file does not state."""

from __future__ import annotations

import math

__all__ = ["LOGICAL", "full_scale_of"]

LOGICAL = "logical values: 0 and 1"
"""Flag of a channel of true and false, such as a tacho's pulses: numbers without unit or full scale."""


def full_scale_of(low: float, high: float) -> tuple[float, tuple[str, ...]]:
    """Return the number that means full scale, and what is doubtful about it.

    Parameters
    ----------
    low, high : float
        Smallest and largest number of the stored type.

    Returns
    -------
    float
        Half of the type's range.
    tuple of str
        Of unsigned integers of more than one bit, whose zero may lie at 0 or, in offset binary, in the middle of the
        range.

    Examples
    --------
    >>> full_scale_of(-32768, 32767)
    (32768.0, ())
    >>> full_scale_of(0, 65535)[0]
    32768.0
    >>> full_scale_of(0, 1)
    (1.0, ())
    """
    bits = round(math.log2(high - low + 1.0))
    full_scale = 2.0 ** (bits - 1)
    if low < 0.0 or bits == 1:
        return full_scale, ()
    return full_scale, (
        f"unsigned integers of {bits} bits without a unit: whether 0 or {full_scale:g} stands for zero (offset binary) "
        f"is not known, {full_scale:g} is taken for full scale",
    )
