"""WAV (RIFF, RIFX, RF64, BW64) and FLAC.

The chunks are walked here (`tdacoustic.formats.audio.riff`), so that the size which the
header claims is compared with what the file holds; the samples are decoded by
`soundfile`. Integer samples are fractions of full scale. Calibration is not in
the file, unless the vendor chunk ``LEA `` is there.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.audio.riff import WaveHeader, parse_lea, read_wave_header, start_time_of_bext
from tdacoustic.formats.blocks import check_request, spans, unique_names
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["AudioReader", "PcmLayout", "scan_file"]

SLAB_VALUES = 1 << 17
MAX_RATE_HZ = 2**31 - 1
PCM_TAG, FLOAT_TAG = 1, 3
SUBTYPES = {
    (PCM_TAG, 1): "PCM_U8",
    (PCM_TAG, 2): "PCM_16",
    (PCM_TAG, 3): "PCM_24",
    (PCM_TAG, 4): "PCM_32",
    (FLOAT_TAG, 4): "FLOAT",
    (FLOAT_TAG, 8): "DOUBLE",
    (6, 1): "ALAW",
    (7, 1): "ULAW",
}
"""Format tag and bytes a value -> soundfile's name for the encoding."""


@dataclass(frozen=True)
class PcmLayout:
    """Where the samples of a WAV file lie, and how they are encoded."""

    offset: int
    size: int
    subtype: str
    endian: str
    sample_rate_hz: int


class _Section(io.RawIOBase):
    """A part of an open file, as a file of its own."""

    def __init__(self, stream: BinaryIO, offset: int, size: int) -> None:
        self._stream, self._offset, self._size, self._position = stream, offset, size, 0

    def seekable(self) -> bool:
        return True

    def readable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._position

    def seek(self, offset: int, whence: int = 0) -> int:
        self._position = offset + (0, self._position, self._size)[whence]
        return self._position

    def readinto(self, buffer: Any) -> int:
        room = memoryview(buffer)[: max(0, self._size - self._position)]
        self._stream.seek(self._offset + self._position)
        count: int = self._stream.readinto(room)  # type: ignore[attr-defined]
        self._position += count
        return count


