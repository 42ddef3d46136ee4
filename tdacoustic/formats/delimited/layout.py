"""How a text of numbers is laid out: delimiter, decimal mark, heading, columns."""

from __future__ import annotations

import contextlib
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tdacoustic.errors import FormatError, UnitError
from tdacoustic.formats.delimited.stream import decoded, encoding_of, open_text_bytes
from tdacoustic.units import parse_unit

__all__ = ["WHITESPACE", "Layout", "is_number", "read_layout", "split_row"]

WHITESPACE = " "
HEAD_BYTES = 1 << 20
SAMPLE_LINES = 50
SAMPLE_CELLS = 50_000
MAX_FIELDS = 10_000
MAX_METADATA = 100
CANDIDATES = tuple((delimiter, decimal) for delimiter in "\t;|, " for decimal in ".,")
"""Delimiter and decimal mark, the likelier first; both can be a comma where the numbers stand in quotes."""

NUMBER = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE)
NAME_WITH_UNIT = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\((.*)\)|\s[/|]\s*(\S+)|,\s*(\S+))\s*")


@dataclass(frozen=True)
class Layout:
    """How the rows of a text are to be read.

    Parameters
    ----------
    encoding, delimiter, decimal : str
        A delimiter that is one space stands for any whitespace.
    n_fields : int
        Fields of a row.
    offset, first_line : int
        Byte and (1-based) line of the first row.
    quoted : bool
        Fields may stand in double quotes.
    names, units : tuple
        Of each field; None where the heading does not say.
    numeric : tuple of bool
        Which fields hold numbers.
    first_cells : tuple of tuple of str
        Fields of the first rows.
    metadata : tuple of (str, str)
        The ``key: value`` lines above the heading.
    flags : tuple of str
    """

    encoding: str
    delimiter: str
    decimal: str
    n_fields: int
    offset: int
    first_line: int
    quoted: bool
    names: tuple[str | None, ...]
    units: tuple[str | None, ...]
    numeric: tuple[bool, ...]
    first_cells: tuple[tuple[str, ...], ...]
    metadata: tuple[tuple[str, str], ...]
    flags: tuple[str, ...] = ()


def split_row(line: str, delimiter: str) -> list[str]:
    """Split one line into its fields, stripped; quotes count where they are those of a table.

    Examples
    --------
    >>> split_row('1,5; 2,5', ";")
    ['1,5', '2,5']
    """
    if delimiter == WHITESPACE:
        return line.split()
    cells = line.split(delimiter)
    if '"' in line:
        with contextlib.suppress(csv.Error):  # a CR between the fields, or a cell of more than 130 kB
            cells = next(csv.reader([line], delimiter=delimiter), [])
    return [cell.strip() for cell in cells]


def is_number(cell: str, decimal: str = ".") -> bool:
    """Whether a field is a number (``nan`` and ``inf`` count).

    Examples
    --------
    >>> is_number("1,5"), is_number("1,5", ","), is_number("")
    (False, True, False)
    """
    if decimal == ",":
        if "." in cell:
            return False
        cell = cell.replace(",", ".")
    return NUMBER.fullmatch(cell) is not None


def read_layout(path: Path) -> Layout:
    """Find out how a text of numbers is laid out, from its first megabyte.

    Raises
    ------
    FormatError
        No row of numbers, or a heading that does not fit the rows.
    """
    with path.open("rb") as stream:
        encoding, mark = encoding_of(stream.read(HEAD_BYTES))
    mark = 0 if encoding.startswith("utf-16") else mark
    with open_text_bytes(path, encoding, mark) as stream:
        head = stream.read(HEAD_BYTES)
        whole = len(head) < HEAD_BYTES
    if b"\n" not in head:
        if b"\r" in head.strip():
            raise FormatError(f"{path}: the lines end in CR alone; they must end in LF or CR LF")
        if not whole:
            raise FormatError(f"{path}: the first line is longer than {HEAD_BYTES} bytes")
    raw_lines = head.split(b"\n")
    if not whole:
        raw_lines.pop()
    lines = [decoded(line, encoding).rstrip("\r") for line in raw_lines]
    _refuse_cr_among_quotes(path, lines)
    delimiter, decimal, n_fields, mask = _dialect(path, lines)
    first = _first_row(lines, delimiter, decimal, n_fields, mask)
    if first is None:
        raise FormatError(f"{path}: no row of numbers in it")
    rows = [split_row(line, delimiter) for line in lines[first : first + SAMPLE_LINES] if line.strip()]
    trailing = delimiter != WHITESPACE and n_fields > 1 and all(row[-1] == "" for row in rows if len(row) == n_fields)
    names, units, used, flags = _heading(path, lines[:first], delimiter, decimal, n_fields, trailing)
    if trailing and names[-1] is None:
        mask = (*mask[:-1], False)
    return Layout(
        encoding,
        delimiter,
        decimal,
        n_fields,
        mark + sum(len(line) + 1 for line in raw_lines[:first]),
        first + 1,
        any('"' in line for line in lines[first:]),
        tuple(names),
        tuple(units),
        mask,
        tuple(tuple(row) for row in rows if len(row) == n_fields),
        _metadata(lines[:used]),
        tuple(flags),
    )


