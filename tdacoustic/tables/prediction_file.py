"""``result.h5`` of the modelled side: waveforms, forces and stiffness, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tdacoustic.drive import GearState, Prediction
from tdacoustic.gears import DIRECTIONS, GEARS, sampling_points
from tdacoustic.tables.hdf5_groups import SCHEMA, group_of, put

if TYPE_CHECKING:
    import h5py

__all__ = ["write_prediction_file"]

STIFFNESS_SAMPLES = 512


def write_prediction_file(path: Path, name: str, prediction: Prediction, highest_hz: float) -> None:
    """Write the arrays of a prediction.

    Layout: ``/model/mesh/`` with ``time_mesh_periods``, ``stiffness``, ``transmission_error``, and for each condition
    ``/model/conditions/<name>/`` with ``displacement`` (mesh periods x samples), ``line_frequency_hz``,
    ``line_harmonic`` (NaN where it is none), ``force_amplitude`` and ``force_phase`` (gear x direction x line),
    ``mean_force``, and the spectrum at sampling points: ``point_frequency_hz``, ``point_force``. The attributes
    ``gears`` and ``directions`` name the rows. Names as in `tdacoustic.tables.result_file.write_result_file`.

    Parameters
    ----------
    path : Path
    name : str
        Of the fleet.
    prediction : Prediction
    highest_hz : float
        Up to which the spectrum is sampled.
    """
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["schema"] = SCHEMA
        file.attrs["name"] = name
        file.attrs["origin"] = "calculated"
        model = file.create_group("model")
        model.attrs["gears"] = list(GEARS)
        model.attrs["directions"] = list(DIRECTIONS)
        mesh, system = model.create_group("mesh"), prediction.unit.system
        time = np.arange(STIFFNESS_SAMPLES) / STIFFNESS_SAMPLES
        put(mesh, "time_mesh_periods", time, "1")
        put(mesh, "stiffness", system.mesh_stiffness_n_per_m * system.contact_lines.relative(time), "N/m")
        put(mesh, "transmission_error", system.transmission_error_at(time), "m")
        conditions = model.create_group("conditions")
        for state in prediction.conditions:
            _write_condition(group_of(conditions, state.condition.name), state, highest_hz)


def _write_condition(group: h5py.Group, state: GearState, highest_hz: float) -> None:
    steady, forces = state.steady, state.forces
    group.attrs["mesh_frequency_hz"] = state.mesh_hz
    group.attrs["torque_n_m"] = state.condition.torque_n_m
    group.attrs["method"] = steady.method
    group.attrs["periodic"] = steady.is_periodic
    put(group, "displacement", steady.waveform_m, "m")
    put(group, "line_frequency_hz", forces.frequency_hz, "Hz")
    put(group, "line_harmonic", forces.harmonic, "1")
    put(group, "force_amplitude", np.abs(forces.amplitude_n), "N")
    put(group, "force_phase", np.angle(forces.amplitude_n), "rad")
    put(group, "mean_force", forces.mean_n, "N")
    points = sampling_points(state.mesh_hz, max(highest_hz, 2.0 * state.mesh_hz))
    put(group, "point_frequency_hz", points, "Hz")
    put(group, "point_force", forces.sampled_n(points), "N")
