"""What a log may claim, whatever its format: how many channels and samples, and words that are safe to show.

A log comes from outside. Each reader bounds what it takes from its own headers; this is done once for all of them,
those of other packages too, before anything else sees the log: what is read of it, and what is said of it in errors.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import unique_names
from tdacoustic.recording import Log, LogChannel
from tdacoustic.recording.log import Reader

__all__ = [
    "MAX_CHANNELS",
    "MAX_MESSAGE",
    "MAX_NAME",
    "MAX_UNIT",
    "ClearReader",
    "bounded",
    "clean_text",
    "clear_message",
    "clear_messages",
]

MAX_CHANNELS: Final = 10_000
"""Channels that a log may have; what is above is taken for damage [assumed]."""

MAX_NAME: Final = 200
MAX_UNIT: Final = 64
MAX_FLAG: Final = 600
MAX_FLAGS: Final = 50
MAX_METADATA: Final = 200
MAX_METADATA_TEXT: Final = 1000
MAX_MESSAGE: Final = 1200
KEPT_END: Final = 400
"""A message that is too long loses its middle: the file is named at its begin, the reason often at its end."""

MAX_SAMPLES_PER_BYTE: Final = 20_000
"""No packing that is read reaches this: deflate makes at most 1032 bytes of one, FLAC of silence some 10 000 values."""

SAMPLES_ALWAYS_ALLOWED: Final = 10_000_000
"""Few enough to be read whatever the file's size."""

NOTABLE_SAMPLES_PER_BYTE: Final = 100
"""More than a recording of anything but silence packs to [assumed]."""

_INVISIBLE: Final = frozenset("\u00ad\u061c\u180e\u200b\u200e\u200f\u2060\ufeff") | {
    chr(code) for code in (*range(0x202A, 0x202F), *range(0x2066, 0x2070), *range(0xFFF9, 0xFFFC))
}
"""Overrides of the direction of writing, and signs without a picture; the joiners of Persian and Indic stay."""


def clean_text(text: str, longest: int) -> str:
    r"""Return a text without control characters, overrides of direction and line breaks, of bounded length.

    Blanks of any kind become one space each, what has no place in a name U+FFFD; what is too long ends in ``...``.

    Examples
    --------
    >>> clean_text("Mic\t\u202e1\x00", 20)
    'Mic \ufffd1\ufffd'
    >>> clean_text("abcdefgh", 6)
    'abc...'
    """
    cut = text[: longest + 1]
    if not cut.isprintable():
        cut = "".join(_shown(character) for character in cut)
    return cut if len(text) <= longest else cut[: longest - 3] + "..."


def _shown(character: str) -> str:
    if character in "\t\r\n\v\f\x85\u2028\u2029":
        return " "
    category = unicodedata.category(character)
    if category in ("Cc", "Cs", "Cn") or character in _INVISIBLE or 0xE0000 <= ord(character) <= 0xE007F:
        return "\ufffd"
    return character


def clear_message(text: str) -> str:
    r"""Return the message of an error as one line of bounded length, whatever texts of a file stand in it.

    Examples
    --------
    >>> clear_message("a.h5: dataset 'x\x1b[2J' is\n  damaged")
    "a.h5: dataset 'x\ufffd[2J' is damaged"
    """
    if len(text) > MAX_MESSAGE:
        text = f"{text[: MAX_MESSAGE - KEPT_END - 5]} ... {text[-KEPT_END:]}"
    return text if text.isprintable() else " ".join(clean_text(text, MAX_MESSAGE).split())


@contextmanager
def clear_messages() -> Iterator[None]:
    """Make what a `FormatError` says one clear line; it stays the same error."""
    try:
        yield
    except FormatError as error:
        error.args = (clear_message(str(error)),)
        raise


