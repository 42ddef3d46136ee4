"""Words and names that several sections share."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from tdacoustic.attribution import SourceLine
from tdacoustic.measured import ChannelResult
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.recording import Channel
from tdacoustic.reporting.figure import Hatch
from tdacoustic.reporting.language import mark, say
from tdacoustic.results import Analysis

__all__ = [
    "OWNER_HATCHES",
    "OWNER_SLOTS",
    "OWNER_SLOT_OTHER",
    "SHAFT_WORDS",
    "UNKNOWN_SPEED",
    "by_frequency",
    "condition_words",
    "distinct_lines",
    "is_override",
    "joined",
    "measured_channels",
    "pretty_signs",
    "pretty_unit",
    "probability_words",
    "quantity_word",
    "same_line",
    "slug",
    "source_word",
    "speed_words",
    "tested_runs",
]

OWNER_SLOTS = {"motor": 0, "gearbox": 1, "ambiguous": 3, "unassigned": 7}
OWNER_HATCHES: Final[Mapping[str, Hatch]] = {"gearbox": "/", "ambiguous": "x", "unassigned": ".", "undecided": "."}
"""Of bars, beside their colour."""
"""Colour of a source, the same in every figure."""
OWNER_SLOT_OTHER = 2

SOURCE_WORDS = {
    "motor": mark("motor"),
    "gearbox": mark("gearbox"),
    "ambiguous": mark("ambiguous"),
    "unassigned": mark("unassigned"),
    "undecided": mark("undecided"),
    "residual": mark("residual"),
    "wheelset": mark("wheelset"),
    "bogie": mark("bogie"),
    "body": mark("body"),
    "air": mark("air"),
    "shaft": mark("shaft"),
}
"""Sources, and the components that can be one."""

SHAFT_WORDS = {"motor": mark("motor"), "wheelset": mark("wheelset")}

QUANTITY_WORDS = {
    "sound_pressure": mark("sound pressure"),
    "acceleration": mark("acceleration"),
    "speed": mark("speed"),
    "torque": mark("torque"),
    "current": mark("current"),
    "voltage": mark("voltage"),
    "force": mark("force"),
    "temperature": mark("temperature"),
    "tacho": mark("tacho"),
    "other": mark("other"),
}

UNKNOWN_SPEED = mark("speed not known")

SAME_LINE = 0.003
"""Relative distance within which two receivers' lines are named once in a sentence."""


def slug(*parts: str) -> str:
    """Return an anchor made of names of any script, unique as long as the names differ in more than case.

    Examples
    --------
    >>> slug("spectrum", "run 1a")
    'spectrum-run-1a'
    """
    made = []
    for number, part in enumerate(parts):
        plain = re.sub(r"[^a-z0-9]+", "-", part.lower()).strip("-")
        alike = plain != part.lower().replace(" ", "-") or (number > 0 and "-" in part)  # as others may be
        if alike:
            plain = f"{plain}-{sum(ord(c) * 31**i for i, c in enumerate(part)) % 46656:x}"
        made.append(plain or "x")
    return "-".join(made)


def pretty_unit(symbol: str) -> str:
    """Return a unit as it is printed.

    Examples
    --------
    >>> pretty_unit("m/s^2"), pretty_unit("1 um/s^2"), pretty_unit("81 us")
    ('m/s²', '1 µm/s²', '81 µs')
    """
    return re.sub(r"\bu(?=Pa|m)|(?<=\d )u(?=s\b)", "µ", symbol.replace("^2", "²"))


def speed_words(run: MeasuredRun) -> str:
    """Speed of a run in words: train, motor, or its range."""
    words = []
    if run.train_speed_km_h is not None:
        words.append(f"{run.train_speed_km_h:.4g} km/h")
    if run.motor_speed_hz is not None:
        words.append(say("motor {speed:.4g} rpm", speed=60.0 * run.motor_speed_hz))
    profile = None if run.measurement is None else run.measurement.speed.leading
    if profile is not None and run.measurement is not None:
        if run.measurement.steady and not words:  # nobody says of which shaft it is
            factor, unit = (60.0, "rpm") if profile.si_symbol == "1/s" else (3.6, "km/h")
            words.append(f"{profile.channel} {factor * profile.mean:.4g} {unit}")
        elif not run.measurement.steady:
            factor, unit = (60.0, "rpm") if profile.si_symbol == "1/s" else (3.6, "km/h")
            lowest, highest = factor * profile.speed.min(), factor * profile.speed.max()
            ends = say("{lowest:.4g} to {highest:.4g} {unit}", lowest=lowest, highest=highest, unit=unit)
            words.append(
                say("{shaft} {speeds}", shaft=say(SHAFT_WORDS[profile.shaft]), speeds=ends) if profile.shaft else ends
            )
        if profile.source == "lines":
            words.append(say("read from lines"))
    return pretty_signs(", ".join(words)) or say(UNKNOWN_SPEED)


