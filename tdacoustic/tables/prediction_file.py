"""``result.h5`` of the modelled side: waveforms, forces and stiffness, for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tdacoustic.drive import GearState, Prediction
from tdacoustic.gears import DIRECTIONS, GEARS, sampling_points
from tdacoustic.tables.hdf5_groups import describe, group_of, put
from tdacoustic.tables.insertion_loss import write_insertion_loss
from tdacoustic.tables.near_field import write_near_field

if TYPE_CHECKING:
    import h5py

__all__ = ["ModelArrays", "write_model", "write_prediction_file"]

STIFFNESS_SAMPLES = 512


@dataclass(frozen=True)
class ModelArrays:
    """A prediction as it goes into a file.

    Parameters
    ----------
    name : str
        Of the fleet.
    prediction : Prediction
    highest_hz : float
        Up to which the spectrum of the bearing forces is sampled.
    """

    name: str
    prediction: Prediction
    highest_hz: float


def write_prediction_file(path: Path, model: ModelArrays) -> None:
    """Write the arrays of a prediction.

    Layout: ``/model/mesh/`` with ``time_mesh_periods``, ``stiffness``, ``transmission_error``, and for each condition
    ``/model/conditions/<name>/`` with ``displacement`` (mesh periods x samples), ``line_frequency_hz``,
    ``line_harmonic`` (NaN where it is none), ``force_amplitude`` and ``force_phase`` (gear x direction x line),
    ``mean_force``, and the spectrum at sampling points: ``point_frequency_hz``, ``point_force``; of a mapped condition
    also ``near_field/`` (`tdacoustic.tables.near_field.write_near_field`). The attributes ``gears`` and ``directions``
    name the rows. With a housing ``/model/insertion_loss/`` (`tdacoustic.tables.insertion_loss`). Names as in
    `tdacoustic.tables.result_file.write_result_file`.

    Parameters
    ----------
    path : Path
    model : ModelArrays
    """
    import h5py

    with h5py.File(path, "w") as file:
        describe(file, model.name, "calculated")
        write_model(file.create_group("model"), model)


def write_model(group: h5py.Group, model: ModelArrays) -> None:
    """Write the arrays of a prediction into a group: what `write_prediction_file` has in ``/model/``.

    Parameters
    ----------
    group : h5py.Group
        Empty.
    model : ModelArrays
    """
    prediction = model.prediction
    group.attrs["name"] = model.name
    group.attrs["origin"] = "calculated"
    group.attrs["gears"] = list(GEARS)
    group.attrs["directions"] = list(DIRECTIONS)
    mesh, system = group.create_group("mesh"), prediction.unit.system
    time = np.arange(STIFFNESS_SAMPLES) / STIFFNESS_SAMPLES
    put(mesh, "time_mesh_periods", time, "1")
    put(mesh, "stiffness", system.mesh_stiffness_n_per_m * system.contact_lines.relative(time), "N/m")
    put(mesh, "transmission_error", system.transmission_error_at(time), "m")
    conditions = group.create_group("conditions")
    if prediction.insertion_loss is not None:
        write_insertion_loss(group.create_group("insertion_loss"), prediction.insertion_loss)
    maps = {field.condition: field for field in prediction.maps}
    for state in prediction.conditions:
        held = group_of(conditions, state.condition.name)
        _write_condition(held, state, model.highest_hz)
        if state.condition.name in maps:
            write_near_field(held.create_group("near_field"), maps[state.condition.name])


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
