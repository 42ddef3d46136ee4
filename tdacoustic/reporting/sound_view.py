"""A sound as the template of the page reads it: players, the strip under them, and what is marked there."""

from __future__ import annotations

import base64
import math
from typing import Any, Final

from markupsafe import Markup

from tdacoustic.reporting.document import Sound, SoundStrip
from tdacoustic.reporting.sound_strip import strip_png

__all__ = ["sound_view"]

BESIDE: Final = 2.2
"""Distance of the marks from the line that they enclose, in percent of the strip's height."""


def sound_view(block: Sound, number: int, most: int) -> tuple[int, dict[str, Any]]:
    """Return the bytes of a sound and its view; without players where it is longer than what the page can take.

    Parameters
    ----------
    block : Sound
    number : int
        Of the sound in the page.
    most : int
        Bytes of sound that the page can take.
    """
    tracks = [
        {"label": track.label, "text": track.text, "mp3": Markup(base64.b64encode(track.mp3).decode("ascii"))}
        for track in block.tracks
    ]
    strip = None if block.strip is None else _strip(block.strip)
    size = sum(len(track["mp3"]) for track in tracks) + (0 if strip is None else len(strip["png"]))
    fits = size <= most
    view = {
        "type": "sound",
        "number": number,
        "name": block.name,
        "title": block.title.rstrip("."),
        "caption": block.caption,
        "origin": block.origin,
        "tracks": tracks if fits else [],
        "strip": strip if fits else None,
    }
    return size if fits else 0, view


def _strip(strip: SoundStrip) -> dict[str, Any]:
    """Picture, marks beside the line in percent of width and height, and where its name stands."""
    points = [
        (100.0 * time / strip.duration_s, 100.0 * (1.0 - frequency / strip.highest_hz))
        for time, frequency in zip(strip.times_s, strip.frequency_hz, strict=True)
        if math.isfinite(frequency)
    ]
    marks = [" ".join(f"{x:.2f},{y + way * BESIDE:.2f}" for x, y in points) for way in (-1, 1)] if points else []
    top = min(max(points[-1][1] if points else 0.0, 0.0), 100.0)
    return {
        "png": Markup(base64.b64encode(strip_png(strip)).decode("ascii")),
        "marks": marks,
        "label": strip.label,
        "below": top < 25.0,
        "top": f"{top:.1f}",
        "duration": f"{strip.duration_s:.1f}",
        "highest": f"{strip.highest_hz:.0f} " if strip.highest_hz < 1000.0 else f"{strip.highest_hz / 1000.0:.3g} k",
    }
