"""Tables as CSV text."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["csv_cell", "csv_rows", "csv_text"]

_FORMULA: Final = re.compile(r"(^|[;\r\n])(?=[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20])")
"""Where a spreadsheet begins a cell, before what it takes for a formula; half of the world's splits lines at ``;``."""

_SIGNED: Final = re.compile(r"[+-][0-9]+(\.[0-9]+)?( (dB|%))?")
"""A signed number, with a unit of ours or without one: no formula."""

_CONTROL: Final = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]+")


def csv_cell(text: str) -> str:
    """Make a text harmless that a spreadsheet would take for a formula; numbers stay numbers.

    A formula begins with ``= + - @``, also in their wide forms, with a tab or a line break. An apostrophe before it
    makes it a text; so it does behind a ``;``, at which spreadsheets of many countries split a line, quotes or not.

    Examples
    --------
    >>> csv_cell("=cmd()"), csv_cell("-3.2"), csv_cell("+10 %"), csv_cell("mic_1"), csv_cell("a;=cmd()")
    ("'=cmd()", '-3.2', '+10 %', 'mic_1', "a;'=cmd()")
    """
    if _FORMULA.search(text) is None or _SIGNED.fullmatch(text):
        return text
    try:
        float(text)
    except ValueError:
        return _FORMULA.sub(r"\1'", text)
    return text


def csv_text(frame: pd.DataFrame) -> str:
    """Return a table as CSV: one header row, LF, ``%.9g``, empty for what is not determined, true / false.

    Texts that a spreadsheet would run as formulas are made harmless by `csv_cell`; control characters and line breaks
    become a space.
    """
    import pandas as pd

    shown = frame.copy()
    for column in shown.columns:
        if pd.api.types.is_bool_dtype(shown[column]):
            shown[column] = shown[column].map({True: "true", False: "false"}, na_action="ignore")
        elif not pd.api.types.is_numeric_dtype(shown[column]):
            shown[column] = shown[column].map(_harmless, na_action="ignore")
    return shown.to_csv(index=False, lineterminator="\n", float_format="%.9g", na_rep="")


def csv_rows(columns: Sequence[str], rows: Iterable[Sequence[str | int | None]]) -> str:
    r"""Return rows as CSV by the rules of `csv_text`, without pandas.

    Examples
    --------
    >>> csv_rows(["name", "n"], [["a", 1], ["=b", None]])
    "name,n\na,1\n'=b,\n"
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_harmless(value) for value in row] for row in rows)
    return text.getvalue()


def _harmless(value: Any) -> Any:
    """One line of text: pandas leaves a lone CR unquoted, which would begin a row of its own."""
    if not isinstance(value, str):
        return value
    return csv_cell(_CONTROL.sub(" ", value).strip() if _CONTROL.search(value) else value)
