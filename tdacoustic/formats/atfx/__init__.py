"""ASAM ODS ATFX: an XML file with its component files."""

from tdacoustic.formats.atfx.reader import scan_file

__all__ = ["scan_file"]