def _refuse_cr_among_quotes(path: Path, lines: Sequence[str]) -> None:
    """Raise where a line with quotes has a CR outside them: whether a row ends there cannot be told."""
    for number, line in enumerate(lines, 1):
        if '"' in line and "\r" in re.sub('"[^"]*"', "", line):
            raise FormatError(f"{path}: line {number}: a CR between its fields, in a text whose lines end in LF")


def _sample(path: Path, lines: Sequence[str]) -> list[str]:
    """Last lines of the beginning, fewer of them where they have many fields."""
    sample = [line for line in lines if line.strip()][-SAMPLE_LINES:]
    marks = [max(line.count(mark) for mark in "\t;|,") for line in sample]
    words = [len(line.split(maxsplit=MAX_FIELDS)) for line in sample]
    most = max([*marks, *words], default=0)
    if most >= MAX_FIELDS:
        raise FormatError(f"{path}: more than {MAX_FIELDS} columns")
    return sample[-max(5, SAMPLE_CELLS // (most + 1)) :]


def _dialect(path: Path, lines: Sequence[str]) -> tuple[str, str, int, tuple[bool, ...]]:
    """Delimiter, decimal mark, number of fields, and which of them hold numbers."""
    sample = _sample(path, lines)
    best: tuple[tuple[float, ...], str, str, int, tuple[bool, ...]] | None = None
    for priority, (delimiter, decimal) in enumerate(CANDIDATES):
        if delimiter == decimal and not any('"' in line for line in sample):
            continue
        split = [split_row(line, delimiter) for line in sample]
        numbers = [[is_number(cell, decimal) for cell in row] for row in split]
        begin = next((index for index, row in enumerate(numbers) if any(row)), None)
        if begin is None:
            continue
        n_fields = Counter(len(row) for row in split[begin:]).most_common(1)[0][0]
        rows = [
            [number or cell == "" for number, cell in zip(flags, row, strict=True)]
            for flags, row in zip(numbers[begin:], split[begin:], strict=True)
            if len(row) == n_fields
        ]
        mask = tuple(sum(row[field] for row in rows) * 2 >= len(rows) for field in range(n_fields))
        share = sum(sum(row) for row in rows) / (len(rows) * n_fields)
        heading = any(mask) and _has_heading(lines, delimiter, decimal, n_fields, mask)
        score = (
            round(share, 1),
            round(len(rows) / len(split[begin:]), 1),
            float(heading),
            float(n_fields),
            share,
            -float(priority),
        )
        if n_fields == 1 and decimal == "," and not heading:
            continue  # "1,5" alone is two columns; one column only under a name that stands alone
        if any(mask) and (best is None or score > best[0]):
            best = (score, delimiter, decimal, n_fields, mask)
    if best is None:
        raise FormatError(f"{path}: no row of numbers in it" + (" (a heading alone)" if sample else ""))
    return best[1:]


def _has_heading(lines: Sequence[str], delimiter: str, decimal: str, n_fields: int, mask: Sequence[bool]) -> bool:
    """Whether the line above the first row has a name for each field."""
    first = _first_row(lines, delimiter, decimal, n_fields, mask)
    above = [line for line in lines[:first] if line.strip()]
    if not above or (n_fields == 1 and (above[-1].lstrip()[:1] in "#%/" or re.search(r"[:=,]", above[-1]))):
        return False
    return len(split_row(above[-1], delimiter)) == n_fields


def _first_row(lines: Sequence[str], delimiter: str, decimal: str, n_fields: int, mask: Sequence[bool]) -> int | None:
    """Index of the first line that is a row of numbers."""
    for index, line in enumerate(lines):
        cells = split_row(line, delimiter)
        if len(cells) != n_fields:
            continue
        chosen = [cell for cell, numeric in zip(cells, mask, strict=True) if numeric]
        if any(is_number(cell, decimal) for cell in chosen) and all(
            cell == "" or is_number(cell, decimal) for cell in chosen
        ):
            return index
    return None


def _heading(
    path: Path, above: Sequence[str], delimiter: str, decimal: str, n_fields: int, trailing: bool
) -> tuple[list[str | None], list[str | None], int, list[str]]:
    """Names and units of the fields, and how many lines stand above the heading."""
    nameless: tuple[list[str | None], list[str | None]] = ([None] * n_fields, [None] * n_fields)
    filled = [index for index, line in enumerate(above) if re.search(r"\w", line)]
    if not filled:
        return *nameless, 0, []
    last = _cells(above[filled[-1]], delimiter, n_fields, trailing)
    if last is None or any(is_number(cell, decimal) for cell in last if cell):
        _refuse_misfit(path, above, filled[-1], delimiter, decimal, n_fields, last)
        flags = ["the columns have no names"] if n_fields > 1 else []
        return *nameless, len(above), flags
    if len(filled) > 1 and _are_units(last):
        names = _cells(above[filled[-2]], delimiter, n_fields, trailing)
        if names is not None and not any(is_number(cell, decimal) for cell in names if cell):
            units = [cell.strip("[]() ") or None for cell in last]
            return [name or None for name in names], units, filled[-2], []
    if n_fields == 1 and re.match(r"[^:=]{1,60}[:=]\s*\S", last[0]):
        return *nameless, len(above), []
    pairs = [_name_and_unit(cell) for cell in last]
    return [name or None for name, _ in pairs], [unit for _, unit in pairs], filled[-1], []


def _cells(line: str, delimiter: str, n_fields: int, trailing: bool) -> list[str] | None:
    """Cells of a line of the heading if there is one for each field."""
    bare = re.sub(r"^\s*(?:#|%|//)+\s*", "", line)
    attempts = [split_row(bare, delimiter)]
    if delimiter == WHITESPACE:
        attempts += [
            [cell.strip() for cell in re.split(pattern, bare.strip())] for pattern in (r"\t+", r"\s{2,}", r"[,;]")
        ]
    for cells in attempts:
        if trailing and len(cells) == n_fields - 1:
            cells = [*cells, ""]
        if len(cells) == n_fields and any(cells):
            return [cell.strip("\"' ") for cell in cells]
    return [bare.strip("\"' ")] if n_fields == 1 and delimiter == WHITESPACE else None


def _refuse_misfit(
    path: Path,
    above: Sequence[str],
    index: int,
    delimiter: str,
    decimal: str,
    n_fields: int,
    cells: list[str] | None,
) -> None:
    """Raise where the line above the rows is a heading with too many or too few names."""
    found = split_row(above[index], delimiter)
    if cells is not None or delimiter == WHITESPACE or len(found) < 2 or above[index].lstrip()[:1] in "#%":
        return
    if len(found) == 2 and n_fields > 3:
        return
    if not any(is_number(cell, decimal) for cell in found) and not re.match(r"[^:=]{1,60}[:=]\s", above[index]):
        raise FormatError(f"{path}: line {index + 1} names {len(found)} columns, the rows have {n_fields} fields")


def _known_unit(text: str) -> bool:
    try:
        parse_unit(text)
    except UnitError:
        return False
    return True


def _are_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    known = [cell for cell in filled if re.fullmatch(r"\[.*\]|\(.*\)", cell) or _known_unit(cell) or cell in "-—"]
    return bool(filled) and 2 * len(known) >= len(filled)


def _name_and_unit(cell: str) -> tuple[str, str | None]:
    """Split ``Motor Z [m/s²]`` and the like; what is in brackets is a unit, what is in parentheses if it is known."""
    match = NAME_WITH_UNIT.fullmatch(cell)
    if match is None or not match[1]:
        return cell, None
    if match[2] is not None:
        return match[1], match[2].strip() or None
    unit = next(text for text in match.groups()[2:] if text is not None).strip()
    unit = unit[1:-1] if re.fullmatch(r"\(.*\)", unit) else unit
    return (match[1], unit) if _known_unit(unit) else (cell, None)


def _metadata(above: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return the ``key: value`` lines."""
    pairs: list[tuple[str, str]] = []
    for line in above:
        match = re.match(r"[\s#%/\"]*([^:=\t;,]{1,60}?)[\s\"]*[:=\t;,]\s*(\S.*)", line)
        if match is not None and len(pairs) < MAX_METADATA:
            pairs.append((match[1].strip(), match[2].strip(' \t;,"')[:200]))
    return tuple(pairs)
