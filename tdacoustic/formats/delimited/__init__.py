"""CSV, TSV and other texts of numbers in columns."""

from tdacoustic.formats.delimited.reader import scan_file

__all__ = ["scan_file"]
