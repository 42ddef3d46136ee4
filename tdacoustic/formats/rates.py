"""Sampling rates as files state them: a hair off a round number, or in words with a mark that says two things."""

from __future__ import annotations

import re

__all__ = ["SNAP_TOLERANCE", "number_in", "snap_rate", "thousands_doubt"]

SNAP_TOLERANCE = 1e-5
"""Relative distance to a whole number of hertz below which a rate is taken to be that number."""

GROUPED = re.compile(
    r"(?<![\w.,'’])[+-]?[1-9]\d{0,2}(?:[.,'’\u00a0\u202f]\d{3})+(?:[.,]\d+)?"
    r"(?![\d.,'’]|[eE][+-]?\d)(?!\s*\[?[kMmuµμ][a-zA-Z])"
)
"""A number whose digits may stand in groups of three; not where a unit of thousands or thousandths follows it."""


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


def number_in(text: str) -> float | None:
    """The number that a text is, be it with ``Hz`` behind it, with a decimal comma, or written several times.

    Of a rate, ask `thousands_doubt` first.

    Examples
    --------
    >>> number_in("65536"), number_in("1200,5 Hz"), number_in("8192 8192"), number_in("8192 4096"), number_in("fast")
    (65536.0, 1200.5, 8192.0, None, None)
    """
    numbers = set()
    for word in text.strip().removesuffix("Hz").split():
        try:
            numbers.add(float(word.replace(",", ".")))
        except ValueError:
            return None
    return numbers.pop() if len(numbers) == 1 else None


def thousands_doubt(text: str) -> str | None:
    """Say why no sampling rate or interval can be taken from a text: a mark in it may be of thousands or of decimals.

    That is so before exactly three digits, where one to three stand before it that do not begin with zero: a program
    that writes ``51,200`` may mean 51.2 or 51200. With an exponent or a unit such as kHz nobody writes thousands.

    Returns
    -------
    str or None
        A sentence without its full stop.

    Examples
    --------
    >>> thousands_doubt("51,200 Hz")
    "the mark in '51,200' may be of thousands or of decimals: no sampling rate is taken from it..."
    >>> [thousands_doubt(text) for text in ("51200,0", "51,2", "0.125", "8192.000", "5.120E+04", "51.200 kHz")]
    [None, None, None, None, None, None]
    """
    match = GROUPED.search(text)
    if match is None:
        return None
    return (
        f"the mark in {match[0]!r} may be of thousands or of decimals: no sampling rate is taken from it, state "
        "sample_rate_hz in the campaign"
    )
