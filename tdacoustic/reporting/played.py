"""Sound as a page plays it: one gain for all that are compared, MP3, and the level that came out of it checked."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.reporting.figure import ReportError

__all__ = ["FADE_S", "HEADROOM_DB", "Played", "can_encode", "encoded", "played_alike"]

Array = NDArray[np.float64]

FADE_S: Final = 0.03
"""Rise and fall at the ends of an excerpt, so that it does not click."""
HEADROOM_DB: Final = 3.0
"""Of the highest peak below full scale: what MP3 may add to it."""
MORE_DB: Final = 10
"""Further headroom that is tried."""
REFERENCE_PA: Final = 2e-5
PROBE_HZ: Final = 1000.0

QUALITY: Final = {"whole": 0.8, "tone": 0.9}
"""Compression of libsndfile, 0 to 1: at 32 kHz and one channel 97 and 57 kbit/s, constant."""


@dataclass(frozen=True)
class Played:
    """Sounds whose loudness compares.

    Parameters
    ----------
    full_scale_db : float
        Level of full scale as a peak, re 20 uPa.
    mp3 : tuple of bytes
        As many as there were sounds.
    """

    full_scale_db: float
    mp3: tuple[bytes, ...]


def can_encode() -> bool:
    """Return whether the installed libsndfile writes MP3 (1.1 and later do)."""
    import soundfile

    return "MP3" in soundfile.available_formats()


def played_alike(sounds: Sequence[tuple[Array, float, Literal["whole", "tone"]]], rate_hz: int) -> Played:
    """Encode sounds with one gain.

    Full scale is a whole number of decibels, `HEADROOM_DB` or more above the highest peak of all; more where what
    comes out of the encoder would still clip.

    Parameters
    ----------
    sounds : sequence of (ndarray, float, str)
        Pa, shape (n,); decibels by which this one is raised over the common gain; ``"tone"`` compresses more than
        ``"whole"``, which has to hold a broad spectrum.
    rate_hz : int
        32000, 44100 or 48000.

    Raises
    ------
    ReportError
        No sound, one that is silent throughout everywhere, or no gain without clipping.
    """
    faded = [
        _faded(np.asarray(samples, dtype=np.float64) * 10.0 ** (raised / 20.0), rate_hz)
        for samples, raised, _ in sounds
    ]
    peak = max((float(np.max(np.abs(samples), initial=0.0)) for samples in faded), default=0.0)
    if not peak > 0.0:
        raise ReportError("there is nothing to hear: all sounds are silent")
    lowest_db = math.ceil(20.0 * math.log10(peak / REFERENCE_PA) + HEADROOM_DB)
    for full_scale_db in range(lowest_db, lowest_db + MORE_DB):
        full_scale_pa = REFERENCE_PA * 10.0 ** (full_scale_db / 20.0)
        coded = [
            encoded(samples / full_scale_pa, rate_hz, QUALITY[kind])
            for samples, (_, _, kind) in zip(faded, sounds, strict=True)
        ]
        if all(highest < 1.0 for _, highest in coded):
            return Played(float(full_scale_db), tuple(mp3 for mp3, _ in coded))
    raise ReportError(f"a sound clips with {HEADROOM_DB + MORE_DB:g} dB of headroom")


def encoded(samples: Array, rate_hz: int, quality: float) -> tuple[bytes, float]:
    """Return a sound as MP3, and the highest peak that a decoder makes of it.

    Encoders turn all sounds down a little, by an amount of their own; it is measured once and made up for.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Of full scale.
    rate_hz : int
    quality : float
        Compression, 0 to 1.
    """
    mp3 = _mp3(samples / _own_gain(rate_hz, quality), rate_hz, quality)
    return mp3, float(np.max(np.abs(_decoded(mp3)), initial=0.0))


@cache
def _own_gain(rate_hz: int, quality: float) -> float:
    """What the encoder multiplies every sound by (LAME: 0.95 or 0.98 at these rates), from a sine that goes through."""
    sine = 0.25 * np.sin(2.0 * np.pi * PROBE_HZ * np.arange(rate_hz) / rate_hz)
    middle = slice(rate_hz // 4, -rate_hz // 4)
    through = _decoded(_mp3(sine, rate_hz, quality))[: sine.size]
    return float(np.dot(sine[middle], through[middle]) / np.dot(sine[middle], sine[middle]))


def _mp3(samples: Array, rate_hz: int, quality: float) -> bytes:
    import soundfile

    held = io.BytesIO()
    soundfile.write(
        held,
        samples.astype(np.float32),
        rate_hz,
        format="MP3",
        subtype="MPEG_LAYER_III",
        compression_level=quality,
        bitrate_mode="CONSTANT",
    )
    return held.getvalue()


def _decoded(mp3: bytes) -> Array:
    import soundfile

    return np.asarray(soundfile.read(io.BytesIO(mp3), dtype="float64")[0])


def _faded(samples: Array, rate_hz: int) -> Array:
    """A copy whose ends rise from zero and fall to it."""
    length = min(round(FADE_S * rate_hz), samples.size // 2)
    rise = np.sin(0.5 * np.pi * (np.arange(length) + 0.5) / max(1, length)) ** 2
    faded = samples.copy()
    faded[:length] *= rise
    faded[samples.size - length :] *= rise[::-1]
    return faded
