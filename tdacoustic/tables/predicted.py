"""The tables of the modelled side as views of a prediction."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from tdacoustic.drive import Directivity, DriveSound, GearState, HelixCase, Prediction, SpeedSweep
from tdacoustic.gears import DIRECTIONS, GEARS, Branch, SteadyState
from tdacoustic.tables.coupling import coupled_condition_rows, coupling_rows
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.tables.insertion_loss import insertion_loss_rows
from tdacoustic.tables.near_field import near_field_rows

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["predicted_tables"]

HARMONICS_AT_LEAST = 10
"""Mesh harmonics whose bearing forces are listed in any case, beyond the model's highest frequency too."""


def predicted_tables(prediction: Prediction, highest_hz: float) -> dict[str, pd.DataFrame]:
    """Return the tables of a prediction as frames, by name.

    ``conditions``, ``predictions``, ``sound_lines``, ``directivity``, ``bearing_forces``, ``helix``, ``speed_sweep``,
    ``coupling``, ``coupling_conditions``, ``insertion_loss`` and ``near_field``; the last five are left out where they
    were not computed.
    Columns of parts that the model does not have are empty.

    Parameters
    ----------
    prediction : Prediction
    highest_hz : float
        Up to which forces are listed.
    """
    rows: dict[str, Iterable[Row]] = {
        "conditions": (
            _condition_row(state, sound, prediction.surface)
            for state, sound in zip(prediction.conditions, prediction.sound, strict=True)
        ),
        "predictions": (row for sound in prediction.sound for row in _level_rows(sound)),
        "sound_lines": (row for sound in prediction.sound for row in _line_rows(sound)),
        "directivity": (row for around in prediction.directivity for row in _around_rows(around)),
        "bearing_forces": (row for state in prediction.conditions for row in _force_rows(state, highest_hz)),
    }
    rows["helix"] = (_helix_row(case, prediction.surface) for case in prediction.helix)
    if prediction.sweep is not None:
        rows["speed_sweep"] = _sweep_rows(prediction.sweep)
    if prediction.coupling is not None:
        rows["coupling"] = coupling_rows(prediction.coupling.curves)
        rows["coupling_conditions"] = coupled_condition_rows(prediction.coupling)
    if prediction.insertion_loss is not None:
        rows["insertion_loss"] = insertion_loss_rows(prediction.insertion_loss)
    if prediction.maps:
        rows["near_field"] = (row for field in prediction.maps for row in near_field_rows(field))
    return {name: frame_of(name, table) for name, table in rows.items()}


def _motion(steady: SteadyState) -> Row:
    """What every table says of a steady state."""
    return {
        "dte_pp_um": 1e6 * steady.dte_pp_m,
        "floquet_max": _known(steady.floquet_max),
        "method": steady.method,
        "periodic": steady.is_periodic,
    }


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _condition_row(state: GearState, sound: DriveSound, surface: str) -> Row:
    condition, steady = state.condition, state.steady
    return {
        "condition": condition.name,
        "train_speed_km_h": condition.train_speed_km_h,
        "motor_speed_rpm": 60.0 * condition.motor_hz,
        "mesh_frequency_hz": state.mesh_hz,
        "torque_n_m": condition.torque_n_m,
        "masuda_spl_1m_db": state.masuda_db,
        "motor_sound_power_level_db": sound.sound_power_level_db("motor"),
        "structure_sound_power_level_db": sound.sound_power_level_db("structure"),
        **{f"{path}_spl_4m_db": sound.level_db(surface, path) for path in ("structure", "mesh", "motor")},
        "spl_4m_db": sound.level_db(surface),
        "mode": condition.mode,
        "power_kw": 1e-3 * condition.power_w,
        "repeats_after_mesh_periods": steady.repeats_after,
        "contact_part": steady.contact_part,
        "static_compression_um": 1e6 * steady.static_compression_m,
        **_motion(steady),
    }


def _level_rows(sound: DriveSound) -> Iterator[Row]:
    for level in sound.levels:
        yield {
            "condition": sound.condition,
            "receiver": level.receiver,
            "path": level.path,
            "weighting": level.weighting,
            "level_db": level.level_db,
        }


def _line_rows(sound: DriveSound) -> Iterator[Row]:
    for source, level in zip(sound.sources, sound.surface_db, strict=True):
        yield {
            "condition": sound.condition,
            "path": source.path,
            "source": source.name,
            "frequency_hz": source.frequency_hz,
            "sound_power_level_db": source.sound_power_level_db,
            "level_4m_db": level,
        }


def _around_rows(around: Directivity) -> Iterator[Row]:
    for angle, level in zip(around.angle_deg, around.level_db, strict=True):
        yield {
            "sweep": around.sweep,
            "value": around.value,
            "angle_deg": float(angle),
            "spl_12m_db": _known(float(level)),
        }


def _force_rows(state: GearState, highest_hz: float) -> Iterator[Row]:
    forces = state.forces
    limit = max(highest_hz, HARMONICS_AT_LEAST * state.mesh_hz) * (1.0 + 1e-9)
    lines = np.flatnonzero(forces.frequency_hz <= limit)
    for g, gear in enumerate(GEARS):
        for d, direction in enumerate(DIRECTIONS):
            start = {"condition": state.condition.name, "gear": gear, "direction": direction}
            mean = float(forces.mean_n[g, d])
            phase = 180.0 if mean < 0.0 else 0.0
            yield {
                **start,
                "harmonic": 0.0,
                "frequency_hz": 0.0,
                "force_amplitude_n": abs(mean),
                "phase_deg": phase,
            }
            for line in lines:
                amplitude = forces.amplitude_n[g, d, line]
                yield {
                    **start,
                    "harmonic": _known(float(forces.harmonic[line])),
                    "frequency_hz": float(forces.frequency_hz[line]),
                    "force_amplitude_n": float(np.abs(amplitude)),
                    "phase_deg": float(np.degrees(np.angle(amplitude))),
                }


def _helix_row(case: HelixCase, surface: str) -> Row:
    geometry = case.unit.geometry
    return {
        "helix_angle_deg": case.helix_angle_deg,
        "centre_distance_mm": 1e3 * geometry.centre_distance_m,
        "masuda_spl_1m_db": case.gears.masuda_db,
        "spl_4m_db": case.sound.level_db(surface),
        "condition": case.gears.condition.name,
        "mesh_frequency_hz": case.gears.mesh_hz,
        "transverse_contact_ratio": geometry.transverse_contact_ratio,
        "overlap_ratio": geometry.overlap_ratio,
        **_motion(case.gears.steady),
    }


def _sweep_rows(sweep: SpeedSweep) -> Iterator[Row]:
    yield from _branch_rows("up", sweep.train_speed_km_h, sweep.up)
    yield from _branch_rows("down", sweep.train_speed_km_h[::-1], sweep.down)


def _branch_rows(direction: str, speeds_km_h: tuple[float, ...], branch: Branch) -> Iterator[Row]:
    for index, speed in enumerate(speeds_km_h):
        yield {
            "direction": direction,
            "train_speed_km_h": speed,
            "mesh_frequency_hz": float(branch.mesh_hz[index]),
            "torque_n_m": float(branch.torque_n_m[index]),
            "dte_pp_um": 1e6 * float(branch.dte_pp_m[index]),
            "floquet_max": _known(float(branch.floquet_max[index])),
            "contact_part": float(branch.contact_part[index]),
            "periodic": branch.repeats_after[index] == 1,
            "repeats_after_mesh_periods": float(branch.repeats_after[index]) or None,
            "method": branch.method[index],
        }
