"""The table of formats, and how a file finds its row: by content, then by suffix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path

from tdacoustic.errors import FormatError, MissingFileError, TdacousticError
from tdacoustic.recording import Log

__all__ = ["FORMATS", "Format", "scan"]

HEAD_BYTES = 4096


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
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    matches: Callable[[bytes], bool]
    module: str


def _is_audio(head: bytes) -> bool:
    return (head[:4] in (b"RIFF", b"RF64", b"RIFX", b"BW64") and head[8:12] == b"WAVE") or head[:4] == b"fLaC"


def _is_hdf5(head: bytes) -> bool:
    return any(head[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048))


def _is_uff(head: bytes) -> bool:
    lines = head.splitlines()
    lines = [line.strip() for line in lines if line.strip()][:2]
    return len(lines) == 2 and lines[0] == b"-1" and lines[1][:6].rstrip(b"bB ").isdigit()


def _is_text(head: bytes) -> bool:
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        head = head[: len(head) // 2 * 2].decode("utf-16", errors="replace").encode("utf-8")
    if not head.strip() or b"\x00" in head:
        return False
    printable = sum(byte >= 32 or byte in (9, 10, 13) for byte in head)
    return printable >= 0.99 * len(head)


FORMATS: tuple[Format, ...] = (
    Format("audio", "WAV or FLAC", (".wav", ".wave", ".flac", ".rf64", ".bwf"), _is_audio, "tdacoustic.formats.audio"),
    Format("hdf5", "HDF5", (".h5", ".hdf5", ".he5"), _is_hdf5, "tdacoustic.formats.hdf5"),
    Format("uff58", "UFF 58 or 58b", (".uff", ".unv", ".bunv", ".uf"), _is_uff, "tdacoustic.formats.uff58"),
    Format("delimited", "CSV or TSV", (".csv", ".tsv", ".txt", ".asc"), _is_text, "tdacoustic.formats.delimited"),
)
"""The table. Content decides; text, which has no signature of its own, stands last."""


def _format_of(path: Path, head: bytes) -> tuple[Format, tuple[str, ...]]:
    by_suffix = next((row for row in FORMATS if path.suffix.lower() in row.suffixes), None)
    if not head:
        raise FormatError(f"{path}: the file is empty")
    if by_suffix is not None and by_suffix.matches(head):
        return by_suffix, ()
    by_content = next((row for row in FORMATS if row.name != "delimited" and row.matches(head)), None)
    if by_content is not None:
        return by_content, (f"the suffix is {path.suffix or 'absent'}, the content is {by_content.title}",)
    if by_suffix is not None:
        raise FormatError(f"{path}: no {by_suffix.title} file; it begins with {head[:12]!r}")
    titles = ", ".join(f"{row.title} ({' '.join(row.suffixes)})" for row in FORMATS)
    raise FormatError(f"{path}: format not known; known are {titles}")


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
    FormatError
        It is of no known format, or not what it claims to be.
    """
    path = Path(path)
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file" if not path.exists() else f"{path}: is not a file")
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({error.strerror})") from error
    row, flags = _format_of(path, head)
    try:
        log: Log = import_module(row.module).scan_file(path)
    except TdacousticError:
        raise
    except Exception as error:  # whatever a format library raises, the user gets one clear line
        raise FormatError(f"{path}: damaged {row.title} file ({type(error).__name__}: {error})") from error
    if not log.channels:
        raise FormatError(f"{path}: no channel in it that could be read")
    return replace(log, flags=(*flags, *log.flags)) if flags else log
