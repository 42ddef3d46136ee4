"""The table of formats, and how a file finds its row: by content, then by suffix.

A package of somebody else adds a row through the entry point group
``tdacoustic.formats``, whose entries name a `Format` each::

    [project.entry-points."tdacoustic.formats"]
    ourlogger = "ourpackage.tdacoustic_format:FORMAT"
"""

from __future__ import annotations

import re
import stat
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from tdacoustic.errors import FormatError, MissingFileError, MissingPackageError, TdacousticError
from tdacoustic.formats.bounds import ClearReader, bounded, clear_messages
from tdacoustic.formats.closed import closed_by_content, closed_by_suffix
from tdacoustic.formats.starts import from_the_start
from tdacoustic.recording import Log

__all__ = ["ENTRY_POINTS", "FORMATS", "Format", "formats", "scan"]

HEAD_BYTES = 4096
NUMBER = re.compile(rb"[+-]?(?:(?:\d+[.,]?\d*|[.,]\d+)(?:e[+-]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)

ENTRY_POINTS = "tdacoustic.formats"
"""Group of the entry points through which other packages add a `Format`."""


@dataclass(frozen=True)
class Format:
    """One row: a file format that tdacoustic reads.

    Parameters
    ----------
    name, title : str
        Key, and the words for people.
    suffixes : tuple of str
        Lower case, with the dot.
    matches : callable
        Given the first `HEAD_BYTES` bytes, says whether the content is this format.
    module : str
        Module with ``scan_file(path) -> Log``, imported when first used.
    extra : str or None
        The extra of tdacoustic that installs what the module imports, where that is not in the core.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    matches: Callable[[bytes], bool]
    module: str
    extra: str | None = None


def _is_audio(head: bytes) -> bool:
    return (head[:4] in (b"RIFF", b"RF64", b"RIFX", b"BW64") and head[8:12] == b"WAVE") or head[:4] == b"fLaC"


def _is_hdf5(head: bytes) -> bool:
    return any(head[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048))


def _is_tdms(head: bytes) -> bool:
    return head[:4] in (b"TDSm", b"TDSh")  # the latter an index, which its reader answers


def _is_matlab(head: bytes) -> bool:
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return True
    if head[124:128] in (b"\x00\x01IM", b"\x01\x00MI", b"\x00\x02IM", b"\x02\x00MI"):
        return True
    from tdacoustic.formats.matlab.level4 import is_level4

    return is_level4(head)


def _is_uff(head: bytes) -> bool:
    """Whether a record opens the file: not where all lines are numbers, which is one column of a text."""
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    opens = len(lines) > 2 and lines[0] == b"-1" and lines[1][:6].rstrip(b"bB ").isdigit()
    return opens and any(NUMBER.fullmatch(line) is None for line in lines[1:-1])


def _is_atfx(head: bytes) -> bool:
    return head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<" and b"atfx_file" in head


def _is_mdf(head: bytes) -> bool:
    return head[:8] in (b"MDF     ", b"UnFinMF ")


def _is_dewesoft(head: bytes) -> bool:
    return head.startswith(b"MULTI_STREAM_FILE_VER")


def _is_text(head: bytes) -> bool:
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        head = head[: len(head) // 2 * 2].decode("utf-16", errors="replace").encode("utf-8")
    if not head.strip() or b"\x00" in head:
        return False
    printable = sum(byte >= 32 or byte in (9, 10, 13) for byte in head)
    return printable >= 0.99 * len(head)


FORMATS: tuple[Format, ...] = (
    Format("audio", "WAV or FLAC", (".wav", ".wave", ".flac", ".rf64", ".bwf"), _is_audio, "tdacoustic.formats.audio"),
    Format("matlab", "MATLAB", (".mat",), _is_matlab, "tdacoustic.formats.matlab"),
    Format("hdf5", "HDF5", (".h5", ".hdf5", ".he5"), _is_hdf5, "tdacoustic.formats.hdf5"),
    Format("uff58", "UFF 58 or 58b", (".uff", ".unv", ".bunv", ".uf"), _is_uff, "tdacoustic.formats.uff58"),
    Format("tdms", "TDMS", (".tdms", ".tdms_index"), _is_tdms, "tdacoustic.formats.tdms"),
    Format("atfx", "ASAM ODS ATFX", (".atfx",), _is_atfx, "tdacoustic.formats.atfx"),
    Format("mdf4", "MDF 4", (".mf4", ".mdf"), _is_mdf, "tdacoustic.formats.mdf4"),
    Format(
        "dewesoft",
        "Dewesoft DXD or D7D (not verified on a real recording)",
        (".dxd", ".d7d"),
        _is_dewesoft,
        "tdacoustic.formats.dewesoft",
        extra="dewesoft",
    ),
    Format("delimited", "CSV or TSV", (".csv", ".tsv", ".txt", ".asc"), _is_text, "tdacoustic.formats.delimited"),
)
"""The table. Content decides; text, which has no signature of its own, stands last, whatever the suffix."""


@cache
def _added() -> tuple[tuple[Format, ...], tuple[str, ...]]:
    """Rows of other packages, and why some could not be had."""
    rows: list[Format] = []
    problems: list[str] = []
    for entry in entry_points(group=ENTRY_POINTS):
        try:
            row = entry.load()
        except Exception as error:  # a broken package of somebody else must not stop the formats that work
            problems.append(f"format {entry.name!r} ({entry.value}) cannot be loaded: {type(error).__name__}: {error}")
            continue
        if not isinstance(row, Format):
            problems.append(f"format {entry.name!r} ({entry.value}) is {type(row).__name__}, not a Format")
        elif row.name in {other.name for other in (*FORMATS, *rows)}:
            problems.append(f"format {entry.name!r} ({entry.value}) is called {row.name!r}, which there is already")
        else:
            rows.append(row)
    return tuple(rows), tuple(problems)


def formats() -> tuple[Format, ...]:
    """Return the table with the rows that other packages add; text still stands last."""
    return (*FORMATS[:-1], *_added()[0], FORMATS[-1])


def _format_of(path: Path, head: bytes) -> tuple[Format, tuple[str, ...]]:
    if not head:
        raise FormatError(f"{path}: the file is empty")
    table = formats()
    named = [row for row in table if path.suffix.lower() in row.suffixes]
    by_suffix = next((row for row in named if row.matches(head)), None)
    if by_suffix is not None and by_suffix.name != "delimited":
        return by_suffix, ()
    by_content = next((row for row in table if row.name != "delimited" and row.matches(head)), None)
    if by_content is not None:
        return by_content, (f"the suffix is {path.suffix or 'absent'}, the content is {by_content.title}",)
    closed = closed_by_content(path.suffix.lower(), head)
    if closed is not None:
        raise FormatError(f"{path}: is {closed.title}; {closed.remedy}")
    if by_suffix is not None:
        return by_suffix, ()
    closed = closed_by_suffix(path.suffix.lower())
    if closed is not None:
        raise FormatError(f"{path}: is, by its suffix, {closed.title}; {closed.remedy}")
    problems = "".join(f"; {problem}" for problem in _added()[1])
    if named:
        raise FormatError(f"{path}: no {named[0].title} file; it begins with {head[:12]!r}{problems}")
    titles = ", ".join(f"{row.title} ({' '.join(row.suffixes)})" for row in table)
    raise FormatError(f"{path}: format not known; known are {titles}{problems}")


def _scanned(row: Format, path: Path) -> Log:
    """Let a format's module scan a file; whatever a format library raises, the user gets one clear line."""
    try:
        log: Log = import_module(row.module).scan_file(path)
    except TdacousticError:
        raise
    except ModuleNotFoundError as error:
        remedy = "" if row.extra is None else f": pip install 'tdacoustic[{row.extra}]'"
        raise MissingPackageError(
            f"{path}: reading {row.title} needs the package {error.name}, which is not installed{remedy}"
        ) from error
    except Exception as error:
        raise FormatError(f"{path}: damaged {row.title} file ({type(error).__name__}: {error})") from error
    return log


def _head_of(path: Path) -> bytes:
    """First bytes of a file; a pipe, a device, a folder and the endless files of /proc are refused unopened."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:  # ValueError: a null character
        if isinstance(error, FileNotFoundError | NotADirectoryError | ValueError):
            raise MissingFileError(f"{path}: no such file") from None
        raise FormatError(f"{path}: cannot be read ({error.strerror})") from None
    if not stat.S_ISREG(status.st_mode):
        raise MissingFileError(f"{path}: is not a file")
    if status.st_size == 0:
        raise FormatError(f"{path}: the file is empty")
    try:
        with path.open("rb") as stream:
            return stream.read(HEAD_BYTES)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({error.strerror})") from error


def scan(path: str | Path) -> Log:
    """Read a log's headers.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Log
        Its channels in their own units, and a reader for their samples.

    Raises
    ------
    MissingFileError
        There is no such file.
    MissingPackageError
        Its format needs an extra that is not installed.
    FormatError
        It is of no known format, or not what it claims to be.
    """
    path = Path(path)
    with clear_messages():
        head = _head_of(path)
        row, flags = _format_of(path, head)
        log = _scanned(row, path)
        if not log.channels:
            raise FormatError(f"{path}: no channel in it that could be read")
        return bounded(from_the_start(replace(log, flags=(*flags, *log.flags), reader=ClearReader(log.reader))))
