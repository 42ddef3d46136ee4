"""MAT-files: what is in them, and which reader reads it.

Real numeric vectors of at least two samples are channels, and matrices, one
channel a column, with time along the longer axis. Names are paths
(``bearing.gs``, ``data.acc[2]``). Numbers and texts are shown as header fields.
The sampling rate is that of a number with a usual name beside the array or in a
structure above it, or of an equidistant time vector; where there is none, or
they disagree, the campaign is asked for it.

A file of level 5 is scanned without reading samples, with one exception: in a
packed structure what lies behind the samples, and the time vector of a packed
file, are only found by unpacking what is before. That takes the time of one
unpacking of that variable (some 300 MB of values a second), and no memory.
"""

from __future__ import annotations

from pathlib import Path

from tdacoustic.errors import FormatError
from tdacoustic.formats.matlab import level4, level5
from tdacoustic.formats.matlab.channels import channels_of
from tdacoustic.formats.matlab.values import MatReader, Source
from tdacoustic.formats.matlab.workspace import Workspace
from tdacoustic.recording import Log, LogChannel
from tdacoustic.recording.log import Reader

__all__ = ["scan_file", "scan_hdf5_here"]

HEAD_BYTES = 520
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


def scan_file(path: Path) -> Log:
    """Walk the variables of a MAT-file.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        Truncated, damaged, or without any array that could be a channel.
    """
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
        if head[512:520] == HDF5_MAGIC or head[:10] == b"MATLAB 7.3":
            return _scan_hdf5(path)
        if level4.is_level4(head):
            workspace = level4.read_workspace(path, stream)
        else:
            workspace = level5.read_workspace(path, stream)
        channels, chosen = channels_of(workspace)
        sources = tuple(Source(one.array.key, one.time_axis, one.column, one.scale) for one in chosen)
    return _log(path, workspace, channels, MatReader(path, sources))


def _scan_hdf5(path: Path) -> Log:
    from tdacoustic.formats.hdf5 import guard

    guard.examine(path, "matlab")
    return scan_hdf5_here(path)


def scan_hdf5_here(path: Path) -> Log:
    """Do what `scan_file` does for level 7.3, in this process and without a guard."""
    from tdacoustic.formats.hdf5.reader import Hdf5Reader, opened
    from tdacoustic.formats.hdf5.reader import Source as Hdf5Source
    from tdacoustic.formats.matlab import level73

    with path.open("rb") as stream:
        text = level73.checked_header(path, stream.read(HEAD_BYTES))
    with opened(path) as file:
        workspace = level73.read_workspace(file)
        workspace.metadata.append(("header", text))
        channels, chosen = channels_of(workspace)
        sources = []
        for one in chosen:
            flat = file[one.array.key].ndim == 1
            axis, column = (0, None) if flat else (1 - one.time_axis, one.column)
            sources.append(Hdf5Source(one.array.key, one.array.shape[one.time_axis], axis, column, one.scale))
    return _log(path, workspace, channels, Hdf5Reader(path, tuple(sources)))


def _log(path: Path, workspace: Workspace, channels: tuple[LogChannel, ...], reader: Reader) -> Log:
    flags = workspace.all_flags()
    if not channels:
        reasons = "; ".join(flags) or "no variable of at least two numbers is in it"
        raise FormatError(f"{path}: no array that could be a channel: {reasons}")
    return Log(path, "matlab", channels, reader, flags=flags, metadata=workspace.header_fields())
