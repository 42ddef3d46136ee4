"""Universal file, data sets 58 and 58b."""

from tdacoustic.formats.uff58.reader import scan_file

__all__ = ["scan_file"]
