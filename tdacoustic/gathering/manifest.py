"""A result's manifest and its files: complete, undamaged, and within the folder."""

from __future__ import annotations

import hashlib
import json
import re
import stat
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Final

from tdacoustic.errors import GatheringError
from tdacoustic.gathering.folders import MANIFEST
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.texts import checked_text, parsed_json, shown_text

__all__ = ["MAX_FILE_BYTES", "NoCampaignError", "ResultFolder", "open_result"]

SCHEMA: Final = "tdacoustic-manifest/1"
ORIGINS: Final = ("measured", "synthetic", "printed")

MAX_MANIFEST_BYTES: Final = 32 * 2**20
MAX_FILE_BYTES: Final = 128 * 2**20
"""Of a file that is read; a campaign's largest table has some 10 MB. What is above is taken for damage [assumed]."""

MAX_NAME: Final = 400
_ID_DIGITS: Final = 12

_WRITTEN: Final = frozenset({"campaign", "fleet", "runs", "sensors", "TOML"})
"""Formats of inputs that people write; all others are logs."""


class NoCampaignError(GatheringError):
    """A folder that holds no campaign's results, and is none to be missed."""


@dataclass(frozen=True)
class ResultFolder:
    """A result as its manifest describes it.

    Parameters
    ----------
    path : Path
    result : str
        Twelve hexadecimal digits made of what the result is of and of its files: a copy elsewhere has the same.
    campaign, origin, fleet, command : str
    meta : mapping of str to str
    started : str
        Earliest start of a log; empty of none.
    files : mapping of str to str
        sha256 by name.
    inputs : tuple of (str, int)
        sha256 and bytes of each file that went in.
    recordings : frozenset of str
        sha256 of the logs among them; of the campaign's file where there are none.
    written_s : float
        When the manifest was written, since 1970.
    problems : tuple of str
    version : str
        Of tdacoustic, empty where the manifest does not say.
    """

    path: Path
    result: str
    campaign: str
    origin: Origin
    fleet: str
    command: str
    meta: dict[str, str] = field(default_factory=dict)
    started: str = ""
    files: dict[str, str] = field(default_factory=dict)
    inputs: tuple[tuple[str, int], ...] = ()
    recordings: frozenset[str] = frozenset()
    written_s: float = 0.0
    problems: tuple[str, ...] = ()
    version: str = ""

    def read(self, name: str) -> bytes | None:
        """Return a file's bytes; None of one that the manifest does not name.

        Raises
        ------
        GatheringError
            It is not there, too large, outside of the folder, or not what the manifest says.
        """
        if name not in self.files:
            return None
        data = _bytes(self.path / name, name, MAX_FILE_BYTES)
        if hashlib.sha256(data).hexdigest() != self.files[name]:
            raise GatheringError(f"{name} is not what the manifest says (sha256)")
        return data

    def check(self, name: str) -> None:
        """Raise where a file is not what the manifest says; a large one is not held in memory."""
        try:
            with (self.path / name).open("rb") as stream:
                found = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as error:
            raise GatheringError(f"{name} cannot be read ({error.strerror})") from error
        if found != self.files[name]:
            raise GatheringError(f"{name} is not what the manifest says (sha256)")


