"""What a log becomes: channels on rasters, in SI, readable in blocks."""

from tdacoustic.recording.log import Log, LogChannel, Reader
from tdacoustic.recording.raster import Raster
from tdacoustic.recording.recording import Channel, Recording, span_of

__all__ = ["Channel", "Log", "LogChannel", "Raster", "Reader", "Recording", "span_of"]
