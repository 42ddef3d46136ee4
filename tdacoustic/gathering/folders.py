"""Where results lie: folders with a manifest, at any depth below those that are named."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final
from urllib.parse import quote

from tdacoustic.errors import MissingFileError

__all__ = ["MANIFEST", "common_folder", "find_folders", "named_folders", "relative_link"]

MANIFEST: Final = "manifest.json"


def named_folders(patterns: Iterable[str | Path]) -> list[Path]:
    """Return the folders that names and patterns stand for, in that order, each once.

    A pattern is one of shells (``*``, ``?``, ``[...]``, and ``**`` for any depth) and stands for the folders among
    what it matches; a folder of that very name comes first.

    Raises
    ------
    MissingFileError
        A name that is no folder, or a pattern that matches none.
    """
    found: dict[Path, None] = {}
    for pattern in map(str, patterns):
        if Path(pattern).is_dir():
            held = [Path(pattern)]
        elif glob.has_magic(pattern):
            matches = sorted(glob.glob(pattern, recursive=True))  # noqa: PTH207 - absolute patterns too
            held = [Path(match) for match in matches if Path(match).is_dir()]
        else:
            held = []
        if not held:
            there = Path(pattern).exists()
            raise MissingFileError(f"{pattern}: {'is no folder' if there else 'no such folder'}")
        found |= dict.fromkeys(held)
    return list(found)


def find_folders(folders: Iterable[Path]) -> tuple[list[Path], list[tuple[str, str]]]:
    """Return every folder with a manifest in these folders and below, and which folders could not be read.

    Hidden folders and those that are being written (``*.partial``) are passed by, links to folders are not followed.

    Parameters
    ----------
    folders : iterable of Path

    Returns
    -------
    list of Path
        In natural order of their names, each once whatever path leads to it.
    list of (str, str)
        Folder and reason.
    """
    found: dict[Path, Path] = {}
    unread: list[tuple[str, str]] = []
    for folder in folders:
        for path in _walk(folder, unread):
            found.setdefault(path.resolve(), path)
    return sorted(found.values(), key=_natural), list(dict.fromkeys(unread))


def _walk(folder: Path, unread: list[tuple[str, str]]) -> Iterator[Path]:
    def note(error: OSError) -> None:
        unread.append((str(error.filename), f"cannot be read ({error.strerror})"))

    for name, below, files in os.walk(folder, onerror=note):
        below[:] = [entry for entry in below if not entry.startswith(".") and not entry.endswith(".partial")]
        if MANIFEST in files:
            yield Path(name)


def _natural(path: Path) -> list[tuple[int, int, str]]:
    """Names with numbers in them by the numbers."""
    parts = re.split(r"([0-9]+)", path.as_posix())
    return [(0, int(part[:18]), part) if part.isdecimal() else (1, 0, part) for part in parts]


def common_folder(folders: Iterable[Path]) -> Path:
    """Return the folder that all of these lie in: what a view of them is of, however many there are by and by.

    Parameters
    ----------
    folders : iterable of Path
        At least one; on several drives, the first one's drive is taken.
    """
    whole = [str(folder.resolve()) for folder in folders]
    try:
        return Path(os.path.commonpath(whole))
    except ValueError:  # several drives
        return Path(Path(whole[0]).anchor)


def relative_link(target: Path, start: Path) -> str | None:
    """Return the way from a folder to a file as a page links it; None where there is none (another drive).

    Examples
    --------
    >>> relative_link(Path("reports/a b/report.html"), Path("reports/fleet"))
    '../a%20b/report.html'
    """
    try:
        way = os.path.relpath(target.resolve(), start.resolve())
    except ValueError:
        return None
    return quote(Path(way).as_posix(), safe="/", errors="surrogateescape")
