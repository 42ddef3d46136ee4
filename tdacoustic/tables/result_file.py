"""``result.h5``: spectra, floors, bands, lines and speeds of all runs, and the model's arrays, for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from tdacoustic.measured.results import ChannelResult, RunMeasurement
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.tables.hdf5_groups import describe, group_of, put
from tdacoustic.tables.hearing_arrays import write_hearing
from tdacoustic.tables.order_arrays import write_orders
from tdacoustic.tables.prediction_file import ModelArrays, write_model

if TYPE_CHECKING:
    import h5py

    from tdacoustic.attribution import RunSlip
    from tdacoustic.measured.hearing import Hearing
    from tdacoustic.measured.order_results import RunOrders
    from tdacoustic.speed import SpeedProfile

__all__ = ["write_result_file"]

PREDICTION = "prediction"


def write_result_file(
    path: Path,
    name: str,
    origin: str,
    runs: Sequence[MeasuredRun],
    model: ModelArrays | None = None,
    slips: Mapping[str, Sequence[RunSlip]] = MappingProxyType({}),
    orders: Mapping[str, RunOrders] = MappingProxyType({}),
    hearing: Mapping[str, Hearing] = MappingProxyType({}),
) -> None:
    """Write the arrays of all runs, and those of the model where it was computed.

    Layout: ``/<run>/speed/<channel>`` (``time_s``, ``speed`` and, where they are known, its standard ``error``, its
    ``confidence``, and ``unknown_from_s`` and ``unknown_to_s`` of the spans in which it is not known),
    ``/<run>/slip/<shaft's channel>`` (``time_s``, ``slip``, ``error``), ``/<run>/channels/<channel>/`` with
    ``frequency_hz``, ``density`` (mean square per Hz), ``floor_density``,
    ``line_frequency_hz``, ``line_rms``, ``band_hz``, ``band_mean_square``, and for a
    run-up ``map_time_s``, ``map_frequency_hz``, ``map_density``. A ``/`` in a name becomes ``_``,
    with more of them where that name is taken; the attribute ``name`` holds it as it is. The model's arrays stand in
    ``/prediction/``, laid out as `tdacoustic.tables.prediction_file.write_prediction_file` has them in ``/model/``.

    Parameters
    ----------
    path : Path
    name, origin : str
        Of the campaign.
    runs : sequence of MeasuredRun
    model : ModelArrays, optional
    slips : mapping of str to sequence of RunSlip
        By run.
    orders : mapping of str to RunOrders
        By run; ``/<run>/orders/`` as `tdacoustic.tables.order_arrays.write_orders` lays them out.
    hearing : mapping of str to Hearing
        By run; ``/<run>/hearing/`` as `tdacoustic.tables.hearing_arrays.write_hearing` lays it out.
    """
    import h5py

    with h5py.File(path, "w") as file:
        describe(file, name, origin)
        if model is not None:  # before the runs, one of which may be called so
            write_model(file.create_group(PREDICTION), model)
        for run in runs:
            group = group_of(file, run.name)
            group.attrs["condition"] = run.run.condition or ""
            group.attrs["kind"] = run.run.kind
            if run.measurement is not None:
                _write_run(group, run.measurement, slips.get(run.name, ()))
            if run.name in orders:
                write_orders(group, orders[run.name])
            if run.name in hearing:
                write_hearing(group, hearing[run.name])


def _write_run(group: h5py.Group, measurement: RunMeasurement, slips: Sequence[RunSlip]) -> None:
    group.attrs["steady"] = measurement.steady
    for profile in measurement.speed.profiles:
        _write_speed(group_of(group.require_group("speed"), profile.channel), profile)
    for item in slips:
        if item.slip is not None:
            slip = group_of(group.require_group("slip"), item.shaft_channel)
            slip.attrs["train_channel"], slip.attrs["shaft"] = item.train_channel, item.shaft
            put(slip, "time_s", item.slip.times_s, "s")
            put(slip, "slip", item.slip.slip, "1")
            if item.slip.error is not None:
                put(slip, "error", item.slip.error, "1")
    channels = group.create_group("channels")
    for result in measurement.channels:
        _write_channel(group_of(channels, result.channel), result)


def _write_speed(group: h5py.Group, profile: SpeedProfile) -> None:
    group.attrs["shaft"], group.attrs["source"] = profile.shaft or "", profile.source
    put(group, "time_s", profile.times_s, "s")
    put(group, "speed", profile.speed, profile.si_symbol)
    if profile.error is not None:
        put(group, "error", profile.error, profile.si_symbol)
    if profile.confidence is not None:
        put(group, "confidence", profile.confidence, "1")
    if profile.unknown:
        put(group, "unknown_from_s", [first for first, _, _ in profile.unknown], "s")
        put(group, "unknown_to_s", [last for _, last, _ in profile.unknown], "s")


def _write_channel(group: h5py.Group, result: ChannelResult) -> None:
    group.attrs["usable"] = result.usable
    group.attrs["rms"] = result.rms
    spectrum = result.spectrum
    if spectrum is not None:
        unit = f"({spectrum.si_symbol})^2/Hz"
        group.attrs["quantity"] = spectrum.quantity
        group.attrs["noise_bandwidth_hz"] = spectrum.noise_bandwidth_hz
        group.attrs["averages"] = spectrum.averages
        put(group, "frequency_hz", spectrum.frequencies_hz, "Hz")
        put(group, "density", spectrum.density, unit)
        if result.floor is not None:
            put(group, "floor_density", result.floor, unit)
        put(group, "line_frequency_hz", [line.frequency_hz for line in result.lines], "Hz")
        put(group, "line_rms", [line.rms for line in result.lines], spectrum.si_symbol)
    if result.bands:
        put(group, "band_hz", [band.nominal_hz for band in result.bands], "Hz")
        put(group, "band_mean_square", [band.mean_square for band in result.bands], "SI^2")
    if result.map is not None:
        put(group, "map_time_s", result.map.times_s, "s")
        put(group, "map_frequency_hz", result.map.frequencies_hz, "Hz")
        put(group, "map_density", result.map.density, "SI^2/Hz")
