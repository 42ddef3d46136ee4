"""MATLAB: MAT-files of level 4, 5 (-v6, -v7) and 7.3."""

from tdacoustic.formats.matlab.reader import scan_file

__all__ = ["scan_file"]