@dataclass(frozen=True)
class AudioReader:
    """Reads blocks of a WAV or FLAC file.

    Parameters
    ----------
    path : Path
    n_channels, n_samples : int
    scale : tuple of float
        Factor of each channel.
    pcm : PcmLayout or None
        None where soundfile finds the samples itself (FLAC, compressed WAV).
    """

    path: Path
    n_channels: int
    n_samples: int
    scale: tuple[float, ...]
    pcm: PcmLayout | None = None

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            The file ends before `stop`, or is damaged.
        """
        import soundfile

        check_request(self.path, self.n_samples, start, stop, block_size)
        chosen = list(columns)
        scale = np.array([self.scale[column] for column in chosen])[:, np.newaxis]
        scaled = bool(np.any(scale != 1.0))
        slab = max(1, SLAB_VALUES // self.n_channels)
        position = start
        try:
            with self.path.open("rb") as stream, self._open(stream) as sound:
                if sound.channels != self.n_channels:
                    raise FormatError(
                        f"{self.path}: the file has {sound.channels} channels, and had {self.n_channels} when it was "
                        "scanned"
                    )
                sound.seek(start)
                for first, last in spans(start, stop, block_size):
                    block = np.empty((len(chosen), last - first))
                    for position, end in spans(first, last, slab):
                        values = sound.read(end - position, dtype="float64", always_2d=True)
                        if len(values) != end - position:
                            raise FormatError(
                                f"{self.path}: truncated: the file ends at sample {position + len(values)} "
                                f"of {self.n_samples}"
                            )
                        for row, column in enumerate(chosen):
                            block[row, position - first : end - first] = values[:, column]
                    if scaled:
                        block *= scale
                    yield block
        except soundfile.SoundFileError as error:
            raise FormatError(
                f"{self.path}: truncated or damaged at or after sample {position} of {self.n_samples}"
                f" ({str(error).strip() or 'decoder error'})"
            ) from error

    def _open(self, stream: BinaryIO) -> Any:
        import soundfile

        if self.pcm is None:
            return soundfile.SoundFile(stream)
        return soundfile.SoundFile(
            _Section(stream, self.pcm.offset, self.pcm.size),
            format="RAW",
            subtype=self.pcm.subtype,
            endian=self.pcm.endian,
            channels=self.n_channels,
            samplerate=min(self.pcm.sample_rate_hz, MAX_RATE_HZ),
        )


def scan_file(path: Path) -> Log:
    """Read the headers of a WAV or FLAC file.

    Returns
    -------
    Log
        Channels ``ch1``, ``ch2``, ... in fractions of full scale, or what a ``LEA `` chunk calls them, in its units.

    Raises
    ------
    FormatError
        Truncated, damaged, without samples, or of an unknown encoding.
    """
    with path.open("rb") as stream:
        magic = stream.read(4)
    return _scan_flac(path) if magic == b"fLaC" else _scan_wave(path)


def _scan_wave(path: Path) -> Log:
    header = read_wave_header(path)
    subtype = _subtype(header)
    if subtype is None:
        _refuse_contradiction(path, header)
        reader = _library_reader(path, header)
        bits = None
    else:
        n_samples, rest = divmod(header.data_size, header.block_align)
        if rest:
            header.flags.append(f"the data end in the middle of a sample: {rest} bytes are left over")
        pcm = PcmLayout(
            header.data_offset,
            n_samples * header.block_align,
            subtype,
            "BIG" if header.byte_order == ">" else "LITTLE",
            header.sample_rate_hz,
        )
        reader = AudioReader(path, header.n_channels, n_samples, (1.0,) * header.n_channels, pcm)
        bits = header.valid_bits if header.format_tag == PCM_TAG else None
    channels, scale, flags = _channels(path, header, reader.n_samples, bits)
    bext = header.kept.get(b"bext", b"")
    description = bext[:256].split(b"\x00")[0].decode("latin-1").strip()
    return Log(
        path,
        "audio",
        channels,
        AudioReader(path, reader.n_channels, reader.n_samples, scale, reader.pcm),
        start_time=start_time_of_bext(bext),
        flags=tuple(flags),
        metadata=(
            ("encoding", subtype or f"WAV format {header.format_tag}"),
            *((("description", description),) if description else ()),
        ),
    )


def _subtype(header: WaveHeader) -> str | None:
    width, rest = divmod(header.block_align, header.n_channels)
    return None if rest else SUBTYPES.get((header.format_tag, width))


def _refuse_contradiction(path: Path, header: WaveHeader) -> None:
    """Raise where an encoding of fixed size has samples of another: the library would pick one of both."""
    if header.format_tag in {tag for tag, _ in SUBTYPES}:
        raise FormatError(
            f"{path}: damaged fmt chunk: {header.n_channels} channels of {header.bits} bits cannot take "
            f"{header.block_align} bytes a sample of all channels"
        )


def _library_reader(path: Path, header: WaveHeader) -> AudioReader:
    """Return a reader for an encoding in which a sample has no fixed place (ADPCM and the like)."""
    import soundfile

    try:
        info = soundfile.info(str(path))
    except soundfile.SoundFileError as error:
        raise FormatError(f"{path}: WAV format {header.format_tag} with {header.bits} bits cannot be read") from error
    if info.channels != header.n_channels:
        raise FormatError(
            f"{path}: damaged fmt chunk: it says {header.n_channels} channels, "
            f"WAV format {header.format_tag} in it has {info.channels}"
        )
    return AudioReader(path, info.channels, info.frames, (1.0,) * info.channels)


def _channels(
    path: Path, header: WaveHeader, n_samples: int, bits: int | None
) -> tuple[tuple[LogChannel, ...], tuple[float, ...], list[str]]:
    """Return the channels, their factors, and what is odd about the file."""
    if n_samples == 0:
        raise FormatError(f"{path}: the file holds no samples")
    flags = list(header.flags)
    raster = Raster(float(header.sample_rate_hz), n_samples)
    limits = None if bits is None else (-1.0, 1.0 - 2.0 ** (1 - bits))
    body = header.kept.get(b"LEA ")
    lea = None if body is None else parse_lea(body, header.n_channels)
    if lea is None:
        if body is not None:
            flags.append("the chunk 'LEA' is damaged: its names, units and full scales are not used")
        return _nameless(header.n_channels, raster, limits), (1.0,) * header.n_channels, flags
    names, name_flags = unique_names([entry.name or f"ch{index}" for index, entry in enumerate(lea, 1)])
    channels = tuple(
        LogChannel(
            name,
            raster,
            unit=entry.unit or None,
            quantity=quantity_of_unit(entry.unit),
            full_scale=None if entry.unit else entry.full_scale,
            limits=None if limits is None else (limits[0] * entry.full_scale, limits[1] * entry.full_scale),
            flags=() if flag is None else (flag,),
        )
        for name, flag, entry in zip(names, name_flags, lea, strict=True)
    )
    return channels, tuple(entry.full_scale for entry in lea), flags


def _nameless(n_channels: int, raster: Raster, limits: tuple[float, float] | None) -> tuple[LogChannel, ...]:
    return tuple(LogChannel(f"ch{index}", raster, full_scale=1.0, limits=limits) for index in range(1, n_channels + 1))


def _scan_flac(path: Path) -> Log:
    import soundfile

    try:
        with soundfile.SoundFile(str(path)) as sound:
            n_channels, n_samples, rate, subtype = sound.channels, sound.frames, sound.samplerate, sound.subtype
            if 0 < n_samples < 1 << 40:
                sound.seek(n_samples - 1)
                if len(sound.read(1)) != 1:
                    raise FormatError(f"{path}: truncated: the last of {n_samples} claimed samples is not there")
    except soundfile.SoundFileError as error:
        reason = str(error).strip() or "the decoder does not reach its last sample"
        raise FormatError(f"{path}: truncated or damaged FLAC file ({reason})") from error
    if not 0 < n_samples < 1 << 40:
        raise FormatError(f"{path}: the FLAC header does not say how many samples there are; write the file anew")
    bits = {"PCM_S8": 8, "PCM_16": 16, "PCM_24": 24}.get(subtype)
    limits = None if bits is None else (-1.0, 1.0 - 2.0 ** (1 - bits))
    return Log(
        path,
        "audio",
        _nameless(n_channels, Raster(float(rate), n_samples), limits),
        AudioReader(path, n_channels, n_samples, (1.0,) * n_channels),
        metadata=(("encoding", f"FLAC {subtype}"),),
    )
