"""Columns of the tables. The contract is fixed: columns may be added at the end, none changes."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

__all__ = ["COLUMNS", "TEXT_COLUMNS"]

_FINDINGS: Final = (
    "influence_1 influence_1_change influence_1_per influence_2 influence_2_change influence_2_per influence_3 "
    "influence_3_change influence_3_per turned_by turned_at turned_amount"
)

COLUMNS: Final = MappingProxyType(
    {
        "quality": "run channel check verdict detail",
        "levels": "run condition train_speed_km_h channel component quantity rms level_db reference laeq_db "
        "background_db correction si_unit level_band_db level_band_from_hz level_band_to_hz calibration distance_m "
        "role",
        "bands": "run condition channel band_hz level_db filter_dependent",
        "lines": "run condition channel component frequency_hz frequency_error_hz level_db prominence_db order "
        "family rms",
        "sources": "condition channel frequency_hz level_db radiator excitation source conflict confidence "
        "evidence order_name frequency_error_hz prominence_db",
        "kinematics": "run condition train_speed_km_h motor_speed_rpm speed_source mesh_frequency_hz "
        "observed_mesh_frequency_hz observed_mesh_error_hz mesh_excess causes",
        "tones": "run condition channel method frequency_hz frequency_error_hz level_db value_db criterion_db "
        "prominent audible combined_into_hz n_spectra order owner excitation notes weighting speed_from speed_to "
        "speed_unit",
        "tonality": "run condition channel method mean_audibility_db uncertainty_db adjustment_db n_spectra notes "
        "speed_from speed_to speed_unit",
        "railway": "run condition channel standard test symbol level_db corrected_db reason state findings start_s "
        "end_s n_runs spread_db reported_db decisive",
        "speeds": "run condition channel shaft source mean min max unit error confidence known_share first_s last_s "
        "beside_leading reason notes",
        "slip": "run condition train_channel shaft_channel shaft usual_slip error n_events worst_event worst_slip "
        "worst_from_s worst_to_s from_s to_s like_delay_s reason notes",
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
        "coupling": "frequency_hz condition harmonic receptance_one_way_m_per_n receptance_two_way_m_per_n "
        "mesh_force_one_way_n_per_um mesh_force_two_way_n_per_um pinion_x_force_one_way_db pinion_x_force_two_way_db "
        "pinion_y_force_one_way_db pinion_y_force_two_way_db pinion_z_force_one_way_db pinion_z_force_two_way_db "
        "wheel_x_force_one_way_db wheel_x_force_two_way_db wheel_y_force_one_way_db wheel_y_force_two_way_db "
        "wheel_z_force_one_way_db wheel_z_force_two_way_db",
        "coupling_conditions": "condition mesh_frequency_hz coupling dte_pp_one_way_um dte_pp_two_way_um "
        "floquet_max_one_way floquet_max_two_way in_contact_one_way in_contact_two_way structure_spl_4m_one_way_db "
        "structure_spl_4m_two_way_db mesh_spl_4m_one_way_db mesh_spl_4m_two_way_db spl_4m_one_way_db spl_4m_two_way_db",
        "insertion_loss": "kind frequency_hz insertion_loss_db mass_law_db condition half_air_loss_db "
        "double_air_loss_db beside_low_db beside_high_db",
        "near_field": "condition plane x_m y_m z_m place level_db structure_level_db mesh_level_db motor_level_db",
        "what_if": "condition train_speed_km_h receiver weighting case level_db change_db change_low_db change_high_db "
        "level_low_db level_high_db fit_change_low_db fit_change_high_db before_db",
        "patterns": "sweep value mean_12m_db loudest_db loudest_deg quietest_db quietest_deg range_db",
        "pattern_correlation": "sweep first second correlation difference_db both_shaped",
        "sensitivity": "parameter origin value condition helix_angle_deg path per change_db not_varied",
        "references": f"quantity condition helix_angle_deg kind origin reference_value model_value model_condition "
        f"difference tolerance verdict {_FINDINGS} sentence unit difference_unit",
        "features": f"feature quantity over shape origin tolerance margin verdict {_FINDINGS} sentence margin_unit",
        "sweep_points": "sweep point parameter value words reason",
        "sweeps": "sweep point condition train_speed_km_h parameters structure_spl_4m_db mesh_spl_4m_db "
        "motor_spl_4m_db spl_4m_db masuda_spl_1m_db dte_pp_um range_12m_db loudest_deg reason",
        "sweep_sensitivity": "sweep parameter range_from range_to scale condition level_of measure value low high "
        "explained explained_ranks n_used n_rattling n_silent n_refused",
        "orders": "run condition channel order speed_rpm level_db name kind shaft bandwidth_orders requested_bandwidth "
        "level_error_db floor_db phase_deg phase_error_deg steadiness method reason",
        "sidebands": "run condition channel carrier carrier_order spacing spacing_orders speed_rpm pairs sidebands_db "
        "amplitude_depth phase_depth_rad reason",
        "resonances": "run condition channel kind frequency_hz width_hz rise_db raised crossing confidence orders "
        "detail",
        "synchronous": "run condition channel shaft turns speed_rpm synchronous_db residual_db harmonic order name "
        "level_db level_error_db phase_deg phase_error_deg reason",
        "contributions": "run condition train_speed_km_h channel span kind order low_hz high_hz part level_db low_db "
        "high_db path_level_db verdict reason probability_largest n_states",
        "coherence": "run condition train_speed_km_h kind reference other frequency_hz span value corrected low high "
        "averages reason",
        "sensors": "channel sensor run kind series calibrator wanted_hz frequency_hz read expected unit deviation_db "
        "sensitivity_stated sensitivity_set drift_db sigma_db steadiness_db distortion_percent from_s to_s scale_from "
        "calibrated_on due_on verdict reason",
        "clocks": "run log reference_log method offset_s offset_error_s drift_ppm drift_error_ppm axis_error_samples "
        "wander_s coherence peak_ratio band_from_hz band_to_hz overlap_from_s overlap_to_s windows windows_used "
        "inverted doubt",
        "modes": "train_speed_km_h channel band mode level_db torque_share low high depends_on words motor_speed_rpm "
        "speed_level_db torque_level_db runs scatter_assumed",
        "dominance": "condition train_speed_km_h weighting dominant motor_share gearbox_share ambiguous_share "
        "unassigned_share line_fraction dominant_excitation confidence leading n_runs spread_db sensor_dominant "
        "sensor_confidence order_dominant order_confidence contribution_dominant contribution_confidence "
        "evidence_agreement evidence_source evidence_joint evidence_words",
    }
)
"""Columns by table, separated by spaces."""

TEXT_COLUMNS: Final = frozenset(
    {
        *("run", "condition", "channel", "component", "quantity", "reference", "correction", "si_unit", "family"),
        *("check", "verdict", "detail"),
        *("radiator", "excitation", "source", "evidence", "weighting", "dominant", "dominant_excitation"),
        *("order_name", "leading", "speed_source", "causes"),
        *("parameter", "parameters", "origin", "per", "not_varied", "kind", "model_condition", "sentence", "words"),
        *("feature", "over", "shape", "reason", "turned_by"),
        *("scale", "level_of", "measure"),
        *(f"influence_{number}{of}" for number in "123" for of in ("", "_per")),
        *("mode", "method", "gear", "direction", "receiver", "path", "sweep"),
        *("coupling", "plane", "place", "case"),
        *("unit", "difference_unit", "margin_unit"),
        *("name", "carrier", "spacing", "orders"),
        *("owner", "notes", "speed_unit", "standard", "test", "symbol", "state", "findings"),
        *("shaft", "train_channel", "shaft_channel", "worst_event"),
        *("span", "part", "other", "band", "depends_on", "runs"),
        *("sensor_dominant", "order_dominant", "contribution_dominant"),
        *("sensor", "calibrator", "sensitivity_stated", "sensitivity_set", "scale_from", "calibration"),
        *("calibrated_on", "due_on"),
        *("log", "reference_log", "doubt", "role"),
        *("evidence_agreement", "evidence_source", "evidence_words"),
    }
)
"""Columns that hold words, even where the words are digits."""
