"""Dewesoft DXD and D7D, through the maker's own library; its `reader` says what is verified and what is not."""

from tdacoustic.formats.dewesoft.reader import scan_file

__all__ = ["scan_file"]
