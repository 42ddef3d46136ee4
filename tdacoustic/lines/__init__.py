"""Spectral lines: frequency, level and prominence over a local floor, with uncertainty, and their families."""

from tdacoustic.lines.detection import MAIN_LOBE, Line, find_lines
from tdacoustic.lines.families import Family, find_families
from tdacoustic.lines.floor import local_floor

__all__ = ["MAIN_LOBE", "Family", "Line", "find_families", "find_lines", "local_floor"]
