"""The paths that the drive's sound takes: their names and colours, and which of them the total adds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np

from tdacoustic.drive import DriveSound
from tdacoustic.drive.levels import paths_of_total
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.figure import Line, Symbol
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.words import joined

__all__ = ["PATHS", "SoundPath", "heard_paths", "is_added", "path_line", "path_word", "total_words"]


class SoundPath(NamedTuple):
    """A path with its words and its look, the same in every figure.

    Parameters
    ----------
    key : str
        As in `DriveSound`.
    label, clause : str
        English of `name` and `phrase`.
    slot : int
        Of the palette.
    symbol : str
    """

    key: str
    label: str
    clause: str
    slot: int
    symbol: Symbol

    @property
    def name(self) -> str:
        """As a legend says it."""
        return say(self.label)

    @property
    def phrase(self) -> str:
        """As it is said in a sentence."""
        return say(self.clause)


PATHS: Final = (
    SoundPath("motor", mark("motor"), mark("the motor's tones"), 0, "circle"),
    SoundPath("mesh", mark("meshing noise"), mark("the meshing noise"), 1, "diamond"),
    SoundPath("structure", mark("structure"), mark("the structure (bearing forces through the housing)"), 2, "square"),
)
"""Motor, mesh and structure, in the order in which they are listed."""
_WORDS: Final = {
    "motor": mark("motor"),
    "mesh": mark("mesh"),
    "structure": mark("structure"),
    "total": mark("total"),
}


def path_word(key: str) -> str:
    """Return a path, or the total, in a word."""
    return say(_WORDS[key])


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
    if len(added) > 1:
        parts = [say("The total adds the energies of {paths}", paths=joined(added))]
    elif added:
        parts = [say("The total is {path}", path=added[0])]
    else:
        parts = [say("The total adds nothing of what is shown")]
    if beside:
        which = joined([path.phrase for path in beside])
        text = say_count("{paths} is shown but not added", "{paths} are shown but not added", len(beside), paths=which)
        why = _why(fleet, beside)
        parts.append(f"{text} ({', '.join(why)})" if why else text)
    return sentence("; ".join(parts))


def path_line(fleet: Fleet, path: SoundPath, x: np.ndarray, levels: np.ndarray) -> Line:
    """Return the line of a path beside that of the total: dotted, and named so, where the total does not add it."""
    if is_added(fleet, path):
        return Line(x, levels, path.name, color=path.slot, points=True, style="dashed")
    return Line(x, levels, say("{path} (not added)", path=path.name), color=path.slot, points=True, style="dotted")


def _why(fleet: Fleet, beside: list[SoundPath]) -> list[str]:
    """The keys of the fleet that leave paths out of the total."""
    gear_path, placement = fleet.model.gear_path.value, fleet.masuda.placement.value
    keys = [path.key for path in beside]
    reasons = []
    if "structure" in keys or ("mesh" in keys and gear_path == "structure"):
        reasons.append(f'[model] gear_path = "{gear_path}"')
    if "mesh" in keys and gear_path != "structure":
        reasons.append(f'[masuda] placement = "{placement}"')
    if keys == ["structure"]:
        reasons.append(say("Masuda's level already holds what the housing radiates"))
    return reasons
