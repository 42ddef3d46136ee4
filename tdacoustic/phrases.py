"""Texts of results that a report may say in another language: English, and what they were made of.

A `Phrase` is a string as any other: tables, files and the terminal have it in English. A report says it with its
values filled into the translation (`tdacoustic.reporting.language.say`). Through the store of steps, or joined to
others by anything but `phrases_joined`, it becomes a plain string, which stays English.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

__all__ = ["Phrase", "phrase", "phrase_count", "phrases_joined"]


class Phrase(str):
    """An English text that knows what it was made of.

    Parameters
    ----------
    text : str
        With ``{name}`` for what is filled in; a text without values stands as it is, braces too.
    values : mapping of str to object, optional
        What is filled in; those that are `Phrase` are said in the other language too.
    many : str, optional
        The text for numbers other than 1; ``values["count"]`` is the number.

    Examples
    --------
    >>> Phrase("mesh stiffness: {doubt}", {"doubt": Phrase("too soft")})
    'mesh stiffness: too soft'
    """

    text: str
    many: str | None
    values: Mapping[str, object]

    def __new__(cls, text: str, values: Mapping[str, object] | None = None, many: str | None = None) -> Phrase:
        """Fill the values in."""
        held = dict(values or {})
        shown = text if many is None or held["count"] == 1 else many
        made = super().__new__(cls, shown.format(**held) if held else shown)
        made.text, made.many, made.values = text, many, held
        return made

    def __getnewargs__(self) -> tuple[str, Mapping[str, object], str | None]:  # type: ignore[override]
        """What copies and pickles are made of."""
        return self.text, self.values, self.many


def phrase(text: str, /, **values: object) -> Phrase:
    """Return a text of a result, as `tdacoustic.reporting.language.say` does one of a report.

    Parameters
    ----------
    text : str
        English, written out here; ``{name}`` is filled in.
    **values
        What is filled in, formatted as `str.format` does.

    Examples
    --------
    >>> phrase("{angle:g}° is above the 30° of ISO 6336-1", angle=31.0)
    '31° is above the 30° of ISO 6336-1'
    """
    return Phrase(text, values)


def phrase_count(one: str, many: str, count: int, /, **values: object) -> Phrase:
    """Return a text of a result that depends on a number.

    Parameters
    ----------
    one, many : str
        English, for 1 and for all other numbers; ``{count}`` is the number.
    count : int
    **values
        What else is filled in.

    Examples
    --------
    >>> phrase_count("condition {names}", "conditions {names}", 2, names="1, 2")
    'conditions 1, 2'
    """
    return Phrase(one, {"count": count, **values}, many)


def phrases_joined(separator: str, parts: Iterable[str]) -> Phrase:
    """Return texts joined by signs that are the same in every language.

    Examples
    --------
    >>> phrases_joined("; ", ["louder {sic}", phrase("{rate:g} dB", rate=2.0)])
    'louder {sic}; 2 dB'
    """
    values = {f"part_{number}": part for number, part in enumerate(parts)}
    return Phrase(separator.join(f"{{{name}}}" for name in values), values)
