"""HDF5, our own layout and others."""

from tdacoustic.formats.hdf5.reader import scan_file

__all__ = ["scan_file"]
