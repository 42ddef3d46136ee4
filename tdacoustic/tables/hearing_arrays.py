"""Levels over time and tonal audibility over time in ``result.h5``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tdacoustic.measured.hearing import Hearing
from tdacoustic.tables.hdf5_groups import group_of, put

if TYPE_CHECKING:
    import h5py

__all__ = ["HEARING", "write_hearing"]

HEARING: Final = "hearing"


def write_hearing(run: h5py.Group, hearing: Hearing) -> None:
    """Write what was heard in a run, microphone by microphone.

    Layout: ``hearing/<channel>/`` with ``level_time_s`` (end of each interval), the A-weighted ``mean_square`` of each
    interval, ``fast`` and ``slow`` (time weightings F and S at its end) and ``fast_max`` (the largest within it); and
    ``hearing/<channel>/<method>/`` with ``time_s`` (start of each short-time spectrum), its ``audibility_db`` and
    ``tone_hz``, the tone that it is of (NaN where none is audible). Times count from the run's common start.

    Parameters
    ----------
    run : h5py.Group
    hearing : Hearing
    """
    heard = run.create_group(HEARING)
    for raster in hearing.rasters:
        for place, name in enumerate(raster.channels):
            group = group_of(heard, name)
            levels = raster.levels
            if levels is not None:
                put(group, "level_time_s", raster.start_s + levels.ends_s, "s")
                for key in ("mean_square", "fast", "slow", "fast_max"):
                    put(group, key, getattr(levels, key)[place], "Pa^2")
            for rated in raster.audibility:
                if rated.channel == name:
                    method = group_of(group, rated.method)
                    put(method, "time_s", raster.start_s + rated.starts_s, "s")
                    put(method, "audibility_db", rated.decisive_db, "dB")
                    put(method, "tone_hz", rated.decisive_hz, "Hz")
