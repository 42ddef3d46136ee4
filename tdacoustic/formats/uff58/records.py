"""The records of a universal file: where each data set 58 begins, and what its header says.

Layout after the *Universal Dataset Number 58* and *58b* pages of UC-SDRL
(the text is in ``pyuff.datasets.dataset_58.get_structure_58``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from tdacoustic.errors import FormatError

__all__ = [
    "Axis",
    "Header58",
    "Record",
    "find_terminator",
    "parse_header",
    "read_identifier",
    "read_units",
    "start_time_of",
]

MAX_LINE = 4096
LINE = 80
LENGTHS = (67, LINE)
"""Of a line of an axis: up to its last field, or filled with blanks."""
HEADER_LINES = 11
MAX_HEADER_LINES = 100
WINDOW = 1 << 20
TERMINATOR = re.compile(rb"(?m)^[ \t]*-1[ \t]*\r?(?=\n|\Z)")
ENGLISH_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
MONTHS = {name: number for number, name in enumerate(ENGLISH_MONTHS, 1)}
MONTHS |= {"mrz": 3, "mai": 5, "okt": 10, "dez": 12}


@dataclass(frozen=True)
class Record:
    """The identifier line of a record.

    Parameters
    ----------
    number : int
        Of the data set: 58, 151, ...
    binary : bool
    byte_order, float_format, header_lines, n_bytes : int
        Of a binary record.
    body : int
        Offset of what follows the identifier line.
    """

    number: int
    binary: bool
    byte_order: int
    float_format: int
    header_lines: int
    n_bytes: int
    body: int


@dataclass(frozen=True)
class Axis:
    """Specific data type, exponents of length, force and temperature, label and unit of an axis (records 8 to 11)."""

    data_type: int
    exponents: tuple[int, int, int]
    label: str | None
    unit: str | None


@dataclass(frozen=True)
class Header58:
    """What records 1 to 11 of a data set 58 say.

    Parameters
    ----------
    id_lines : tuple of str
    function_type : int
    entity : str or None
        Response entity.
    node, direction : int
    data_type : int
        2 and 4 real, 5 and 6 complex; single, double precision.
    n_values : int
    even : bool
    abscissa_start, abscissa_step : float
    step_resolution : float
        Relative: half a unit of the last digit of the step as printed.
    abscissa, ordinate : Axis
    """

    id_lines: tuple[str, ...]
    function_type: int
    entity: str | None
    node: int
    direction: int
    data_type: int
    n_values: int
    even: bool
    abscissa_start: float
    abscissa_step: float
    step_resolution: float
    abscissa: Axis
    ordinate: Axis


def _lines(stream: BinaryIO) -> Iterator[tuple[bytes, int]]:
    """Yield lines and the offset behind each."""
    while line := stream.readline(MAX_LINE):
        yield line, stream.tell()


def read_identifier(path: Path, stream: BinaryIO, position: int) -> Record | None:
    """Read a record's opening ``-1`` and identifier line.

    Returns
    -------
    Record or None
        None at the end of the file.

    Raises
    ------
    FormatError
        Something else stands there, or the file ends in between.
    """
    stream.seek(position)
    opened = False
    for line, behind in _lines(stream):
        text = line.strip(b" \t\r\n\x00\x1a")
        if not text:
            continue
        if not opened:
            if text.split(b"\r")[0].strip() == b"-1" != text:
                raise FormatError(f"{path}: its lines end in CR alone, which is not read; convert them to LF or CR LF")
            if text != b"-1":
                raise FormatError(f"{path}: no record begins at byte {position}: {text[:20]!r} instead of '-1'")
            opened = True
            continue
        if text == b"-1":
            continue
        match = re.match(rb"\s*(\d{1,6})([bB]?)(.*)", line)
        if match is None:
            raise FormatError(f"{path}: the record at byte {position} has no data set number: {text[:20]!r}")
        fields = [int(field) for field in match[3].split()[:4] if field.isdigit()] if match[2] else []
        fields += [0] * (4 - len(fields))
        if fields[2] > MAX_HEADER_LINES:
            raise FormatError(f"{path}: the record at byte {position} claims {fields[2]} header lines")
        return Record(int(match[1]), bool(match[2]), fields[0], fields[1], fields[2], fields[3], behind)
    if opened:
        raise FormatError(f"{path}: truncated: the file ends where a record begins, at byte {position}")
    return None


def find_terminator(stream: BinaryIO, position: int) -> tuple[int, int, int] | None:
    """Find the next line that holds ``-1`` alone.

    Returns
    -------
    (int, int, int) or None
        Its offset, the offset behind it, and the number of lines between `position` and it; None at the file's end.
    """
    stream.seek(position)
    base, tail, n_lines = position, b"", 0
    while True:
        chunk = stream.read(WINDOW)
        text = tail + chunk
        last = not chunk
        match = TERMINATOR.search(text)
        if match is not None and (last or match.end() < len(text)):
            n_lines += text.count(b"\n", 0, match.start())
            return base + match.start(), base + match.end() + (1 if match.end() < len(text) else 0), n_lines
        if last:
            return None
        keep = text.rfind(b"\n") + 1
        n_lines += text.count(b"\n", 0, keep)
        base, tail = base + keep, text[keep:]


def _decode(raw: bytes) -> str:
    """Text of a line, UTF-8 or else Latin-1, with its fields in their columns.

    A writer may count the columns of UTF-8 in characters or in bytes; a line whose length in bytes is one of
    `LENGTHS` tells. There each character is followed by a null for each further byte of it.
    """
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")
    if len(raw) in LENGTHS and len(text) not in LENGTHS:
        return "".join(character + "\x00" * (len(character.encode()) - 1) for character in text)
    return text


def _said(text: str) -> str | None:
    text = text.replace("\x00", "").strip(" \t\r\n")
    return None if text.upper() in ("", "NONE") else text


def _integer(text: str) -> int:
    """Whole number of a field; an empty field is 0, as Fortran reads it."""
    text = text.strip()
    if not re.fullmatch(r"[+-]?\d+|", text, re.ASCII):
        raise ValueError(f"{text!r} is no whole number")
    return int(text or 0)


def _axis(line: str) -> Axis:
    line = line.ljust(LINE)
    try:
        exponents = (_integer(line[10:15]), _integer(line[15:20]), _integer(line[20:25]))
    except ValueError:
        exponents = (0, 0, 0)
    return Axis(_integer(line[:10]), exponents, _said(line[26:46]), _said(line[47:67]))


def _degrees_of_freedom(line: str) -> tuple[str | None, int, int]:
    """Response entity, node and direction; a name of more than its ten columns moves the others to the right."""
    word = re.match(r"\S{11,}", line[31:])
    longer = len(word[0]) - 10 if word is not None else 0
    try:
        node, direction = _integer(line[41 + longer : 51 + longer]), _integer(line[51 + longer : 55 + longer])
    except ValueError:
        node, direction = 0, 0
    return _said(line[31 : 41 + longer]), node, direction


def _resolution(text: str) -> float:
    """Half a unit of the last printed digit, relative to the number.

    >>> _resolution(" 1.95312e-05")
    2.5600...e-06
    """
    mantissa = re.split("[eEdD]", text.strip())[0]
    decimals = len(mantissa.partition(".")[2])
    value = abs(float(mantissa)) if mantissa not in ("", "-", "+") else 0.0
    return 0.5 * 10.0**-decimals / value if value and math.isfinite(value) else 0.0


def _number(text: str) -> float:
    if "_" in text or not text.isascii():
        raise ValueError(f"{text!r} is no number")
    return float(text.strip().replace("D", "E").replace("d", "e") or 0.0)


def parse_header(path: Path, stream: BinaryIO, record: Record, index: int) -> tuple[Header58, int]:
    """Read records 1 to 11 of a data set 58.

    Returns
    -------
    Header58
    int
        Offset of the first value.

    Raises
    ------
    FormatError
        The file ends within the header, or a number in it is none.
    """
    stream.seek(record.body)
    lines: list[str] = []
    position = record.body
    for line, behind in _lines(stream):
        lines.append(_decode(line.rstrip(b"\r\n")))
        position = behind
        if len(lines) == max(HEADER_LINES, record.header_lines):
            break
    if len(lines) < HEADER_LINES or not line.endswith(b"\n"):
        raise FormatError(f"{path}: truncated: the file ends in the header of record {index}")
    try:
        dof, form = lines[5].ljust(LINE), lines[6].ljust(LINE)
        step = form[43:56]
        entity, node, direction = _degrees_of_freedom(dof)
        header = Header58(
            id_lines=tuple(line.replace("\x00", "").strip() for line in lines[:5]),
            function_type=_integer(dof[:5]),
            entity=entity,
            node=node,
            direction=direction,
            data_type=_integer(form[:10]),
            n_values=_integer(form[10:20]),
            even=_integer(form[20:30]) != 0,
            abscissa_start=_number(form[30:43]),
            abscissa_step=_number(step),
            step_resolution=_resolution(step),
            abscissa=_axis(lines[7]),
            ordinate=_axis(lines[8]),
        )
    except ValueError as error:
        raise FormatError(f"{path}: the header of record {index} is damaged ({error})") from error
    if header.n_values < 0:
        raise FormatError(f"{path}: record {index} claims {header.n_values} values")
    return header, position


def read_units(stream: BinaryIO, record: Record) -> tuple[float, float] | None:
    """Read the factors of length and force of a data set 164: numbers in the file divided by them are in SI.

    Returns
    -------
    (float, float) or None
        None where they are not there or make no sense.
    """
    stream.seek(record.body)
    lines = [line for line, _ in islice(_lines(stream), 2)]
    text = lines[1].decode("latin-1").rstrip("\r\n") if len(lines) == 2 else ""
    try:
        length, force = _number(text[:25]), _number(text[25:50])
    except ValueError:
        return None
    sensible = all(math.isfinite(factor) and factor > 0.0 for factor in (length, force))
    return (length, force) if sensible else None


def start_time_of(text: str) -> str | None:
    """Date and time of ID line 3 as ISO 8601, None where it is none.

    Examples
    --------
    >>> start_time_of("28/jul/2021 10:28:51"), start_time_of("18-Apr-16 13:49:58")
    ('2021-07-28T10:28:51', '2016-04-18T13:49:58')
    """
    match = re.match(r"\s*(\d{1,2})[-/. ]([A-Za-z]{3})[a-z]*[-/. ](\d{4}|\d{2})[ T]+(\d{1,2}):(\d\d)(?::(\d\d))?", text)
    try:
        if match is None:
            return (
                datetime.fromisoformat(text.strip()).isoformat() if re.match(r"\s*\d{4}-\d\d-\d\d[T ]", text) else None
            )
        month, year = MONTHS.get(match[2].lower(), 0), int(match[3])
        if len(match[3]) == 2:
            year += 2000 if year < 70 else 1900
        return datetime(year, month, int(match[1]), int(match[4]), int(match[5]), int(match[6] or 0)).isoformat()
    except ValueError:
        return None
