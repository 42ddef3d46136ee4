"""TDMS of National Instruments, with DAQmx raw data and its scalings."""

from tdacoustic.formats.tdms.reader import scan_file

__all__ = ["scan_file"]