def open_result(folder: Path) -> ResultFolder:
    """Return a result by its manifest, every file of which is there; what they hold is checked as they are read.

    Raises
    ------
    NoCampaignError
        It is a view of other results.
    GatheringError
        It is incomplete, damaged, or of no campaign.
    """
    held = parsed_json(_bytes(folder / MANIFEST, MANIFEST, MAX_MANIFEST_BYTES), MANIFEST)
    if held.get("schema") != SCHEMA:
        raise GatheringError(f"{MANIFEST} is none of tdacoustic (schema is not {SCHEMA!r})")
    command = checked_text(held.get("command", ""), "command of the manifest", MAX_NAME)
    if command == "fleet":
        raise NoCampaignError("a view of other results")
    if held.get("complete") is not True:
        raise GatheringError("the result is incomplete: it was being written, and its run has not ended well")
    campaign = held.get("campaign")
    if not isinstance(campaign, dict):
        raise GatheringError(f"it holds no campaign's results (command {command!r})")
    origin = campaign.get("origin")
    if origin not in ORIGINS:
        raise GatheringError(f"origin must be one of {', '.join(ORIGINS)}")
    files = _files(folder, held.get("files"))
    fleet = held.get("fleet")
    versions = held.get("versions")
    inputs = _inputs(held.get("inputs", []))
    logs = [sha256 for sha256, _, kind in inputs if kind not in _WRITTEN]
    return ResultFolder(
        path=folder,
        result=_result_id(held),
        campaign=checked_text(campaign.get("name"), "name of the campaign", MAX_NAME),
        origin=origin,
        fleet=checked_text(fleet.get("name", ""), "name of the fleet", MAX_NAME) if isinstance(fleet, dict) else "",
        command=command,
        meta=_meta(campaign.get("meta", {})),
        started=checked_text(campaign.get("started", ""), "started", MAX_NAME),
        files=files,
        inputs=tuple((sha256, size) for sha256, size, _ in inputs),
        recordings=frozenset(logs or [sha256 for sha256, _, kind in inputs if kind == "campaign"]),
        written_s=(folder / MANIFEST).stat().st_mtime,
        problems=_problems(held.get("problems", [])),
        version=str(versions.get("tdacoustic", ""))[:MAX_NAME] if isinstance(versions, dict) else "",
    )


def _bytes(path: Path, name: str, most: int) -> bytes:
    """A plain file's bytes, of bounded size: a pipe or a device would never end."""
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise GatheringError(f"{name} is no plain file")
        if found.st_size > most:
            raise GatheringError(f"{name} has {found.st_size / 2**20:.0f} MiB, allowed are {most // 2**20}")
        with path.open("rb") as stream:
            data = stream.read(most + 1)
    except OSError as error:
        raise GatheringError(f"{name} cannot be read ({error.strerror})") from error
    if len(data) > most:
        raise GatheringError(f"{name} grew beyond {most // 2**20} MiB while it was read")
    return data


def _files(folder: Path, listed: Any) -> dict[str, str]:
    if not isinstance(listed, dict) or not listed:
        raise GatheringError("the manifest names no files")
    whole = folder.resolve()
    for name, sha256 in listed.items():
        shown = name[:80]
        if not _is_inside(name) or not (folder / name).resolve().is_relative_to(whole):
            raise GatheringError(f"the manifest names {shown!a}, which is not within its folder")
        if not isinstance(sha256, str) or not re.fullmatch(r"[0-9a-f]{64}", sha256):
            raise GatheringError(f"the manifest has no sha256 of {shown!a}")
        if not (folder / name).is_file():
            raise GatheringError(f"{shown} is not there")
    return listed


def _is_inside(name: str) -> bool:
    """Whether a name can only mean something below the folder, on any system."""
    parts = PurePosixPath(name).parts
    return (
        bool(parts) and not re.search(r'[\\:\x00-\x1f<>"|?*]', name) and not name.startswith("/") and ".." not in parts
    )


def _meta(held: Any) -> dict[str, str]:
    if not isinstance(held, dict):
        raise GatheringError("meta of the manifest is no table")
    return {shown_text(key): shown_text(value) for key, value in held.items() if isinstance(value, str)}


def _inputs(held: Any) -> list[tuple[str, int, str]]:
    """Sha256, bytes and format of each file that went in."""
    if not isinstance(held, list):
        raise GatheringError("inputs of the manifest is no list")
    found = []
    for entry in held:
        sha256, size, kind = (
            entry.get(key) if isinstance(entry, dict) else None for key in ("sha256", "bytes", "format")
        )
        if not isinstance(sha256, str) or not isinstance(size, int) or not 0 <= size < 2**53:
            raise GatheringError("an input of the manifest lacks its sha256 or its size")
        found.append((sha256[:64], size, str(kind)))
    return found


def _problems(held: Any) -> tuple[str, ...]:
    if not isinstance(held, list):
        raise GatheringError("problems of the manifest is no list")
    return tuple(shown_text(entry) for entry in held if isinstance(entry, str))


def _result_id(held: dict[str, Any]) -> str:
    """What the result is of, what went in and what came out; not where it lies."""
    parts = {key: held.get(key) for key in ("campaign", "fleet", "command", "inputs", "files")}
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:_ID_DIGITS]
