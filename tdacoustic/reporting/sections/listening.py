"""The sound itself: excerpts of each condition, and the order to listen for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.listening import ConditionSound, ExtractedOrder, Listening, MarkedOrder
from tdacoustic.reporting.document import (
    Block,
    Column,
    Details,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Sound,
    SoundTrack,
    Table,
)
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.played import can_encode, played_alike
from tdacoustic.reporting.sections.folding import chosen
from tdacoustic.reporting.sections.order_figures import order_words
from tdacoustic.reporting.sections.words import condition_words, joined, slug, source_word
from tdacoustic.reporting.sound_strip import SHOWN_DB, strip_of
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

__all__ = ["listening"]

Array = NDArray[np.float64]
Encoding = tuple[Array, float, Literal["whole", "tone"]]

MOST_NAMED: Final = 12
"""Conditions without an excerpt that are named in sight."""
IN_SIGHT: Final = 3
"""Conditions that stand one below the other; of more the reader chooses one."""
SWITCHED_S: Final = 1.0
"""Time after which the order is taken out and put back."""
RAMP_S: Final = 0.04
HEADPHONES_HZ: Final = 200.0
"""Below, the loudspeakers of a portable computer play next to nothing [assumed]."""
FAR_BELOW_DB: Final = 20.0
"""Below the whole, by more than which an order alone is raised, in steps of `STEP_DB`."""
STEP_DB: Final = 6.0
OVER_ORDER: Final = 2.5
"""Height of the strip over the order's highest frequency."""
STRIP_HZ: Final = (500.0, 5000.0)
"""Height of the strip at least, and without an order."""

NO_ENCODER = mark(
    "There are excerpts, but the installed libsndfile writes no MP3 (1.1 and later do): nothing can be played."
)
HOW = mark(
    "“As recorded” is what the microphone picked up. “alone” is the order by itself, so that the ear knows what to "
    "listen for. “off and on” is the recording with the order taken out every other second: what changes is the order. "
    "Changing from one to another keeps the place; a click in the picture goes there. The order is extracted by a "
    "Vold-Kalman filter of two poles along the frequency that the analysis found, so what lies within its bandwidth "
    "beside the order is heard with it."
)


def listening(analysis: Analysis) -> Section | None:
    """Return the section on what can be heard; None where nothing was asked for or no run has sound."""
    found = analysis.listening
    if found is None or not found.sounds:
        return None
    if not can_encode():
        return Section("listening", say("To listen to"), [Notice("info", say(NO_ENCODER))])
    blocks: list[Block] = [*_whose(analysis, found)]
    raised = [_raised_db(sound) for sound in found.sounds]
    parts = [_parts(sound, by_db) for sound, by_db in zip(found.sounds, raised, strict=True)]
    if not any(np.any(samples) for part in parts for samples, _, _ in part):
        return Section("listening", say("To listen to"), [Paragraph(say("All excerpts are silent."))])
    played = played_alike([item for part in parts for item in part], round(found.sounds[0].excerpt.sample_rate_hz))
    blocks.append(Paragraph(_gain_words(played.full_scale_db)))
    mp3 = iter(played.mp3)
    heard = [
        _sound(analysis, sound, by_db, [next(mp3) for _ in part])
        for sound, by_db, part in zip(found.sounds, raised, parts, strict=True)
    ]
    views = [(sound.condition, [block]) for sound, block in zip(found.sounds, heard, strict=True)]
    blocks += chosen(say("Condition"), views) if len(heard) > IN_SIGHT else heard
    how = say("How to listen, how the orders were extracted, and why these seconds")
    blocks.append(Details(how, [Paragraph(say(HOW)), _table(analysis, found, raised)]))
    blocks += _left_out(found)
    return Section("listening", say("To listen to"), blocks)


def _whose(analysis: Analysis, found: Listening) -> list[Block]:
    """What is heard, and of whom."""
    if analysis.campaign.origin == "synthetic":
        return [Notice("synthetic", say("These sounds were made by a program. No microphone recorded them."))]
    names = joined(sorted({sound.excerpt.channel for sound in found.sounds}))
    text = say(
        "These are recordings of {names}: who spoke near the microphone then is heard in them, "
        "wherever this report goes. sound_excerpts = false under [analysis] of the campaign "
        "leaves them out.",
        names=names,
    )
    return [Notice("info", text)]


def _gain_words(full_scale_db: float) -> str:
    return say(
        "All are played with one gain, so that loudness compares from condition to condition: "
        "full scale is a peak of {peak:.0f} dB re 20 µPa, and a sine of "
        "{sine:.0f} dB would reach it. Set the volume once, at the loudest, and leave "
        "it. In the pictures the order lies between the dashed lines; their colours span "
        "{span:.0f} dB.",
        peak=full_scale_db,
        sine=full_scale_db - 3.0,
        span=SHOWN_DB,
    )


