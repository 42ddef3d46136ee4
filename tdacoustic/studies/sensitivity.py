"""How levels hang on single numbers of a fleet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.studies.cases import QUANTITIES, Case
from tdacoustic.studies.responses import STEP_DB, STEP_RELATIVE, Responses
from tdacoustic.studies.variations import LeftOut, Variation

__all__ = ["PATHS", "Sensitivity", "change_for", "per_words", "sensitivity_of"]

Real = NDArray[np.float64]

PATHS: Final = ("structure", "mesh", "motor", "total")
"""Whose levels are looked at."""

_MORE: Final = 0.1
"""Changes are told for so much more of a number."""


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """By how much levels change with single numbers of a fleet.

    Parameters
    ----------
    cases : tuple of Case
    varied : tuple of Variation
    change_db : ndarray, shape (varied, cases, paths)
        Of the level on the surface, by `PATHS`, for 10 % more of a number or for 1 dB more of a level, from its
        derivative by central differences; NaN where a path has no sound.
    left_out : tuple of LeftOut
    rattling : tuple of Case
        Cases of which nothing can be told when the gears' parameters move: the harmonic balance finds no stable motion
        there, and integrations in time would take seconds each.
    """

    cases: tuple[Case, ...]
    varied: tuple[Variation, ...]
    change_db: Real
    left_out: tuple[LeftOut, ...]
    rattling: tuple[Case, ...] = ()

    def of_total(self, over: str) -> Real:
        """Return the changes of the total, shape (varied, cases over conditions or helix angles)."""
        held = [place for place, case in enumerate(self.cases) if case.over == over]
        return np.asarray(self.change_db[:, held, PATHS.index("total")])

    def strongest(self, over: str) -> Real:
        """Return the change of the total that is largest in size over some cases, signed, shape (varied,)."""
        changes = np.nan_to_num(self.of_total(over))
        if not changes.shape[1]:
            return np.zeros(len(self.varied))
        place = np.abs(changes).argmax(axis=1)
        return np.asarray(np.take_along_axis(changes, place[:, None], axis=1)[:, 0])

    def ranking(self) -> tuple[int, ...]:
        """Return the numbers of the assumed parameters, those with the largest changes of the total first."""
        sizes = np.maximum(*(np.abs(self.strongest(over)) for over in ("conditions", "helix")))
        held = [place for place, variation in enumerate(self.varied) if variation.is_assumed]
        return tuple(sorted((place for place in held if sizes[place] > 0.0), key=lambda place: -sizes[place]))


def per_words(kind: str) -> str:
    """Return for how much more of a number changes are told.

    Examples
    --------
    >>> per_words("relative"), per_words("level")
    ('+10 %', '+1 dB')
    """
    return "+1 dB" if kind == "level" else f"+{100.0 * _MORE:g} %"


def change_for(kind: str, below: ArrayLike, here: ArrayLike, above: ArrayLike) -> Real:
    """Return the change for 10 % or 1 dB more from values a step below, at, and a step above a number.

    Where one side has no value the other is held against the value here.

    Parameters
    ----------
    kind : {"relative", "level"}
    below, here, above : array_like, of one shape

    Returns
    -------
    ndarray
    """
    low, mid, high = (np.asarray(values, dtype=np.float64) for values in (below, here, above))
    steps = np.isfinite(low).astype(float) + np.isfinite(high).astype(float)
    rise = np.where(np.isfinite(high), high, mid) - np.where(np.isfinite(low), low, mid)
    with np.errstate(invalid="ignore", divide="ignore"):
        per_step = np.where(steps > 0.0, rise / steps, np.nan)
    return np.asarray(per_step * (1.0 / STEP_DB if kind == "level" else _MORE / STEP_RELATIVE))


def sensitivity_of(responses: Responses) -> Sensitivity:
    """Return the sensitivities of the levels on the surface.

    Parameters
    ----------
    responses : Responses
    """
    columns = [QUANTITIES.index("spl_4m_db" if path == "total" else f"{path}_spl_4m_db") for path in PATHS]
    found = np.full((len(responses.varied), len(responses.cases), len(PATHS)), np.nan)
    for number, variation in enumerate(responses.varied):
        below, above = responses.values[number, :2][:, :, columns]
        found[number] = change_for(variation.kind, below, responses.base[:, columns], above)
    dte = QUANTITIES.index("dte_pp_um")
    lost = np.isnan(responses.values[:, :2, :, dte]) & np.isfinite(responses.base[:, dte])
    alone = lost & ~lost.all(axis=2, keepdims=True)  # a number that cannot move loses every case
    gone = np.atleast_1d(alone.any(axis=(0, 1)))
    rattling = tuple(case for case, lost_once in zip(responses.cases, gone, strict=True) if lost_once)
    return Sensitivity(responses.cases, responses.varied, found, responses.left_out, rattling)
