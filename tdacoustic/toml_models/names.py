"""What a channel, a run or a condition may be called."""

from __future__ import annotations

import unicodedata
from collections.abc import Container
from typing import Annotated, Any, Final

from pydantic import BeforeValidator

__all__ = ["MAX_NAME_LENGTH", "Name", "legal_name", "name_problem", "unique_name"]

MAX_NAME_LENGTH: Final = 64
"""Characters a name may have."""

_PUNCTUATION: Final = " _.#/()-"


def _is_letter_or_digit(character: str) -> bool:
    return unicodedata.category(character)[0] == "L" or character.isdecimal()


def _is_allowed(character: str) -> bool:
    # vowel signs of Indic and other scripts are marks (M), and part of the word
    return (
        _is_letter_or_digit(character) or character in _PUNCTUATION or unicodedata.category(character) in ("Mn", "Mc")
    )


def name_problem(text: str) -> str | None:
    """Say what keeps a text from being a name, or return None where nothing does.

    A name has letters of any script, digits, space and ``_.#/()-``, begins with a
    letter or digit, and has at most 64 characters.

    Examples
    --------
    >>> name_problem("Motor Ölwanne #2") is None
    True
    >>> name_problem("a:b")
    "has ':'; allowed are letters, digits, space and _.#/()-"
    """
    if not text:
        return "is empty"
    if len(text) > MAX_NAME_LENGTH:
        return f"has {len(text)} characters, allowed are {MAX_NAME_LENGTH}"
    if not _is_letter_or_digit(text[0]):
        return f"begins with {text[0]!r}, allowed is a letter or digit"
    for character in text:
        if not _is_allowed(character):
            return f"has {character!r}; allowed are letters, digits, space and {_PUNCTUATION.strip()}"
    return None


def legal_name(text: str, fallback: str) -> str:
    """Return the text with what a name may not have replaced by ``_``; `fallback` where nothing is left.

    Examples
    --------
    >>> legal_name("[1] Mic: left", "ch1")
    '1_ Mic_ left'
    """
    text = "".join(c if _is_allowed(c) else "_" for c in unicodedata.normalize("NFC", text))
    while text and not _is_letter_or_digit(text[0]):
        text = text[1:]
    text = text[:MAX_NAME_LENGTH].rstrip(" _")
    return text or fallback


def unique_name(text: str, taken: Container[str]) -> str:
    """Return the name, with ``_2``, ``_3``, ... appended where it is taken.

    Examples
    --------
    >>> unique_name("mic", {"mic", "mic_2"})
    'mic_3'
    """
    name, k = text, 1
    while name in taken:
        k += 1
        suffix = f"_{k}"
        name = text[: MAX_NAME_LENGTH - len(suffix)] + suffix
    return name


def _checked(value: Any) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        value = str(value)  # condition = 1 is the condition "1"
    if not isinstance(value, str):
        raise ValueError(f"must be text in quotes (a whole number also counts), got {value!r}")
    text = unicodedata.normalize("NFC", value)
    problem = name_problem(text)
    if problem:
        raise ValueError(f"{value!r} {problem}")
    return text


Name = Annotated[str, BeforeValidator(_checked)]
"""A name; a whole number is taken as its digits, so that ``condition = 1`` is the condition ``"1"``."""