def source_word(name: str) -> str:
    """Name of a source as it is said; one that a fleet names itself stays as it is."""
    return say(SOURCE_WORDS[name]) if name in SOURCE_WORDS else name


def quantity_word(quantity: str) -> str:
    """Name of a channel's quantity as it is said.

    Examples
    --------
    >>> quantity_word("sound_pressure")
    'sound pressure'
    """
    return say(QUANTITY_WORDS.get(quantity, quantity.replace("_", " ")))


def condition_words(analysis: Analysis, condition: str) -> str:
    """Name of a condition with its speed."""
    runs = [run for run in tested_runs(analysis) if run.run.condition == condition]
    return (
        say("Condition {condition} ({speed})", condition=condition, speed=speed_words(runs[0]))
        if runs
        else say("Condition {condition}", condition=condition)
    )


def tested_runs(analysis: Analysis) -> list[MeasuredRun]:
    """Test runs that were measured."""
    return [run for run in analysis.runs if run.run.kind == "test" and run.measurement is not None]


def measured_channels(run: MeasuredRun) -> Iterator[tuple[Channel, ChannelResult]]:
    """Usable channels of a run with their results."""
    if run.measurement is not None and run.recording is not None:
        for result in run.measurement.channels:
            if result.usable and math.isfinite(result.rms):
                yield run.recording[result.channel], result


def probability_words(probability: float | None) -> str:
    """Return a probability from resampling, which is never exactly 0 or 1.

    Examples
    --------
    >>> probability_words(1.0), probability_words(0.916), probability_words(None)
    ('> 0.99', '0.92', '')
    """
    if probability is None:
        return ""
    if probability > 0.994:
        return "> 0.99"
    return "< 0.01" if probability < 0.01 else f"{probability:.2f}"


def pretty_signs(text: str) -> str:
    """Return a text with true minus signs before its numbers.

    Examples
    --------
    >>> pretty_signs("gearbox -1 dB") == "gearbox \N{MINUS SIGN}1 dB"
    True
    """
    return re.sub(r"(?<![\w-])-(?=\d)", "\N{MINUS SIGN}", text)


def joined(words: Sequence[str]) -> str:
    """Join words as in a sentence.

    Examples
    --------
    >>> joined(["a", "b", "c"]), joined(["a"])
    ('a, b and c', 'a')
    """
    first, last = ", ".join(words[:-1]), "".join(words[-1:])
    return say("{first} and {last}", first=first, last=last) if first and last else first or last


def distinct_lines(sources: Iterable[SourceLine]) -> list[SourceLine]:
    """Noise lines, loudest first, those of several receivers at one frequency once."""
    found: list[SourceLine] = []
    for source in sorted(sources, key=lambda item: -item.line.mean_square):
        if not any(same_line(source, other) for other in found):
            found.append(source)
    return found


def same_line(one: SourceLine, other: SourceLine) -> bool:
    """Whether two receivers' lines are at one frequency, for the words of a report."""
    return abs(one.line.frequency_hz - other.line.frequency_hz) <= SAME_LINE * one.line.frequency_hz


def by_frequency(sources: Iterable[SourceLine]) -> list[SourceLine]:
    """Lines by frequency, those of several receivers at one frequency by receiver."""
    groups: list[list[SourceLine]] = []
    for source in sorted(sources, key=lambda item: item.line.frequency_hz):
        if groups and same_line(source, groups[-1][0]):
            groups[-1].append(source)
        else:
            groups.append([source])
    return [source for group in groups for source in sorted(group, key=lambda item: item.line.channel)]


def is_override(source: SourceLine) -> bool:
    """Whether the engineer's word stands for the source of a line."""
    return source.evidence.startswith("Override")
