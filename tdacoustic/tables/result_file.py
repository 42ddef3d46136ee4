"""``result.h5``: spectra, floors, bands, lines and speeds of all runs, and the model's arrays, for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tdacoustic.measured.results import ChannelResult, RunMeasurement
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.tables.hdf5_groups import describe, group_of, put
from tdacoustic.tables.prediction_file import ModelArrays, write_model

if TYPE_CHECKING:
    import h5py

__all__ = ["write_result_file"]

PREDICTION = "prediction"


def write_result_file(
    path: Path, name: str, origin: str, runs: Sequence[MeasuredRun], model: ModelArrays | None = None
) -> None:
    """Write the arrays of all runs, and those of the model where it was computed.

    Layout: ``/<run>/speed/<channel>`` (time, speed), ``/<run>/channels/<channel>/``
    with ``frequency_hz``, ``density`` (mean square per Hz), ``floor_density``,
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
                _write_run(group, run.measurement)


def _write_run(group: h5py.Group, measurement: RunMeasurement) -> None:
    group.attrs["steady"] = measurement.steady
    for profile in measurement.speed.profiles:
        speed = group_of(group.require_group("speed"), profile.channel)
        speed.attrs["shaft"] = profile.shaft or ""
        put(speed, "time_s", profile.times_s, "s")
        put(speed, "speed", profile.speed, profile.si_symbol)
    channels = group.create_group("channels")
    for result in measurement.channels:
        _write_channel(group_of(channels, result.channel), result)


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
