"""The word of a check on a channel or a run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

__all__ = ["Verdict", "Word", "worst"]

Word = Literal["ok", "warning", "bad"]
_RANK: dict[str, int] = {"ok": 0, "warning": 1, "bad": 2}


@dataclass(frozen=True)
class Verdict:
    """One row of ``quality.csv``.

    Parameters
    ----------
    channel : str
        Empty where the whole run is meant.
    check : str
        What was looked at.
    verdict : "ok", "warning" or "bad"
        ``bad``: the channel (or run) is not used.
    detail : str
        The finding in words, with its figures.
    """

    channel: str
    check: str
    verdict: Word
    detail: str


def worst(verdicts: Iterable[Verdict]) -> Word:
    """Return the worst word; ``ok`` of none."""
    return max((verdict.verdict for verdict in verdicts), key=_RANK.__getitem__, default="ok")
