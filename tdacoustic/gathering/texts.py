"""Texts and numbers from other people's files, checked."""

from __future__ import annotations

import json
import math
import re
from typing import Any, Final

from tdacoustic.errors import GatheringError

__all__ = ["FORBIDDEN", "LARGEST", "LONGEST", "checked_text", "number_or_none", "parsed_json", "shown_text"]

LONGEST: Final = 10_000
"""Characters of a text in a table."""

LARGEST: Final = 1e15
"""Largest number in a table: a hundred thousand times the stiffest bearing; sums and powers of it stay finite."""

FORBIDDEN: Final = r"[\x00-\x1f\x7f-\x9f\x{2028}-\x{202e}\x{2066}-\x{2069}]"
"""What no text of a result has, in the grammar of RE2: controls, line ends, overrides of the direction of writing."""

_PYTHON_FORBIDDEN: Final = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def checked_text(value: Any, what: str, longest: int = LONGEST) -> str:
    """Return a text on one line.

    Raises
    ------
    GatheringError
        It is no text, too long, or has a sign that steers a terminal or turns the direction of writing.
    """
    if not isinstance(value, str):
        raise GatheringError(f"{what} is no text")
    if len(value) > longest:
        raise GatheringError(f"{what} has {len(value)} characters, allowed are {longest}")
    text = re.sub(r"[\t\r\n]+", " ", value).strip()
    if _PYTHON_FORBIDDEN.search(text):
        raise GatheringError(f"{what} has a control character")
    return text


def shown_text(value: str, longest: int = 1000) -> str:
    r"""Return a text that was only ever meant to be read: on one line, cut, U+FFFD for what steers a terminal.

    Examples
    --------
    >>> shown_text("a\tb\x1b[0m")
    'a b\ufffd[0m'
    """
    cut = value if len(value) <= longest else value[: longest - 3] + "..."
    return _PYTHON_FORBIDDEN.sub("\ufffd", re.sub(r"[\t\r\n]+", " ", cut)).strip()


def number_or_none(value: Any, what: str) -> float | None:
    """Return a finite number of at most 1e15, or None of none.

    Raises
    ------
    GatheringError
        It is neither.
    """
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise GatheringError(f"{what} is no number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise GatheringError(f"{what} is not finite")
    if abs(number) > LARGEST:
        raise GatheringError(f"{what} is {number:.3g}, which nothing measured is")
    return number


def parsed_json(data: bytes, what: str) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    Raises
    ------
    GatheringError
        It is no JSON in UTF-8, holds NaN, is nested too deeply, or is no object.
    """

    def refuse(word: str) -> None:
        raise ValueError(f"{word} is no JSON")

    try:
        held = json.loads(data.decode("utf-8"), parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise GatheringError(f"{what} is no valid JSON ({str(error)[:80]})") from error
    if not isinstance(held, dict):
        raise GatheringError(f"{what} is no object")
    return held