@dataclass(frozen=True)
class ClearReader:
    """A reader whose errors are one clear line each.

    Parameters
    ----------
    reader : Reader
        Of the log's format.
    """

    reader: Reader

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield what the format's reader yields; see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            As the format's reader raises it.
        """
        with clear_messages():
            yield from self.reader.blocks(columns, start, stop, block_size)


def bounded(log: Log) -> Log:
    """Return a log within bounds.

    Names and units are cleaned and cut, which is flagged; a start that is no ISO 8601 moment is left out with a flag.

    Raises
    ------
    FormatError
        More channels than a log may have, more samples than its files can hold, or a file of it outside its folder.
    """
    if len(log.channels) > MAX_CHANNELS:
        raise FormatError(f"{log.path}: {len(log.channels)} channels; a log may have {MAX_CHANNELS}")
    _check_companions(log)
    flags = [*log.flags, *_packing_flags(log)]
    start_time = log.start_time
    if start_time is not None and not _is_moment(start_time):
        flags.append(f"the log's start {clean_text(start_time, 40)!r} is no date and time: it is not used")
        start_time = None
    return replace(
        log,
        channels=_channels(log.channels),
        start_time=start_time,
        flags=_flags(flags),
        metadata=tuple(
            (clean_text(key, MAX_NAME), clean_text(value, MAX_METADATA_TEXT))
            for key, value in log.metadata[:MAX_METADATA]
        ),
    )


def _check_companions(log: Log) -> None:
    """Raise where a further file of a log lies outside the log's own folder, or is none."""
    folders = {log.path.resolve().parent, log.path.parent.resolve()}
    for companion in log.companions:
        if not companion.is_file():
            raise FormatError(f"{log.path}: its file {companion.name!r} is not there, or is no file")
        if not any(companion.resolve().is_relative_to(folder) for folder in folders):
            raise FormatError(f"{log.path}: its file {companion.name!r} lies outside the log's own folder")


def _packing_flags(log: Log) -> list[str]:
    """Say how many values a byte of the file stands for, where that is remarkable.

    Raises
    ------
    FormatError
        It is more than any packing reaches.
    """
    paths = (log.path, *log.companions)
    n_bytes = sum(path.stat().st_size for path in paths if path.is_file())
    n_samples = sum(channel.raster.n_samples for channel in log.channels)
    if n_samples <= NOTABLE_SAMPLES_PER_BYTE * n_bytes or n_samples <= SAMPLES_ALWAYS_ALLOWED // 10:
        return []
    if n_samples > max(SAMPLES_ALWAYS_ALLOWED, MAX_SAMPLES_PER_BYTE * n_bytes):
        raise FormatError(
            f"{log.path}: claims {n_samples} samples in {n_bytes} bytes, more than any packing reaches: damaged, or "
            "made to exhaust the memory"
        )
    return [f"{n_samples} samples are packed in {n_bytes} bytes, {n_samples / n_bytes:.0f} in each: silence, or damage"]


def _channels(channels: tuple[LogChannel, ...]) -> tuple[LogChannel, ...]:
    names = [clean_text(channel.name, MAX_NAME).strip() or f"ch{n}" for n, channel in enumerate(channels, 1)]
    unique, notes = unique_names(names)
    return tuple(_channel(channel, name, note) for channel, name, note in zip(channels, unique, notes, strict=True))


def _channel(channel: LogChannel, name: str, note: str | None) -> LogChannel:
    unit = None if channel.unit is None else clean_text(channel.unit, MAX_UNIT).strip() or None
    flags = [*channel.flags, *(() if note is None else (note,))]
    if name != channel.name:
        flags.append(f"the log's name for it, {len(channel.name)} characters, is shown as {name!r}")
    if unit != channel.unit:
        flags.append(f"the log's unit for it, {len(channel.unit or '')} characters, is shown as {unit!r}")
    return replace(channel, name=name, unit=unit, flags=_flags(flags))


def _flags(flags: list[str]) -> tuple[str, ...]:
    kept = [clean_text(flag, MAX_FLAG) for flag in flags[:MAX_FLAGS]]
    if len(flags) > MAX_FLAGS:
        kept.append(f"and {len(flags) - MAX_FLAGS} more remarks")
    return tuple(kept)


def _is_moment(text: str) -> bool:
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return False
    return text.isprintable() and len(text) <= 40
