"""``tones.csv`` and ``tonality.csv`` as views of the rated tones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from tdacoustic.measured.tonality import RunTonality, RunTone, SpeedSpan, Tonality
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.tables.schema import COLUMNS

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["tone_tables"]


_WRITTEN_APART = frozenset({"n_spectra", "adjustment_db", "notes", "speed_from", "speed_to", "speed_unit"})


def tone_tables(found: Tonality | None) -> dict[str, pd.DataFrame]:
    """Return ``tones`` and ``tonality`` as frames; none of a campaign without a microphone.

    Parameters
    ----------
    found : Tonality or None
    """
    if found is None or not found.ratings:
        return {}
    return {
        "tones": frame_of("tones", _tone_rows(found.tones)),
        "tonality": frame_of("tonality", _rating_rows(found.ratings)),
    }


def _span(span: SpeedSpan | None) -> Row:
    if span is None:
        return {}
    return {"speed_from": span.low, "speed_to": span.high, "speed_unit": span.unit}


def _tone_rows(tones: tuple[RunTone, ...]) -> Iterator[Row]:
    same = [column for column in COLUMNS["tones"].split() if column not in _WRITTEN_APART]
    for tone in tones:
        row = {key: getattr(tone, key) for key in same}
        yield {**row, "n_spectra": float(tone.n_spectra), "notes": "; ".join(tone.notes), **_span(tone.speed)}


def _rating_rows(ratings: tuple[RunTonality, ...]) -> Iterator[Row]:
    same = [column for column in COLUMNS["tonality"].split() if column not in _WRITTEN_APART]
    for rating in ratings:
        row = {key: getattr(rating, key) for key in same}
        adjustment = None if rating.adjustment_db is None else float(rating.adjustment_db)
        yield {
            **row,
            "adjustment_db": adjustment,
            "n_spectra": float(rating.n_spectra),
            "notes": "; ".join(rating.notes),
            **_span(rating.speed),
        }
