"""The colours of the report, once for both renderers and for the page itself.

A colour is asked for by its role (``"ink"``, ``"series-0"``), never by its value, so that
the light and the dark page, the interactive figure and the printed one stay in step.
The eight series colours keep apart under the common colour-vision deficiencies when
neighbours differ, and every one has a contrast of at least 3:1 against its paper.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final, Literal

__all__ = ["DARK", "LIGHT", "SERIES_SLOTS", "Scheme", "colour", "css_variables"]

Scheme = Literal["light", "dark", "css"]

SERIES_SLOTS: Final = 8
"""Number of series colours; slot 7 is the neutral grey."""

LIGHT: Final = MappingProxyType(
    {
        "paper": "#ffffff",
        "ink": "#1b1f24",
        "muted": "#5b6570",
        "axis": "#7d8791",
        "grid": "#e4e7eb",
        "label": "rgba(255,255,255,0.82)",
        "rule": "#6b7580",
        "series-0": "#1d5fa6",
        "series-1": "#cc4e14",
        "series-2": "#16835a",
        "series-3": "#7a4aa5",
        "series-4": "#a87400",
        "series-5": "#1590a8",
        "series-6": "#b52e6c",
        "series-7": "#6a7480",
    }
)
"""Colours on white paper; matplotlib always uses these."""

DARK: Final = MappingProxyType(
    {
        "paper": "#15181c",
        "ink": "#e4e7ea",
        "muted": "#a2abb5",
        "axis": "#7a848f",
        "grid": "#2c3238",
        "label": "rgba(21,24,28,0.80)",
        "rule": "#98a2ad",
        "series-0": "#6aa9ea",
        "series-1": "#f08a52",
        "series-2": "#4dbf8f",
        "series-3": "#b58de0",
        "series-4": "#dcae3c",
        "series-5": "#4fc4da",
        "series-6": "#ea77a8",
        "series-7": "#9aa4af",
    }
)
"""Colours on dark paper, with the same roles."""


def colour(role: str, scheme: Scheme = "light") -> str:
    """Return the colour of a role, as a CSS colour or (``scheme="css"``) as a CSS variable.

    Raises
    ------
    KeyError
        The role is not one of `LIGHT`.

    Examples
    --------
    >>> colour("series-0"), colour("series-0", "css")
    ('#1d5fa6', 'var(--series-0)')
    """
    if role not in LIGHT:
        raise KeyError(f"colour role {role!r} is not one of {', '.join(LIGHT)}")
    if scheme == "css":
        return f"var(--{role})"
    return (DARK if scheme == "dark" else LIGHT)[role]


def css_variables(scheme: Literal["light", "dark"]) -> str:
    """Return the declarations of all roles as CSS variables (``--ink: #1b1f24; ...``)."""
    return " ".join(f"--{role}: {value};" for role, value in (DARK if scheme == "dark" else LIGHT).items())