# ---------------------------------------------------------------- what is played


def _raised_db(sound: ConditionSound) -> float:
    """Steps by which an order alone is raised, where it would hardly be heard."""
    order = sound.excerpt.order
    if order is None or not order.rms > 0.0 or not sound.excerpt.rms > 0.0:
        return 0.0
    below_db = 20.0 * math.log10(sound.excerpt.rms / order.rms) - FAR_BELOW_DB
    return STEP_DB * math.ceil(below_db / STEP_DB) if below_db > 0.0 else 0.0


def _parts(sound: ConditionSound, raised_db: float) -> list[Encoding]:
    """The excerpt, the order alone, and the excerpt with the order off and on."""
    excerpt = sound.excerpt
    whole = np.asarray(excerpt.samples, dtype=np.float64)
    if excerpt.order is None or not np.any(excerpt.order.samples):
        return [(whole, 0.0, "whole")]
    alone = np.asarray(excerpt.order.samples, dtype=np.float64)
    switched = whole - _off(whole.size, excerpt.sample_rate_hz) * alone
    return [(whole, 0.0, "whole"), (alone, raised_db, "tone"), (switched, 0.0, "whole")]


def _off(count: int, rate_hz: float) -> Array:
    """1 while the order is taken out, 0 else, with ramps between."""
    times = np.arange(count) / rate_hz
    place = np.mod(times, 2.0 * SWITCHED_S)  # taken out over the second half
    rise = np.clip((place - SWITCHED_S) / RAMP_S + 0.5, 0.0, 1.0)
    late = np.clip((2.0 * SWITCHED_S - place) / RAMP_S + 0.5, 0.0, 1.0)
    early = np.where(times < SWITCHED_S, 0.0, np.clip(0.5 - place / RAMP_S, 0.0, 1.0))
    return np.asarray(np.maximum(np.minimum(rise, late), early))


def _sound(analysis: Analysis, sound: ConditionSound, raised_db: float, mp3: Sequence[bytes]) -> Sound:
    excerpt, marked = sound.excerpt, sound.marked
    name = "" if marked is None else marked.name
    level = _level(excerpt.rms)
    tracks = [
        SoundTrack(
            say("As recorded"),
            mp3[0],
            say("{level:.1f} dB re 20 µPa, up to {highest:.0f} Hz", level=level, highest=excerpt.highest_hz),
        )
    ]
    if len(mp3) > 1 and excerpt.order is not None:
        own = _level(excerpt.order.rms)
        gain = (
            say("{level:.1f} dB re 20 µPa, played {raised:.0f} dB louder than the others", level=own, raised=raised_db)
            if raised_db
            else say("{level:.1f} dB re 20 µPa, with the same gain", level=own)
        )
        tracks.append(SoundTrack(say("{order} alone", order=name), mp3[1], gain))
        tracks.append(
            SoundTrack(
                say("{order} off and on", order=name),
                mp3[2],
                say("as recorded, without it every other {period:.0f} s", period=SWITCHED_S),
            )
        )
    order = excerpt.order
    line = None if order is None else (order.times_s, order.frequency_hz)
    top = min(excerpt.highest_hz, STRIP_HZ[1] if order is None else _top_hz(order))
    strip = strip_of(
        np.asarray(excerpt.samples, dtype=np.float64),
        excerpt.sample_rate_hz,
        top,
        line,
        _strip_label(marked, order) if marked is not None and order is not None else "",
    )
    return Sound(
        slug("condition", sound.condition),
        condition_words(analysis, sound.condition),
        _caption(sound),
        tracks,
        strip,
        analysis.campaign.origin,
    )


def _top_hz(order: ExtractedOrder) -> float:
    highest = float(np.nanmax(order.frequency_hz, initial=0.0))
    return max(STRIP_HZ[0], 100.0 * math.ceil(OVER_ORDER * highest / 100.0))


def _strip_label(marked: MarkedOrder, order: ExtractedOrder) -> str:
    return f"{marked.name}, {_hz_words(order)}"


def _caption(sound: ConditionSound) -> str:
    excerpt = sound.excerpt
    last = excerpt.first_s + excerpt.duration_s
    parts = [
        say(
            "Run {run}, {channel}, {start:.2f} to {end:.2f} s.",
            run=sound.run,
            channel=excerpt.channel,
            start=excerpt.first_s,
            end=last,
        ),
        _listen_for(sound),
    ]
    if excerpt.n_missing:
        parts.append(
            say_count(
                "{count} sample is missing in the log and is silent here.",
                "{count} samples are missing in the log and are silent here.",
                excerpt.n_missing,
            )
        )
    if sound.doubts:
        parts.append(say("The checks say of this channel: {doubts}.", doubts="; ".join(sound.doubts)))
    return " ".join(parts)


