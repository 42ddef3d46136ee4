"""Maps, cuts, tracks and synchronous averages of the orders in ``result.h5``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tdacoustic.measured.order_results import Average, ChannelOrders, LevelMap, RunOrders, Track
from tdacoustic.tables.hdf5_groups import group_of, put

if TYPE_CHECKING:
    import h5py

__all__ = ["write_orders"]


def write_orders(group: h5py.Group, orders: RunOrders) -> None:
    """Write the orders of a run into its group, as ``orders/<channel>/``.

    Maps: ``order_map_over_speed``, ``order_map_over_time``, ``frequency_map_over_speed``, each with ``axis``,
    ``time_s``, ``speed_hz`` and ``mean_square``. Tracks: ``track_<n>`` with ``time_s``, ``real``, ``imaginary`` (rms)
    and ``error``. Averages: ``average_<shaft>`` with ``turn``, ``waveform`` and ``error``. Orders and speeds are of the
    shaft in the attribute ``shaft``.

    Parameters
    ----------
    group : h5py.Group
    orders : RunOrders
    """
    held = group.create_group("orders")
    held.attrs["shaft"] = orders.shaft
    held.attrs["speed_source"] = orders.speed_source
    held.attrs["requested_bandwidth_orders"] = orders.requested_bandwidth
    held.attrs["bandwidth_orders"] = orders.bandwidth
    for channel in orders.channels:
        _write_channel(group_of(held, channel.channel), channel)


def _write_channel(group: h5py.Group, channel: ChannelOrders) -> None:
    for item in channel.maps:
        _write_map(group.create_group(f"{item.domain}_map_over_{item.over}"), item)
    for number, track in enumerate(channel.tracks, start=1):
        _write_track(group.create_group(f"track_{number}"), track)
    for average in channel.averages:
        _write_average(group_of(group, f"average_{average.shaft}"), average)


def _write_map(group: h5py.Group, item: LevelMap) -> None:
    group.attrs["resolution"] = item.resolution
    group.attrs["noise_bandwidth"] = item.noise_bandwidth
    put(group, "axis", item.axis, "1" if item.domain == "order" else "Hz")
    put(group, "time_s", item.times_s, "s")
    put(group, "speed_hz", item.speeds_hz, "1/s")
    put(group, "mean_square", item.mean_square, "SI^2")


def _write_track(group: h5py.Group, track: Track) -> None:
    group.attrs["name"] = track.order.name
    group.attrs["order"] = track.order.order
    group.attrs["bandwidth_hz"] = track.bandwidth_hz
    put(group, "time_s", track.times_s, "s")
    put(group, "speed_hz", track.speeds_hz, "1/s")
    put(group, "real", track.amplitude.real, "SI")
    put(group, "imaginary", track.amplitude.imag, "SI")
    put(group, "error", track.error, "SI")
    put(group, "reason", track.reason, "1")


def _write_average(group: h5py.Group, average: Average) -> None:
    group.attrs["turns_averaged"] = average.periods
    group.attrs["speed_hz"] = average.speed_hz
    group.attrs["residual_mean_square"] = average.residual_mean_square
    put(group, "turn", np.arange(average.waveform.size) / average.waveform.size, "1")
    put(group, "waveform", average.waveform, "SI")
    put(group, "error", average.error, "SI")
