"""Which component radiates a line: whose sensors show it, over their own local floors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tdacoustic.attribution.evidence import View

__all__ = ["MARGIN_DB", "SHOWN_DB", "component_prominence_db", "radiator_of", "strongest_view"]

Array = NDArray[np.float64]

SHOWN_DB = 4.0
"""Prominence from which a sensor is said to show a line."""
MARGIN_DB = 6.0
"""Distance in prominence from which the weaker of two components is taken for cross-talk of the stronger."""


def strongest_view(views: Sequence[View], component: str) -> View | None:
    """Return the view of a component's sensor that shows the line best."""
    held = [view for view in views if view.component == component]
    return max(held, key=lambda view: view.prominence_db, default=None)


def component_prominence_db(views: Sequence[View]) -> dict[str, float]:
    """Return each component's prominence: that of its best sensor, in dB; minus infinity where nothing stands out."""
    found: dict[str, float] = {}
    for view in views:
        found[view.component] = max(found.get(view.component, -math.inf), view.prominence_db)
    return found


def radiator_of(prominence_db: Mapping[str, float], shown_db: float = SHOWN_DB, margin_db: float = MARGIN_DB) -> str:
    """Return the radiator: a component, ``both`` or ``neither``.

    A component shows a line from `shown_db` over its floor on. Where several do,
    the strongest is the radiator if it leads by `margin_db`; the others' share
    then passes for cross-talk.

    Parameters
    ----------
    prominence_db : mapping of str to float
        By component, from `component_prominence_db`.
    """
    shown = sorted((level for level in prominence_db.values() if level >= shown_db), reverse=True)
    if not shown:
        return "neither"
    if len(shown) > 1 and shown[0] - shown[1] < margin_db:
        return "both"
    return max(prominence_db, key=lambda component: prominence_db[component])
