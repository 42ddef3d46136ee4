"""The language of a report: English as it stands in the code, or another one from a file of translations.

Each text that a reader sees is said by `say`, with names in braces for what is filled in. All of them are gathered in
``languages/report.pot``; a translation of that file, ``de.po``, is another language. What has no translation there
stays English. Numbers, units and names of data (channels, orders, columns of files) are the same in every language.
"""

from __future__ import annotations

import gettext
import io
import string
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import TemplateError
from tdacoustic.toml_models import small_file

if TYPE_CHECKING:
    from babel.messages import Message

__all__ = ["ENGLISH", "Language", "mark", "read_language", "say", "say_count", "speaking", "spoken"]


@dataclass(frozen=True)
class Language:
    """Translations of the texts of a report.

    Parameters
    ----------
    code : str
        As pages name it, ``"de"``.
    texts : mapping of str to str
        English text to its translation.
    counted : mapping of (str, str) to tuple of str
        English texts for one and for many to the translations by form.
    form : callable
        Form of a count.
    """

    code: str = "en"
    texts: Mapping[str, str] = field(default_factory=dict)
    counted: Mapping[tuple[str, str], tuple[str, ...]] = field(default_factory=dict)
    form: Callable[[int], int] = lambda count: int(count != 1)


ENGLISH: Final = Language()

_SPOKEN: ContextVar[Language] = ContextVar("language of the report", default=ENGLISH)


def spoken() -> Language:
    """Return the language that is spoken now."""
    return _SPOKEN.get()


@contextmanager
def speaking(language: Language) -> Iterator[None]:
    """Make and write reports in a language.

    Parameters
    ----------
    language : Language
    """
    before = _SPOKEN.set(language)
    try:
        yield
    finally:
        _SPOKEN.reset(before)


def mark(text: str) -> str:
    """Return a text as it is, marked as one that `say` is given later: for those that stand outside of functions."""
    return text


def say(text: str, /, **values: object) -> str:
    """Return a text in the language that is spoken.

    Parameters
    ----------
    text : str
        English, written out where it is said, or marked by `mark`; ``{name}`` is filled in where values are given.
    **values
        What is filled in, formatted as `str.format` does. Braces in them stay as they are.

    Examples
    --------
    >>> say("Level at {distance:g} m", distance=4.0)
    'Level at 4 m'
    """
    said = _SPOKEN.get().texts.get(text, text)
    return said.format(**values) if values else said


def say_count(one: str, many: str, count: int, /, **values: object) -> str:
    """Return a text that depends on a number, in the language that is spoken.

    Parameters
    ----------
    one, many : str
        English, for 1 and for all other numbers; ``{count}`` is the number.
    count : int
    **values
        What else is filled in.

    Examples
    --------
    >>> say_count("{count} line", "{count} lines", 3)
    '3 lines'
    """
    language = _SPOKEN.get()
    forms = language.counted.get((one, many))
    said = (one if count == 1 else many) if forms is None else forms[language.form(count)]
    return said.format(count=count, **values)


def read_language(path: Path) -> Language:
    """Read the translations of a language.

    Parameters
    ----------
    path : Path
        A file of gettext, ``de.po``, made from ``languages/report.pot``.

    Returns
    -------
    Language

    Raises
    ------
    MissingFileError
        There is no such file.
    TemplateError
        It is no such file, names no language, or a translation fills in other values than its English text.
    """
    from babel.messages.pofile import PoFileError, read_po

    content = small_file(path, TemplateError)
    try:
        catalogue = read_po(io.BytesIO(content), abort_invalid=True)
        form = gettext.c2py(catalogue.plural_expr)
        code = catalogue.locale_identifier
    except (PoFileError, ValueError, LookupError, TypeError) as error:
        raise TemplateError(f"{path}: no file of translations that can be read: {error}") from None
    if not code:
        raise TemplateError(f'{path}: names no language ("Language: de\\n" in the head)')
    texts: dict[str, str] = {}
    counted: dict[tuple[str, str], tuple[str, ...]] = {}
    for message in catalogue:
        if not message.id or message.fuzzy:
            continue
        if isinstance(message.id, str):
            if isinstance(message.string, str) and message.string:
                _check_fields(path, message, message.id, message.string)
                texts[message.id] = message.string
            continue
        one, many = message.id
        forms = tuple(message.string) if isinstance(message.string, (tuple, list)) else ()
        if len(forms) == catalogue.num_plurals and all(forms):
            for text in forms:
                _check_fields(path, message, many, text, {"count"})
            counted[one, many] = forms
    return Language(code.replace("_", "-"), texts, counted, form)


def _check_fields(path: Path, message: Message, english: str, text: str, optional: Set[str] = frozenset()) -> None:
    """Raise where a translation fills in what its English text does not have, or otherwise formatted."""
    known = _fields(english)
    if not known:  # it is not filled in, so braces are braces
        return
    try:
        wrong = sorted((_fields(text) ^ known) - optional)
    except ValueError:
        wrong = ["unpaired braces"]
    if wrong:
        raise TemplateError(
            f"{path}: line {message.lineno}: the translation of {english[:60]!r} differs from it in {', '.join(wrong)}"
        )


def _fields(text: str) -> set[str]:
    """Names that are filled in, each with how it is formatted."""
    parts = string.Formatter().parse(text)
    return {
        name + (f"!{conversion}" if conversion else "") + (f":{spec}" if spec else "")
        for _, name, spec, conversion in parts
        if name is not None
    }
