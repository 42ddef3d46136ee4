"""The paths that the drive's sound takes: their names and colours, and which of them the total adds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np

from tdacoustic.drive import DriveSound
from tdacoustic.drive.levels import paths_of_total
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.figure import Line, Symbol
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.words import joined

__all__ = ["PATHS", "SoundPath", "heard_paths", "is_added", "path_line", "total_words"]


class SoundPath(NamedTuple):
    """A path with its words and its look, the same in every figure.

    Parameters
    ----------
    key : str
        As in `DriveSound`.
    name, phrase : str
        In a legend or a table, and in a sentence.
    slot : int
        Of the palette.
    symbol : str
    """

    key: str
    name: str
    phrase: str
    slot: int
    symbol: Symbol


PATHS: Final = (
    SoundPath("motor", "motor", "the motor's tones", 0, "circle"),
    SoundPath("mesh", "meshing noise", "the meshing noise", 1, "diamond"),
    SoundPath("structure", "structure", "the structure (bearing forces through the housing)", 2, "square"),
)
"""Motor, mesh and structure, in the order in which they are listed."""


def heard_paths(sounds: Iterable[DriveSound]) -> list[SoundPath]:
    """Return the paths with a level anywhere in one of the sounds."""
    held = {level.path for sound in sounds for level in sound.levels if level.level_db is not None}
    return [path for path in PATHS if path.key in held]


def is_added(fleet: Fleet, path: SoundPath) -> bool:
    """Whether the total adds a path."""
    return path.key in paths_of_total(fleet)


def total_words(fleet: Fleet, paths: Iterable[SoundPath]) -> str:
    """Say which of some paths the total adds, and why others are shown beside it; empty of no path.

    Parameters
    ----------
    fleet : Fleet
    paths : iterable of SoundPath
        Those with a level.
    """
    held = list(paths)
    added = [path.phrase for path in held if is_added(fleet, path)]
    beside = [path for path in held if not is_added(fleet, path)]
    if not held:
        return ""
    text = (
        say("The total adds the energies of {added}", added=joined(added))
        if len(added) > 1
        else say("The total is {added}", added="".join(added))
    )
    parts = [text if added else say("The total adds nothing of what is shown")]
    if beside:
        which = joined([path.phrase for path in beside])
        parts.append(
            say(
                "{which} {value} shown but not added{why}",
                which=which,
                value="are" if len(beside) > 1 else "is",
                why=_why(fleet, beside),
            )
        )
    return sentence("; ".join(parts))


def path_line(fleet: Fleet, path: SoundPath, x: np.ndarray, levels: np.ndarray) -> Line:
    """Return the line of a path beside that of the total: dotted, and named so, where the total does not add it."""
    if is_added(fleet, path):
        return Line(x, levels, path.name, color=path.slot, points=True, style="dashed")
    return Line(x, levels, say("{name} (not added)", name=path.name), color=path.slot, points=True, style="dotted")


def _why(fleet: Fleet, beside: list[SoundPath]) -> str:
    """The keys of the fleet that leave paths out of the total."""
    gear_path, placement = fleet.model.gear_path.value, fleet.masuda.placement.value
    keys = [path.key for path in beside]
    reasons = []
    if "structure" in keys or ("mesh" in keys and gear_path == "structure"):
        reasons.append(say('[model] gear_path = "{gear_path}"', gear_path=gear_path))
    if "mesh" in keys and gear_path != "structure":
        reasons.append(say('[masuda] placement = "{placement}"', placement=placement))
    if keys == ["structure"]:
        reasons.append(say("Masuda's level already holds what the housing radiates"))
    return f" ({', '.join(reasons)})" if reasons else ""
