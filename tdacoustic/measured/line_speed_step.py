"""Step: the speed of the motor from the lines of vibration, where no channel tells it or for comparison."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.measured.results import LineReading, RunSpeed
from tdacoustic.recording import Channel, Recording
from tdacoustic.speed import (
    CombOrder,
    Decimator,
    RidgeSearch,
    RidgeSettings,
    RidgeSpeed,
    ShaftAngle,
    SpeedProfile,
    decimation_of,
    refinement_of,
    refusal,
    ridge_speed,
)
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = ["LINE_SPEED", "LineSpeedSettings", "complete_speed", "tells_a_shaft"]

Array = NDArray[np.float64]
Heard = tuple[tuple[str, float], ...]

BLOCK_BYTES = 8 * 2**20
GUIDE_MARGIN = 1.15
"""Over the highest speed of a guide, as far as lines are looked for: a wheel may run ahead."""
AT_EDGE = 0.03
"""Within this part of the highest speed that is searched a speed is said to reach it."""
HEARD, SAME_ORDER = 0.5, 0.005
"""Probability from which an order counts as heard, and how near two orders must be to be one."""
RIVAL = 0.05
"""Probability of another reading of the lines from which it is said."""
SECTION_S = 300.0
"""Longest record that is searched at once: its spectra are held in memory."""
ENDS_S = 2.0
"""Within this time of its end a section must know its speed, or the next one starts from nothing."""
DEAD_BLOCKS = 4
"""Blocks by which a channel that never changes is recognised."""


@dataclass(frozen=True)
class LineSpeedSettings:
    """What is known before the motor's speed is read from lines.

    Parameters
    ----------
    channels : tuple of Channel
        On one raster.
    orders : tuple of CombOrder
        Per turn of the motor.
    lowest_hz, highest_hz : float
        Range of the motor's speed.
    acceleration_hz_s : float
    always : bool
        Also where a channel tells the speed of a shaft.
    start_hz : float or None
        Motor speed at the start of the run, where it is stated.
    turns_per_metre : float or None
        Of the motor, where the fleet says: a train's speed over time then guides.
    """

    channels: tuple[Channel, ...]
    orders: tuple[CombOrder, ...]
    lowest_hz: float
    highest_hz: float
    acceleration_hz_s: float
    always: bool = False
    start_hz: float | None = None
    turns_per_metre: float | None = None


def tells_a_shaft(speed: RunSpeed, turns_per_metre: float | None) -> bool:
    """Whether a channel tells the speed of the motor or of the wheelset, or of the train that turns them."""
    return any(
        profile.shaft in ("motor", "wheelset") or (profile.si_symbol == "m/s" and turns_per_metre is not None)
        for profile in speed.profiles
    )


def complete_speed(settings: LineSpeedSettings, logs: tuple[LogFile, ...], speed: RunSpeed) -> RunSpeed:
    """Step: the speeds of a run, with that of the motor from lines where it is asked for."""
    if not settings.always and tells_a_shaft(speed, settings.turns_per_metre):
        return speed
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    names = tuple(channel.name for channel in settings.channels)
    try:
        names = _alive(recording, names)
        known = _known(settings, speed)
        found = _read(recording, names, known)
    except AnalysisError as error:
        return replace(speed, lines=LineReading(names, f"no speed in the lines: {error}"))
    worst = max(found, key=lambda item: item.rival_probability)
    heard = max(found, key=lambda item: item.margin).heard
    spans = [(c.start_s, c.start_s + c.duration_s) for c in (piece.channels[0] for piece in _sections(recording))]
    profile = _joined(found, spans)
    alone = "" if len(found) == 1 else f" (and in none of the other {len(found) - 1} sections)"
    reason = f"{found[0].reason}{alone}" if profile is None else None
    lines = LineReading(names, reason, heard, worst.rival_ratio, worst.rival_probability)
    if profile is None:
        return replace(speed, lines=lines)
    profile = _said(profile, worst, known, heard)
    return replace(
        speed,
        profiles=(*speed.profiles, profile),
        angles=(*speed.angles, *_angles(profile)),
        lines=lines,
    )


def _said(profile: SpeedProfile, worst: RidgeSpeed, known: RidgeSettings, heard: Heard) -> SpeedProfile:
    """The profile with what is doubtful about it among its faults."""
    # The span that is known is said elsewhere; here it is how many frames told a speed.
    notes = tuple(
        note.replace("known in", "values in").replace("of the run,", "of the frames,") for note in profile.notes
    )
    doubts = []
    if worst.rival_probability > RIVAL:
        part = f"{worst.rival_ratio:.3g} times the speed too, with probability {worst.rival_probability:.2f}"
        doubts.append(f"its lines fit {part}")
    low, high = float(np.min(profile.speed)), float(np.max(profile.speed))
    if high > (1.0 - AT_EDGE) * known.highest_hz:
        limit = f"{60.0 * known.highest_hz:.4g} rpm, up to which it was sought"
        doubts.append(f"it reaches {limit}; [analysis] motor_speed_range_rpm sets another limit")
    for ratio in _other_readings(known, heard):
        if ratio * high > known.highest_hz or ratio * low < known.lowest_hz:
            limits = f"{60.0 * known.lowest_hz:.4g} to {60.0 * known.highest_hz:.4g} rpm"
            doubts.append(f"its lines would be orders of {ratio:.3g} times the speed too, beyond the {limits} searched")
    faults = (*(note for note in notes if note.startswith("not known")), *doubts)
    return replace(profile, source="lines", notes=(*notes, *doubts), faults=faults)


def _other_readings(known: RidgeSettings, heard: Heard) -> Iterator[float]:
    """Simple ratios at which all orders that are heard would be others of the machine."""
    every = np.array([item.order for item in known.orders])
    found = {name for name, part in heard if part > HEARD}
    values = np.array([item.order for item in known.orders if item.name in found])
    for ratio in (1.0 / 3.0, 0.5, 2.0, 3.0):
        off = np.abs(values[:, None] / ratio / every[None, :] - 1.0)
        if values.size and np.all(off.min(axis=1) < SAME_ORDER):
            yield ratio


def _angles(profile: SpeedProfile) -> tuple[ShaftAngle, ...]:
    try:
        return (ShaftAngle.from_profile(profile),)
    except AnalysisError:
        return ()


def _known(settings: LineSpeedSettings, speed: RunSpeed) -> RidgeSettings:
    train = next((profile for profile in speed.profiles if profile.si_symbol == "m/s"), None)
    guide = None
    if train is not None and settings.turns_per_metre is not None:
        guide = replace(
            train, shaft="motor", si_symbol="1/s", speed=np.abs(train.speed) * settings.turns_per_metre, error=None
        )
    highest_hz = settings.highest_hz
    if guide is not None:
        highest_hz = max(highest_hz, GUIDE_MARGIN * float(np.max(guide.speed)))
    start_hz = settings.start_hz
    if start_hz is not None and not settings.lowest_hz <= start_hz <= highest_hz:
        start_hz = None  # a start from rest: nothing is heard of it
    return RidgeSettings(
        settings.orders,
        settings.lowest_hz,
        highest_hz,
        settings.acceleration_hz_s,
        start_hz=start_hz,
        guide=guide,
    )


def _blocks(recording: Recording, names: tuple[str, ...]) -> Iterator[Array]:
    return recording.blocks(names, max(1024, BLOCK_BYTES // (8 * len(names))))


def _alive(recording: Recording, names: tuple[str, ...]) -> tuple[str, ...]:
    """Channels whose samples change at all."""
    low, high = np.full(len(names), math.inf), np.full(len(names), -math.inf)
    for number, block in enumerate(_blocks(recording, names)):
        low, high = np.fmin(low, np.fmin.reduce(block, axis=1)), np.fmax(high, np.fmax.reduce(block, axis=1))
        if number + 1 == DEAD_BLOCKS:
            break
    alive = tuple(name for name, least, most in zip(names, low, high, strict=True) if most > least)
    if not alive:
        raise AnalysisError("no channel that changes at all")
    return alive


# ---------------------------------------------------------------- sections


def _sections(recording: Recording) -> tuple[Recording, ...]:
    """The recording in pieces of equal length that one search can hold."""
    first = recording.channels[0]
    count = max(1, math.ceil(first.duration_s / SECTION_S))
    cuts = [round(first.n_samples * number / count) for number in range(count + 1)]

    def piece(channel: Channel, start: int, stop: int) -> Channel:
        return replace(
            channel,
            start_sample=channel.start_sample + start,
            n_samples=stop - start,
            start_s=channel.start_s + start / channel.sample_rate_hz,
        )

    return tuple(
        replace(recording, channels=tuple(piece(channel, *cut) for channel in recording.channels))
        for cut in pairwise(cuts)
    )


def _read(recording: Recording, names: tuple[str, ...], known: RidgeSettings) -> list[RidgeSpeed]:
    """Speed of each section; one starts as fast as the one before ended."""
    found: list[RidgeSpeed] = []
    sections = _sections(recording.only(names))
    for number, section in enumerate(sections):

        def tell(part: float, before: int = number) -> None:
            tell_progress((before + part) / len(sections))

        found.append(_read_section(section, names, known, tell))
        profile = found[-1].profile
        ends = (
            profile is not None
            and profile.times_s[-1] > section.channels[0].start_s + section.channels[0].duration_s - ENDS_S
        )
        known = replace(known, start_hz=float(profile.speed[-1]) if profile is not None and ends else None)
    return found


def _read_section(
    recording: Recording, names: tuple[str, ...], known: RidgeSettings, tell: Callable[[float], None]
) -> RidgeSpeed:
    first = recording.channels[0]
    known = replace(known, guide=_guide_of(known.guide, first.start_s, first.start_s + first.duration_s))
    factor = decimation_of(first.sample_rate_hz)
    rate, n_samples = first.sample_rate_hz / factor, Decimator(factor, len(names)).count(first.n_samples)
    search = RidgeSearch(known, rate, n_samples, len(names))
    for part, block in _decimated(recording, names, factor):
        search.take(block)
        tell(0.4 * part)
    found = search.result()
    refined = None
    if refusal(found) is None:
        refined = refinement_of(found, known, rate, n_samples)
        for part, block in _decimated(recording, names, factor):
            refined.take(block)
            tell(0.6 + 0.4 * part)
    return ridge_speed(f"lines of {', '.join(names)}", known, found, refined, first.start_s, first.duration_s)


def _guide_of(guide: SpeedProfile | None, first_s: float, last_s: float) -> SpeedProfile | None:
    """The guide of a section, on the section's own time; None where it says nothing there."""
    try:
        cut = None if guide is None else guide.within(first_s, last_s)
    except AnalysisError:
        return None
    if cut is None:
        return None
    unknown = tuple((low - first_s, high - first_s, why) for low, high, why in cut.unknown)
    return replace(cut, times_s=cut.times_s - first_s, unknown=unknown)


