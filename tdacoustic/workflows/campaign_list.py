"""Which campaigns are meant: files, folders and globs from a command line or a list, each campaign once."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final

from tdacoustic.errors import CampaignError, MissingFileError, OutputError
from tdacoustic.toml_models import small_file, steering_sign

__all__ = ["CAMPAIGN_FILE", "ListedCampaign", "listed_campaigns", "output_folders"]

CAMPAIGN_FILE: Final = "campaign.toml"

_FOLDERS_SEARCHED: Final = 2000
"""Folders below one without a campaign that are looked through for a hint."""


@dataclass(frozen=True)
class ListedCampaign:
    """A campaign among several.

    Parameters
    ----------
    given : str
        Its path as the user wrote it; what a glob found, as the glob spells it.
    file : Path
        The campaign file.
    """

    given: str
    file: Path


def listed_campaigns(arguments: Iterable[str | Path], list_file: Path | None = None) -> tuple[ListedCampaign, ...]:
    """Return the campaigns that arguments and a list name, each once, in their order.

    Parameters
    ----------
    arguments : iterable of str or Path
        Campaign files, folders that hold a ``campaign.toml``, and globs of either (``**`` for any depth).
    list_file : Path, optional
        One of these a line, relative to the list; empty lines and lines that begin with ``#`` say nothing.

    Raises
    ------
    MissingFileError
        There is no such file or folder, a folder holds no campaign, or a glob finds none.
    CampaignError
        The list cannot be read, or names nothing.
    """
    found: dict[str, ListedCampaign] = {}
    for text, folder, where in (*((str(argument), None, "") for argument in arguments), *_lines(list_file)):
        for campaign in _meant(text, folder, where):
            found.setdefault(os.path.normcase(os.path.realpath(campaign.file)), campaign)
    return tuple(found.values())


def _lines(list_file: Path | None) -> Iterator[tuple[str, Path | None, str]]:
    """Text, folder and place of each entry of a list."""
    if list_file is None:
        return
    try:
        text = small_file(list_file, CampaignError).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CampaignError(f"{list_file}: is not UTF-8 (byte {error.start})") from error
    held = False
    for number, line in enumerate(text.splitlines(), 1):
        entry, where = line.strip(), f"{list_file}: line {number}: "
        if not entry or entry.startswith("#"):
            continue
        sign = steering_sign(entry)
        if sign is not None:
            raise CampaignError(f"{where}has the sign {sign!a}, which no path here may have")
        held = True
        yield entry, list_file.parent, where
    if not held:
        raise CampaignError(f"{list_file}: names no campaign")


def _meant(text: str, folder: Path | None, where: str) -> list[ListedCampaign]:
    """The campaigns of one entry; a path that there is counts as it is, also with signs of a glob in it."""
    path = Path(text) if folder is None else folder / text
    if path.is_dir():
        if (path / CAMPAIGN_FILE).is_file():
            return [ListedCampaign(text, path / CAMPAIGN_FILE)]
        raise MissingFileError(f"{where}{text}: the folder holds no {CAMPAIGN_FILE}{_below(path, text)}")
    if path.is_file():
        return [ListedCampaign(text, path)]
    if not glob.has_magic(text):
        raise MissingFileError(f"{where}{text}: {'is not a file' if path.exists() else 'no such file or folder'}")
    found = []
    names_files = ".toml" in Path(text).name.lower()  # else a glob means folders: fleets lie in them too
    for match in sorted(glob.glob(text, root_dir=folder, recursive=True)):  # noqa: PTH207 - also absolute ones
        matched = Path(match) if folder is None else folder / match
        inside = matched / CAMPAIGN_FILE
        if inside.is_file():
            found.append(ListedCampaign(match, inside))
        elif names_files and matched.is_file():
            found.append(ListedCampaign(match, matched))
    if not found:
        raise MissingFileError(f"{where}{text}: finds no campaign: no {CAMPAIGN_FILE}, and no folder that holds one")
    return found


def _below(folder: Path, text: str) -> str:
    """A hint where campaigns lie further down."""
    for below, folders, files in islice(os.walk(folder), _FOLDERS_SEARCHED):
        folders.sort()
        if CAMPAIGN_FILE in files:
            written = text.rstrip("/\\") or text
            deeper = len(Path(below).relative_to(folder).parts) > 1
            return (
                f", but there are campaigns below it, as {Path(below) / CAMPAIGN_FILE}; "
                f"give {written + ('/**' if deeper else '/*')!r} for all of them"
            )
    return ""


def output_folders(campaigns: Sequence[ListedCampaign], root: Path) -> tuple[tuple[Path, ...], str | None]:
    """Return where each campaign's results go below a root, and a note where that is not simply its folder's name.

    Parameters
    ----------
    campaigns : sequence of ListedCampaign
    root : Path

    Raises
    ------
    OutputError
        Results of one campaign would lie inside those of another, or the campaigns have no folder in common.
    """
    folders = [campaign.file.resolve().parent for campaign in campaigns]
    names = [folder.name.casefold() for folder in folders]
    if all(names) and len(set(names)) == len(names):
        return tuple(root / folder.name for folder in folders), None
    try:
        common = Path(os.path.commonpath(folders))
    except ValueError:
        raise OutputError(
            "campaigns of one folder's name lie on several drives; run them apart, each with -o"
        ) from None
    below = []
    for campaign, folder in zip(campaigns, folders, strict=True):
        several = folders.count(folder) > 1 and campaign.file.name != CAMPAIGN_FILE
        below.append((folder / campaign.file.stem if several else folder).relative_to(common))
    _check_apart(campaigns, below)
    again = next(folder.name for folder, name in zip(folders, names, strict=True) if names.count(name) > 1)
    note = f"several campaigns lie in folders named {again!r}: results go by their paths below {common}"
    return tuple(root / path for path in below), note


def _check_apart(campaigns: Sequence[ListedCampaign], below: Sequence[Path]) -> None:
    """Raise where one result folder would be another's, or lie in it."""
    taken: dict[tuple[str, ...], str] = {}
    parts = [tuple(part.casefold() for part in path.parts) for path in below]
    for campaign, held in zip(campaigns, parts, strict=True):
        if held in taken:
            raise OutputError(f"{campaign.given} and {taken[held]} would be written to one folder; run them apart")
        taken[held] = campaign.given
    for campaign, held in zip(campaigns, parts, strict=True):
        outer = next((taken[held[:n]] for n in range(len(held)) if held[:n] in taken), None)
        if outer is not None:
            raise OutputError(f"the results of {campaign.given} would lie inside those of {outer}; run them apart")
