"""WAV (RIFF, RIFX, RF64, BW64) and FLAC."""

from tdacoustic.formats.audio.reader import scan_file

__all__ = ["scan_file"]
