"""``clocks.csv``: how each log's time lies on that of its run, and how that is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tdacoustic.measured.run_clocks import LogClock, RunClocks
from tdacoustic.tables.frames import Row, frame_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["clock_table"]


def clock_table(clocks: Mapping[str, RunClocks]) -> dict[str, pd.DataFrame]:
    """Return ``clocks`` as a frame, a row for each log but the reference; none of a campaign of single logs.

    ``offset_s`` is the instant on the run's axis at which the log starts, ``drift_ppm`` the relative excess of its
    clock's rate over the reference's; errors are standard errors, ``axis_error_samples`` the largest of any instant
    that both logs hold, in samples of the faster log. Empty is what nothing tells.

    Parameters
    ----------
    clocks : mapping of str to RunClocks
        By run.
    """
    if not clocks:
        return {}
    return {"clocks": frame_of("clocks", [_row(run, clock) for run in clocks.values() for clock in run.clocks])}


def _row(run: RunClocks, clock: LogClock) -> Row:
    row: Row = {
        "run": run.run,
        "log": clock.log,
        "reference_log": clock.reference_log,
        "method": clock.method,
        "offset_s": clock.offset_s,
        "offset_error_s": clock.offset_error_s,
        "drift_ppm": clock.drift_ppm,
        "drift_error_ppm": clock.drift_error_ppm,
        "doubt": "; ".join(clock.doubts) or None,
    }
    found = clock.estimate
    if found is not None:
        row |= {
            "axis_error_samples": None if clock.sample_rate_hz is None else found.axis_error_s * clock.sample_rate_hz,
            "wander_s": found.wander_s,
            "coherence": found.coherence,
            "peak_ratio": found.peak_ratio,
            "band_from_hz": found.band_hz[0],
            "band_to_hz": found.band_hz[1],
            "overlap_from_s": found.overlap_s[0],
            "overlap_to_s": found.overlap_s[1],
            "windows": found.n_windows,
            "windows_used": found.n_used,
            "inverted": found.inverted,
        }
    return row
