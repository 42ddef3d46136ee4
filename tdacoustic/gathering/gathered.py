"""Many results together: what was gathered, what was left out, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tdacoustic.gathering.manifest import ResultFolder
from tdacoustic.gathering.outliers import Comparison
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.result import GatheredResult

__all__ = ["COMMAND_ORDER", "Gathering", "LeftOut", "repeated"]

COMMAND_ORDER = ("run", "calibrate", "analyze", "check")
"""Commands whose results may be of one campaign's same recordings: the one that does most first."""


@dataclass(frozen=True)
class LeftOut:
    """A folder that does not count, and why."""

    folder: str
    reason: str


@dataclass(frozen=True)
class Gathering:
    """What the page shows.

    Parameters
    ----------
    results : tuple of GatheredResult
        In the order in which they were found.
    left_out : tuple of LeftOut
    comparison : Comparison
    rows : mapping of str to int
        Rows of each table of the dataset.
    links : mapping of str to str
        From the page to a result's own report, by the result's id.
    folders : tuple of str
        Where was looked, as it is written.
    """

    results: tuple[GatheredResult, ...]
    left_out: tuple[LeftOut, ...]
    comparison: Comparison
    rows: Mapping[str, int] = field(default_factory=dict)
    links: Mapping[str, str] = field(default_factory=dict)
    folders: tuple[str, ...] = ()

    def of_origin(self, origin: Origin) -> tuple[GatheredResult, ...]:
        """Return the results of one origin."""
        return tuple(result for result in self.results if result.origin == origin)

    @property
    def origins(self) -> tuple[Origin, ...]:
        """Origins that there are, of results and of the levels in them: measured, synthetic, printed."""
        held = {row.level_origin for result in self.results for row in result.conditions if row.level_from}
        held |= {result.origin for result in self.results}
        order: tuple[Origin, ...] = ("measured", "synthetic", "printed")
        return tuple(origin for origin in order if origin in held)


def repeated(found: Sequence[ResultFolder]) -> dict[int, int]:
    """Return which results say again what another one says: index to index of the one that stays.

    A copy has the id of another one. Results of a campaign of the same name and of the same recordings (where it has
    none, of the same file) are of one campaign: the one of the command that does most stays (`COMMAND_ORDER`), of equal
    ones the one that was written last.

    Parameters
    ----------
    found : sequence of ResultFolder
    """
    order = sorted(range(len(found)), key=lambda i: (_rank(found[i].command), -found[i].written_s, i))
    stays: dict[object, int] = {}
    again: dict[int, int] = {}
    for i in order:
        keys: list[object] = [found[i].result]
        if found[i].recordings:
            keys.append((found[i].campaign, found[i].recordings))
        first = next((stays[key] for key in keys if key in stays), None)
        if first is None:
            stays |= dict.fromkeys(keys, i)
        else:
            again[i] = first
    return again


def _rank(command: str) -> int:
    return COMMAND_ORDER.index(command) if command in COMMAND_ORDER else len(COMMAND_ORDER)