def _listen_for(sound: ConditionSound) -> str:
    marked, order = sound.marked, sound.excerpt.order
    if marked is None:
        return (
            say("Nothing is marked: no order was tracked in it.")
            if sound.sweeps
            else say("Nothing is marked: it has no noise line.")
        )
    name = order_words(marked.name, marked.order) if marked.order is not None else marked.name
    whose = (
        say("{order}, given to the {source}", order=name, source=source_word(marked.source))
        if marked.source
        else say("{order}, whose source is not known", order=name)
    )
    if order is None:
        return say(
            "Listen for {order}; it could not be extracted: {reason}.", order=whose, reason=sound.excerpt.no_order
        )
    below = _level(sound.excerpt.rms) - _level(order.rms)
    words = say(
        "Listen for {order}, {frequency}: {below:.1f} dB below the whole sound.",
        order=whose,
        frequency=_hz_words(order),
        below=below,
    )
    low = float(np.nanmax(order.frequency_hz, initial=0.0)) < HEADPHONES_HZ
    return " ".join([words, *([say("Small loudspeakers do not play so low a tone: use headphones.")] if low else [])])


def _hz_words(order: ExtractedOrder) -> str:
    known = order.frequency_hz[np.isfinite(order.frequency_hz)]
    if not known.size:
        return say("frequency not known")
    if np.ptp(known) < 0.02 * known.mean():
        return f"{known.mean():.0f} Hz"
    return say("{first:.0f} to {last:.0f} Hz", first=known[0], last=known[-1])


def _level(rms: float) -> float:
    level = level_db(rms, "sound_pressure")
    return -math.inf if level is None else level


# ---------------------------------------------------------------- the figures, and what is left out


def _table(analysis: Analysis, found: Listening, raised: Sequence[float]) -> Table:
    rows = []
    for sound, by_db in zip(found.sounds, raised, strict=True):
        excerpt, marked, order = sound.excerpt, sound.marked, sound.excerpt.order
        known = np.zeros(0) if order is None else order.frequency_hz[np.isfinite(order.frequency_hz)]
        rows.append(
            (
                sound.condition,
                sound.run,
                excerpt.channel,
                excerpt.first_s,
                excerpt.duration_s,
                _level(excerpt.rms),
                "" if marked is None else marked.name,
                "" if marked is None else source_word(marked.source) if marked.source else say("not known"),
                float(known.min()) if known.size else None,
                float(known.max()) if known.size else None,
                None if order is None else _level(order.rms),
                None if marked is None or marked.rms is None else _level(marked.rms),
                None if order is None else order.bandwidth_hz,
                None if order is None else by_db,
                "; ".join(sound.choice),
            )
        )
    columns = (
        Column("condition", say("Condition")),
        Column("run", say("Run")),
        Column("channel", say("Microphone")),
        Column("start_s", say("From"), "s", 2, "number"),
        Column("length_s", say("Length"), "s", 2, "number"),
        Column("level_db", say("Level"), "dB re 20 µPa", 1, "number"),
        Column("order", say("Order")),
        Column("source", say("Source")),
        Column("lowest_hz", say("From"), "Hz", 1, "number"),
        Column("highest_hz", say("To"), "Hz", 1, "number"),
        Column("order_level_db", say("Alone"), "dB re 20 µPa", 1, "number"),
        Column("line_level_db", say("In the whole run"), "dB re 20 µPa", 1, "number"),
        Column("bandwidth_hz", say("Filter"), "± Hz", 1, "number"),
        Column("raised_db", say("Raised"), "dB", 0, "number"),
        Column("chosen", say("Why this one")),
    )
    return Table(
        "listening", say("Excerpts and the orders marked in them"), columns, rows, origin=analysis.campaign.origin
    )


def _left_out(found: Listening) -> list[Block]:
    reasons: dict[str, list[str]] = {}
    for condition, why in found.left_out:
        reasons.setdefault(why, []).append(condition)
    if not reasons:
        return []
    said = Sentences(
        [
            say("Without an excerpt: {conditions} ({reason}).", conditions=joined(names), reason=why)
            for why, names in reasons.items()
        ]
    )
    count = len(found.left_out)
    if count <= MOST_NAMED:
        return [said]
    folded = say_count("{count} condition without an excerpt", "{count} conditions without an excerpt", count)
    return [Details(folded, [said])]
