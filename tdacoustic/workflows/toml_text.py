"""Texts as TOML has them."""

from __future__ import annotations

from typing import Final

from tdacoustic.errors import CampaignError

__all__ = ["toml_string"]

_ESCAPES: Final = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t", "\b": "\\b", "\f": "\\f"}


def toml_string(text: str) -> str:
    r"""Return a text as a TOML basic string, on one line.

    Raises
    ------
    CampaignError
        The text has half a surrogate pair, as a file name that is no valid Unicode.

    Examples
    --------
    >>> print(toml_string('Mic "A"\n'))
    "Mic \"A\"\n"
    """
    if any(0xD800 <= ord(character) <= 0xDFFF for character in text):
        raise CampaignError(f"{text!r} is no valid Unicode and cannot be written to a campaign; rename it")
    escaped = (
        _ESCAPES.get(c) or (f"\\u{ord(c):04X}" if ord(c) < 0x20 or 0x7F <= ord(c) <= 0x9F or c in "\u2028\u2029" else c)
        for c in text
    )
    return f'"{"".join(escaped)}"'
