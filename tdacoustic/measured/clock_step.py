"""Step: how one log's time lies on another's, from a signal that both recorded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.clocks import ClockEstimate, NoRelation, estimate_clock
from tdacoustic.formats import scan
from tdacoustic.recording import Reader
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = ["CLOCK", "ClockFinding", "ClockSettings", "SharedChannel", "find_clock"]


@dataclass(frozen=True)
class SharedChannel:
    """A log's channel that holds the shared signal.

    Parameters
    ----------
    column : int
    sample_rate_hz : float
        As the log or its run states it.
    n_samples : int
    start_s : float
        After the start of the log.
    """

    column: int
    sample_rate_hz: float
    n_samples: int
    start_s: float = 0.0


@dataclass(frozen=True)
class ClockSettings:
    """What is compared, and where the offset is sought.

    Parameters
    ----------
    reference, other : SharedChannel
        Of the first and of the second log of the inputs.
    max_offset_s : float or None
    centre_s : float
        By how much the other log starts later, as far as it is known.
    """

    reference: SharedChannel
    other: SharedChannel
    max_offset_s: float | None = None
    centre_s: float = 0.0


@dataclass(frozen=True)
class ClockFinding:
    """An estimate, or why there is none."""

    estimate: ClockEstimate | None = None
    failure: NoRelation | None = None


@dataclass(frozen=True)
class _LogRecord:
    """One channel of a log, as the estimate reads it."""

    reader: Reader
    channel: SharedChannel

    @property
    def sample_rate_hz(self) -> float:
        return self.channel.sample_rate_hz

    @property
    def n_samples(self) -> int:
        return self.channel.n_samples

    @property
    def start_s(self) -> float:
        return self.channel.start_s

    def blocks(self, start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        for block in self.reader.blocks([self.channel.column], start, stop, block_size):
            yield block[0]


def find_clock(settings: ClockSettings, logs: tuple[LogFile, ...]) -> ClockFinding:
    """Step: offset and drift of the second log's clock against the first's."""
    one, two = (scan(log.path).reader for log in logs)
    tell_progress(0.0)
    found = estimate_clock(
        _LogRecord(one, settings.reference), _LogRecord(two, settings.other), settings.max_offset_s, settings.centre_s
    )
    return ClockFinding(failure=found) if isinstance(found, NoRelation) else ClockFinding(found)


CLOCK = Step("clock", 2, find_clock, "Offset and drift of a log's clock")
"""Inputs: ``logs``, the reference and the other."""
