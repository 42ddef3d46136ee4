"""Words and names that several sections share."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from tdacoustic.measured import ChannelResult
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.recording import Channel
from tdacoustic.results import Analysis

__all__ = ["condition_words", "measured_channels", "pretty_unit", "slug", "speed_words", "tested_runs"]


def slug(*parts: str) -> str:
    """Return an anchor made of names of any script, unique as long as the names differ.

    Examples
    --------
    >>> slug("spectrum", "run 1a")
    'spectrum-run-1a'
    """
    made = []
    for part in parts:
        plain = re.sub(r"[^a-z0-9]+", "-", part.lower()).strip("-")
        if plain != part:  # keep "1.a" and "1 a" apart
            plain = (
                f"{plain}-{sum(ord(c) * 31**i for i, c in enumerate(part)) % 46656:x}"
                if plain != part.lower().replace(" ", "-")
                else plain
            )
        made.append(plain or "x")
    return "-".join(made)


def pretty_unit(symbol: str) -> str:
    """Return a unit as it is printed.

    Examples
    --------
    >>> pretty_unit("m/s^2"), pretty_unit("1 um/s^2")
    ('m/s²', '1 µm/s²')
    """
    return re.sub(r"\bu(?=Pa|m)", "µ", symbol.replace("^2", "²"))


def speed_words(run: MeasuredRun) -> str:
    """Speed of a run in words: train, motor, or its range."""
    words = []
    if run.train_speed_km_h is not None:
        words.append(f"{run.train_speed_km_h:.4g} km/h")
    if run.motor_speed_hz is not None:
        words.append(f"motor {60.0 * run.motor_speed_hz:.5g} rpm")
    if run.measurement is not None and not run.measurement.steady:
        profile = run.measurement.speed.leading
        if profile is not None:
            factor, unit = (60.0, "rpm") if profile.si_symbol == "1/s" else (3.6, "km/h")
            of_shaft = f"{profile.shaft} " if profile.shaft else ""
            words.append(f"{of_shaft}{factor * profile.speed.min():.4g} to {factor * profile.speed.max():.4g} {unit}")
    return ", ".join(words) or "speed not known"


def condition_words(analysis: Analysis, condition: str) -> str:
    """Name of a condition with its speed."""
    runs = [run for run in tested_runs(analysis) if run.run.condition == condition]
    return f"Condition {condition} ({speed_words(runs[0])})" if runs else f"Condition {condition}"


def tested_runs(analysis: Analysis) -> list[MeasuredRun]:
    """Test runs that were measured."""
    return [run for run in analysis.runs if run.run.kind == "test" and run.measurement is not None]


def measured_channels(run: MeasuredRun) -> Iterator[tuple[Channel, ChannelResult]]:
    """Usable channels of a run with their results."""
    if run.measurement is not None and run.recording is not None:
        for result in run.measurement.channels:
            if result.usable and math.isfinite(result.rms):
                yield run.recording[result.channel], result