def _decimated(recording: Recording, names: tuple[str, ...], factor: int) -> Iterator[tuple[float, Array]]:
    """Blocks, and the part of the record that has been read with each."""
    decimator, done = Decimator(factor, len(names)), 0
    for block in _blocks(recording, names):
        done += block.shape[1]
        yield done / recording.channels[0].n_samples, decimator.take(block)


def _joined(found: Sequence[RidgeSpeed], sections: Sequence[tuple[float, float]]) -> SpeedProfile | None:
    """One profile of all sections; None where none has any."""
    held = [item.profile for item in found if item.profile is not None]
    if not held or len(found) == 1:
        return held[0] if held else None
    unknown, notes = [], [f"read from lines in {len(found)} sections of {sections[0][1] - sections[0][0]:.0f} s"]
    for item, (first, last) in zip(found, sections, strict=True):
        unknown += [(first, last, item.reason or "")] if item.profile is None else list(item.profile.unknown)
        where = f"{first:.0f} s to {last:.0f} s: "
        notes += [f"not known from {first:.2f} s to {last:.2f} s: {item.reason}"] if item.profile is None else []
        notes += [
            note if note.startswith("not known") else where + note
            for note in (item.profile.notes if item.profile else ())
        ]

    def all_of(name: str) -> Array:
        return np.concatenate([np.asarray(getattr(profile, name)) for profile in held])

    return SpeedProfile(
        held[0].channel,
        held[0].shaft,
        "1/s",
        all_of("times_s"),
        all_of("speed"),
        tuple(notes),
        doubtful=bool(unknown) or any(profile.doubtful for profile in held),
        error=all_of("error"),
        confidence=all_of("confidence"),
        unknown=tuple(unknown),
    )


LINE_SPEED = Step("line_speed", 1, complete_speed, "Speed from the lines of vibration, where no channel tells it")
