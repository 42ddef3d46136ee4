"""Correction of a level for background noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

__all__ = ["Correction", "correct_for_background"]

APPLIED_FROM_DB = 6.0
MARGINAL_FROM_DB = 3.0


@dataclass(frozen=True)
class Correction:
    """A level after correction, and what was done.

    Parameters
    ----------
    level_db : float
    kind : str
        ``none`` (no background known), ``applied``, ``marginal`` (subtracted,
        but the background is so near that the result is uncertain), or
        ``impossible`` (left as measured: an upper bound).
    """

    level_db: float
    kind: Literal["none", "applied", "marginal", "impossible"]


def correct_for_background(level_db: float, background_db: float | None) -> Correction:
    """Subtract the background's energy from a level.

    At least 6 dB of distance: applied (the range of ISO 3744 for grade 2);
    from 3 dB: marginal (ISO 3746, survey grade); less: impossible, the level
    stays as it is.

    Examples
    --------
    >>> round(correct_for_background(80.0, 70.0).level_db, 2)
    79.54
    >>> correct_for_background(80.0, 79.0).kind
    'impossible'
    """
    if background_db is None:
        return Correction(level_db, "none")
    distance = level_db - background_db
    if not distance >= MARGINAL_FROM_DB:
        return Correction(level_db, "impossible")
    corrected = level_db + 10.0 * math.log10(1.0 - 10.0 ** (-0.1 * distance))
    return Correction(corrected, "applied" if distance >= APPLIED_FROM_DB else "marginal")
