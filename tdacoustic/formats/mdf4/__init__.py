"""MDF 4 (ASAM), the logs of vehicle test equipment; its `reader` says what is read and what is not."""

from tdacoustic.formats.mdf4.reader import scan_file

__all__ = ["scan_file"]
