"""Whether the recordings of a campaign can be used."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tdacoustic.results import Analysis

__all__ = ["unusable_runs"]


def unusable_runs(analysis: Analysis) -> tuple[str, ...]:
    """Return one line for each run that cannot be used; rejected runs are not meant."""
    return tuple(
        f"run {run.name!r}: {verdict.detail}"
        for run in analysis.runs
        for verdict in run.all_verdicts
        if verdict.verdict == "bad" and verdict.check == "run"
    )
