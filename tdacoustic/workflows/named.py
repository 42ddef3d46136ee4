"""What a manifest says of its campaign: its name, where its numbers come from, ``[meta]``, and when it was recorded."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.results import Analysis

__all__ = ["earliest_start", "named"]

MAX_ENTRIES: Final = 100
MAX_KEY: Final = 200
MAX_TEXT: Final = 1000
"""Of ``[meta]``, so that a manifest stays small."""


def named(campaign: Campaign, analysis: Analysis | None) -> dict[str, Any]:
    """Return a campaign as a manifest names it.

    ``meta`` is as it is written, its texts cut to 1000 characters; ``started`` is the earliest start that a log of a
    test run states, as the log states it. Either is absent where there is none.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis or None
        Holds the recordings; None of a campaign without runs.
    """
    found: dict[str, Any] = {"name": campaign.name, "origin": campaign.origin}
    if campaign.meta:
        found["meta"] = {key[:MAX_KEY]: value[:MAX_TEXT] for key, value in campaign.meta[:MAX_ENTRIES]}
    started = None if analysis is None else earliest_start(_starts(analysis))
    return found if started is None else {**found, "started": started}


def _starts(analysis: Analysis) -> Iterable[str]:
    """The starts that the logs of test runs state."""
    for run in analysis.runs:
        if run.run.kind == "test" and run.recording is not None:
            yield from (log.start_time for log in run.recording.logs if log.start_time is not None)


def earliest_start(starts: Iterable[str]) -> str | None:
    """Return the earliest of some ISO 8601 instants as it is written; None where none is one.

    Instants with an offset from UTC cannot be held against those without: where there are both, the first count.

    Examples
    --------
    >>> earliest_start(["2026-05-01T10:00:00+02:00", "2026-05-01T08:30:00Z"])
    '2026-05-01T10:00:00+02:00'
    """
    from tdacoustic.ingest.stamps import parse_stamp

    stamps = [stamp for stamp in map(parse_stamp, starts) if stamp is not None]
    held = [stamp for stamp in stamps if stamp.zoned] or stamps
    return min(held, key=lambda stamp: (stamp.whole_s, stamp.part_s)).text if held else None
