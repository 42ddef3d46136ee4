"""File formats: one module each, one row of a table each, one type out.

`scan` reads headers only and returns a `tdacoustic.recording.Log`, whose reader
yields the samples in blocks.
"""

from tdacoustic.formats.table import FORMATS, Format, formats, scan

__all__ = ["FORMATS", "Format", "formats", "scan"]
