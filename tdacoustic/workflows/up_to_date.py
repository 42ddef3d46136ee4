"""Whether a result folder is still what a run would write: told from its manifest alone, without any heavy library.

A result is up to date where the software that made it is this one, and where every file that its run read, and every
file that it wrote, is as it was.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from tdacoustic.steps import Store, log_file
from tdacoustic.steps.record import versions
from tdacoustic.steps.software import source_sha256
from tdacoustic.toml_models import path_problem
from tdacoustic.workflows.output import read_manifest, subject_of

__all__ = ["FOLDER", "Standing", "software", "standing", "state_of"]

FOLDER: Final = "folder"
"""State of a path that is a folder."""

_SMALL_BYTES: Final = 1 << 20
"""A file of less is hashed again quicker than its remembered hash is looked up."""

_MORE_LIBRARIES: Final = ("ngsolve", "emcee", "npTDMS", "dwdatareader", "librosa", "plotly", "matplotlib", "jinja2")
"""Libraries that shape a result besides those that each record names."""


@dataclass(frozen=True)
class Standing:
    """What the manifest of a result that is up to date says of it.

    Parameters
    ----------
    name : str
        Of the campaign.
    n_runs, n_conditions, n_problems : int
    """

    name: str
    n_runs: int
    n_conditions: int
    n_problems: int


@cache
def software() -> str:
    """SHA-256 over this package's files, the versions of the libraries it rests on, and packages that add formats.

    Hashed once a process: some 20 ms.
    """
    from tdacoustic.formats.table import ENTRY_POINTS

    digest = hashlib.sha256(source_sha256().encode())
    for name, version in (*versions(), *_more_versions()):
        if name != "tdacoustic":  # its files tell more, and do so too where it is not installed
            digest.update(f"{name} {version}\n".encode())
    for entry in metadata.entry_points(group=ENTRY_POINTS):
        version = "" if entry.dist is None else entry.dist.version
        digest.update(f"{entry.name} {entry.value} {version}\n".encode())
    return digest.hexdigest()


def _more_versions() -> Iterator[tuple[str, str]]:
    for name in _MORE_LIBRARIES:
        try:
            yield name, metadata.version(name)
        except metadata.PackageNotFoundError:
            yield name, ""


def state_of(path: Path, store: Store) -> str | None:
    """Return the sha256 of a file, `FOLDER` of a folder, None of nothing; a large file's is remembered by the store."""
    try:
        if path.is_file():
            return _sha256(path) if path.stat().st_size < _SMALL_BYTES else log_file(path, store).sha256
        return FOLDER if path.is_dir() else None
    except (OSError, ValueError):  # ValueError: a null character
        return None


def standing(folder: Path, campaign: Path, store: Store, wanted: Collection[str] = ()) -> Standing | None:
    """Return what a result folder's manifest says where the result is up to date, else None.

    Parameters
    ----------
    folder : Path
        The result folder.
    campaign : Path
        The campaign file.
    store : Store
        Remembers the hashes of logs by size and time stamps.
    wanted : collection of str
        Files that a run may leave out, and that the result must have all the same.
    """
    held = read_manifest(folder) or {}
    made_from, counts, named = (_table(held, key) for key in ("made_from", "counts", "campaign"))
    of_this = held.get("command") == "run" and held.get("subject") == subject_of(campaign, folder)
    if not held.get("complete") or not of_this or made_from.get("software") != software():
        return None
    if not set(wanted) <= set(held["files"]):
        return None
    n_runs, n_conditions = counts.get("runs"), counts.get("conditions")
    if not isinstance(n_runs, int) or not isinstance(n_conditions, int):
        return None
    start = campaign.absolute().parent
    if not _are_as_read(start, _table(made_from, "files"), store) or not _are_whole(folder, held["files"]):
        return None
    return Standing(str(named.get("name", "")), n_runs, n_conditions, len(held.get("problems") or ()))


def _table(held: Mapping[str, Any], key: str) -> dict[str, Any]:
    """A table of a manifest; empty where it has none."""
    found = held.get(key)
    return found if isinstance(found, dict) else {}


def _are_as_read(start: Path, files: Mapping[str, Any], store: Store) -> bool:
    """Whether all files that a manifest says were read are still as they were."""
    named = all(path_problem(name) is None for name in files)
    return bool(files) and named and all(state_of(start / name, store) == state for name, state in files.items())


def _are_whole(folder: Path, files: Mapping[str, Any]) -> bool:
    """Whether all files that a manifest names are in the folder, as they were written."""
    whole = folder.resolve()
    for name, sha256 in files.items():
        path = whole / name
        try:
            if not path.resolve().is_relative_to(whole) or not path.is_file() or _sha256(path) != sha256:
                return False
        except (OSError, ValueError):
            return False
    return bool(files)


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
