"""Columns of the tables. The contract is fixed: columns may be added at the end, none changes."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

__all__ = ["COLUMNS", "TEXT_COLUMNS"]

COLUMNS: Final = MappingProxyType(
    {
        "quality": "run channel check verdict detail",
        "levels": "run condition train_speed_km_h channel component quantity rms level_db reference laeq_db "
        "background_db correction si_unit level_band_db level_band_from_hz level_band_to_hz",
        "bands": "run condition channel band_hz level_db filter_dependent",
        "lines": "run condition channel component frequency_hz frequency_error_hz level_db prominence_db order "
        "family rms",
        "sources": "condition channel frequency_hz level_db radiator excitation source conflict confidence "
        "evidence order_name frequency_error_hz prominence_db",
        "kinematics": "run condition train_speed_km_h motor_speed_rpm speed_source mesh_frequency_hz "
        "observed_mesh_frequency_hz observed_mesh_error_hz mesh_excess causes",
        "conditions": "condition train_speed_km_h motor_speed_rpm mesh_frequency_hz torque_n_m dte_pp_um floquet_max "
        "masuda_spl_1m_db motor_sound_power_level_db structure_spl_4m_db mesh_spl_4m_db motor_spl_4m_db spl_4m_db "
        "mode power_kw method periodic repeats_after_mesh_periods contact_part static_compression_um "
        "structure_sound_power_level_db",
        "predictions": "condition receiver path weighting level_db",
        "sound_lines": "condition path source frequency_hz sound_power_level_db level_4m_db",
        "directivity": "sweep value angle_deg spl_12m_db",
        "bearing_forces": "condition gear direction harmonic frequency_hz force_amplitude_n phase_deg",
        "helix": "helix_angle_deg centre_distance_mm dte_pp_um masuda_spl_1m_db spl_4m_db condition mesh_frequency_hz "
        "transverse_contact_ratio overlap_ratio floquet_max method periodic",
        "speed_sweep": "direction train_speed_km_h mesh_frequency_hz torque_n_m dte_pp_um floquet_max contact_part "
        "periodic repeats_after_mesh_periods method",
        "dominance": "condition train_speed_km_h weighting dominant motor_share gearbox_share ambiguous_share "
        "unassigned_share line_fraction dominant_excitation confidence leading n_runs spread_db",
    }
)
"""Columns by table, separated by spaces."""

TEXT_COLUMNS: Final = frozenset(
    {
        *("run", "condition", "channel", "component", "quantity", "reference", "correction", "si_unit", "family"),
        *("check", "verdict", "detail"),
        *("radiator", "excitation", "source", "evidence", "weighting", "dominant", "dominant_excitation"),
        *("order_name", "leading", "speed_source", "causes"),
        *("mode", "method", "gear", "direction", "receiver", "path", "sweep"),
    }
)
"""Columns that hold words, even where the words are digits."""
