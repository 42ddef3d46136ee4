"""The picture under a player: what sounds when, over frequency."""

from __future__ import annotations

import io
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.reporting.document import SoundStrip

__all__ = ["SHOWN_DB", "strip_of", "strip_png"]

Array = NDArray[np.float64]

ROWS: Final = 240
"""Lines over frequency, about."""
COLUMNS: Final = 300
SHOWN_DB: Final = 45.0
"""From the darkest to the brightest."""
COLOURS: Final = 64


def strip_of(
    samples: Array, rate_hz: float, highest_hz: float, line: tuple[Array, Array] | None = None, label: str = ""
) -> SoundStrip:
    """Return the strip of a sound.

    Parameters
    ----------
    samples : ndarray, shape (n,)
    rate_hz : float
    highest_hz : float
        Of the picture.
    line : (ndarray, ndarray), optional
        Instants in s and frequencies in Hz of what is marked; NaN where it is not known.
    label : str
        Name of the line.
    """
    from scipy import signal

    length = 2 ** round(math.log2(rate_hz * ROWS / highest_hz))
    length = max(64, min(length, 2 ** int(math.log2(max(64, samples.size // 4)))))
    frequencies, _, density = signal.spectrogram(
        samples, rate_hz, "hann", length, length - max(1, min(length // 2, samples.size // COLUMNS)), scaling="density"
    )
    inside = frequencies <= highest_hz
    level = 10.0 * np.log10(np.maximum(density[inside], 1e-30))
    thin = max(1, level.shape[1] // COLUMNS)
    level = level[:, : level.shape[1] // thin * thin].reshape(level.shape[0], -1, thin).mean(axis=2)
    times, marked = (np.zeros(0), np.zeros(0)) if line is None else line
    return SoundStrip(level, samples.size / rate_hz, highest_hz, tuple(times), tuple(marked), label)


def strip_png(strip: SoundStrip) -> bytes:
    """Return the picture of a strip, time to the right, frequency upwards, without axes."""
    from matplotlib import colormaps
    from PIL import Image

    level = np.asarray(strip.level_db)
    share = np.clip(1.0 + (level - level.max()) / SHOWN_DB, 0.0, 1.0)
    indices = np.round(share[::-1] * (COLOURS - 1)).astype(np.uint8)
    picture = Image.fromarray(indices, mode="P")
    colours = colormaps["magma"](np.linspace(0.0, 1.0, COLOURS))[:, :3]
    picture.putpalette(np.round(255.0 * colours).astype(np.uint8).tobytes())
    packed = io.BytesIO()
    picture.save(packed, format="png", compress_level=6)
    return packed.getvalue()
