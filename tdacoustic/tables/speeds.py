"""``speeds.csv`` and ``slip.csv``: what turned how fast in each run, by whom, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tdacoustic.attribution.slips import RunSlip, beside_leading
from tdacoustic.fleet import Kinematics
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.speed import SpeedProfile
from tdacoustic.tables.frames import Row, frame_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["SOURCES", "speed_tables"]

SOURCES = {"tacho": "tacho", "channel": "speed channel", "lines": "lines"}
UNITS = {"1/s": (60.0, "rpm"), "m/s": (3.6, "km/h")}


def speed_tables(
    runs: Sequence[MeasuredRun],
    slips: Mapping[str, Sequence[RunSlip]],
    drives: Mapping[str, Kinematics],
) -> dict[str, pd.DataFrame]:
    """Return ``speeds``, and ``slip`` where several speeds of a run are known.

    Parameters
    ----------
    runs : sequence of MeasuredRun
    slips : mapping of str to sequence of RunSlip
        By run.
    drives : mapping of str to Kinematics
        By run; empty without a fleet.
    """
    tested = [run for run in runs if run.run.kind == "test" and run.measurement is not None]
    found = {"speeds": frame_of("speeds", (row for run in tested for row in _speed_rows(run, drives.get(run.name))))}
    if any(slips.values()):
        rows = (_slip_row(run, item) for run in tested for item in slips.get(run.name, ()))
        found["slip"] = frame_of("slip", rows)
    return found


def _speed_rows(run: MeasuredRun, drive: Kinematics | None) -> Iterator[Row]:
    assert run.measurement is not None
    speed, about = run.measurement.speed, {"run": run.name, "condition": run.run.condition}
    for profile in speed.profiles:
        yield {**about, **_profile_row(run, profile), "beside_leading": beside_leading(run, profile, drive)}
    for channel, reason in speed.problems:
        held = None if run.recording is None else run.recording[channel]
        source = None if held is None else SOURCES["tacho" if held.quantity == "tacho" else "channel"]
        yield {
            **about,
            "channel": channel,
            "shaft": None if held is None else held.shaft,
            "source": source,
            "known_share": 0.0,
            "reason": reason,
        }
    if speed.lines is not None and speed.lines.reason is not None:
        yield {
            **about,
            "channel": f"lines of {', '.join(speed.lines.channels)}",
            "shaft": "motor",
            "source": SOURCES["lines"],
            "known_share": 0.0,
            "reason": speed.lines.reason,
        }
    yield from ({**about, **row} for row in _stated_rows(run))


def _stated_rows(run: MeasuredRun) -> Iterator[Row]:
    """Speeds of the campaign; or that nothing tells the speed at all."""
    assert run.measurement is not None
    stated = [("motor", run.run.motor_speed_rpm, "rpm"), (None, run.run.train_speed_km_h, "km/h")]
    for shaft, value, unit in stated:
        if value is not None:
            yield {"shaft": shaft, "source": "stated", "mean": value, "min": value, "max": value, "unit": unit}
    speed = run.measurement.speed
    told = speed.profiles or speed.problems or (speed.lines is not None and speed.lines.reason is not None)
    if not told and all(value is None for _, value, _ in stated):
        yield {"known_share": 0.0, "reason": "no speed or tacho channel, and the campaign states none"}


def _profile_row(run: MeasuredRun, profile: SpeedProfile) -> Row:
    factor, unit = UNITS[profile.si_symbol]
    return {
        "channel": profile.channel,
        "shaft": profile.shaft,
        "source": SOURCES[profile.source],
        "mean": factor * profile.mean,
        "min": factor * float(profile.speed.min()),
        "max": factor * float(profile.speed.max()),
        "unit": unit,
        "error": None if profile.error is None else factor * float(np.median(profile.error)),
        "confidence": None if profile.confidence is None else float(np.median(profile.confidence)),
        "known_share": None if run.span_s is None else profile.known_share(*run.span_s),
        "first_s": float(profile.times_s[0]),
        "last_s": float(profile.times_s[-1]),
        "notes": "; ".join(profile.notes) or None,
    }


def _slip_row(run: MeasuredRun, item: RunSlip) -> Row:
    row: Row = {
        "run": run.name,
        "condition": run.run.condition,
        "train_channel": item.train_channel,
        "shaft_channel": item.shaft_channel,
        "shaft": item.shaft,
        "reason": item.reason,
    }
    slip = item.slip
    if slip is None:
        return row
    worst = max(slip.events, key=lambda event: abs(event.peak), default=None)
    notes = list(slip.notes)
    if slip.error is None:
        notes.append("no error: neither speed states one")
    if math.isnan(slip.like_delay_s):
        notes.append("no delay can be told: the train hardly changes its speed")
    return {
        **row,
        "usual_slip": slip.usual,
        "error": None if slip.error is None else float(np.median(slip.error)),
        "n_events": float(len(slip.events)),
        "worst_event": None if worst is None else worst.kind,
        "worst_slip": None if worst is None else worst.peak,
        "worst_from_s": None if worst is None else worst.first_s,
        "worst_to_s": None if worst is None else worst.last_s,
        "from_s": float(slip.times_s[0]),
        "to_s": float(slip.times_s[-1]),
        "like_delay_s": None if math.isnan(slip.like_delay_s) else slip.like_delay_s,
        "notes": "; ".join(notes) or None,
    }
