"""Sensitivities against derivatives that are known."""

import math

import numpy as np
import pytest

from tdacoustic.drive import DriveModel, conditions_of
from tdacoustic.radiation import absorption_db_per_m
from tdacoustic.studies import PATHS, QUANTITIES, sensitivity_of
from tdacoustic.studies.responses import SCAN_FACTORS, SILENT, _responses, bare_fleet, fleet_of, responses_task
from tdacoustic.studies.sensitivity import change_for

STEP_DB = 2e-3
"""A central difference of 1 % of x in 20 lg x is off by one part in 30 000; the mesh adds what its solver leaves."""


def found(fleet, scan=False):
    responses = _responses(responses_task(fleet, None, conditions_of(fleet)[:2], scan).settings)
    return responses, sensitivity_of(responses)


def changes(sensitivity, key, path):
    keys = [variation.key for variation in sensitivity.varied]
    return sensitivity.change_db[keys.index(key), :, PATHS.index(path)]


@pytest.fixture(scope="module")
def perfect(reference):
    """The reference drive with teeth that are perfect."""
    return reference.replaced({"gear_pair.1.transmission_error_um": (0.0,)}, origin="assumed")


def test_decibels_move_levels_by_decibels(reference):
    _, sensitivity = found(reference)
    assert changes(sensitivity, "masuda.constant_db", "mesh") == pytest.approx(1.0, abs=1e-9)
    assert changes(sensitivity, "masuda.constant_db", "total").max() <= 1.0 + 1e-9
    assert all(variation.kind == "level" for variation in sensitivity.varied if variation.key.endswith("_db"))


def test_torque_through_power_and_through_displacement(perfect):
    """With perfect teeth in contact the displacement is proportional to the torque: 20 lg W + 20 lg X is 40 lg T."""
    _, sensitivity = found(perfect)
    per_decade = 0.1 / math.log(10.0)  # 10 % of d lg T
    assert changes(sensitivity, "operation.torque_n_m", "mesh") == pytest.approx(40.0 * per_decade, abs=STEP_DB)
    _, sensitivity = found(perfect.replaced({"masuda.displacement": "static_ratio"}))
    assert changes(sensitivity, "operation.torque_n_m", "mesh") == pytest.approx(20.0 * per_decade, abs=STEP_DB)


def test_central_and_one_sided_differences():
    assert change_for("relative", 1.0, 2.0, 3.0) == pytest.approx(10.0)  # 1 a step of 1 %, told for 10 %
    assert change_for("relative", math.nan, 2.0, 3.0) == pytest.approx(10.0)
    assert change_for("level", 1.9, 2.0, math.nan) == pytest.approx(1.0)  # 0.1 a step of 0.1 dB
    assert np.isnan(change_for("level", math.nan, 2.0, math.nan))


def test_what_is_not_moved_says_why(reference):
    """Words, whole numbers and places are none; the gap of teeth in contact moves nothing."""
    responses, _ = found(reference)
    reasons = {left.key: left.reason for left in responses.left_out}
    assert reasons["gear_pair.1.backlash_um"] == SILENT
    keys = {variation.key for variation in responses.varied} | set(reasons)
    assert not keys & {"gear_pair.1.teeth.1", "model.gear_path", "operation.train_speed_km_h.1", "operation.mode"}
    assert "gear_dynamics.wheel_bearing_stiffness_n_per_m.3" in keys


def test_one_side_that_cannot_be_is_left_to_the_other(reference):
    """A damping ratio of 1 cannot rise; its change is that of the step down."""
    at_bound = reference.replaced({"gear_dynamics.bearing_damping_ratio": 1.0})
    responses, sensitivity = found(at_bound)
    keys = [variation.key for variation in responses.varied]
    row = responses.values[keys.index("gear_dynamics.bearing_damping_ratio")]
    assert np.isnan(row[1]).all()
    assert np.isfinite(changes(sensitivity, "gear_dynamics.bearing_damping_ratio", "mesh")).all()


def test_the_scan_is_of_assumed_numbers_and_passes_through_the_fleet_as_it_is(reference):
    fleet = reference.replaced({"gear_dynamics.mesh_damping_ratio": 0.05}, origin="drawing 12")
    responses, _ = found(fleet, scan=True)
    by_key = dict(zip((variation.key for variation in responses.varied), responses.values, strict=True))
    middle = 2 + SCAN_FACTORS.index(1.0)
    assert np.isnan(by_key["gear_dynamics.mesh_damping_ratio"][2:]).all()
    scanned = by_key["gear_dynamics.bearing_damping_ratio"]
    assert np.array_equal(scanned[middle], responses.base, equal_nan=True)
    other = found(fleet.replaced({"gear_dynamics.bearing_damping_ratio": 0.05 * SCAN_FACTORS[-1]}))[0]
    assert np.array_equal(scanned[-1], other.base, equal_nan=True)


def test_gears_that_rattle_are_not_integrated_over_and_over(reference):
    """A drag of 100 N m: they rattle at speed. There only what moves no gears is told."""
    hauled = {"operation.mode": "hauled", "operation.torque_n_m": 100.0, "operation.helix_angle_deg": (4.0,)}
    _, sensitivity = found(reference.replaced({**hauled, "operation.train_speed_km_h": (20.0, 114.455)}))
    assert [case.name for case in sensitivity.rattling] == ["2", "4"]  # the helix angle is at that speed
    damping = changes(sensitivity, "gear_dynamics.mesh_damping_ratio", "mesh")
    assert np.isfinite(damping).tolist() == [True, False, False]
    assert changes(sensitivity, "masuda.constant_db", "mesh") == pytest.approx(1.0, abs=1e-9)


def test_a_table_over_speed_moves_as_a_whole(reference):
    table = {"operation.torque": "table", "operation.torque_table": ((0.0, 5000.0), (200.0, 3000.0))}
    responses, sensitivity = found(reference.replaced(table))
    (variation,) = (one for one in responses.varied if one.key.startswith("operation."))
    assert (variation.key, variation.value) == ("operation.torque_table", None)
    moved = variation.moved(reference.replaced(table), 1.1)
    assert moved.value_of("operation.torque_table") == ((0.0, 5500.0), (200.0, pytest.approx(3300.0)))
    assert np.isfinite(changes(sensitivity, "operation.torque_table", "mesh")).all()


def test_the_fleet_of_a_step_is_the_fleet_without_what_it_does_not_depend_on(reference):
    text = bare_fleet(reference)
    again = fleet_of(text)
    assert list(again.parameters()) == list(reference.parameters())
    renamed = reference.replaced({})
    object.__setattr__(renamed, "name", "another")
    assert bare_fleet(renamed) == text


def test_the_air_takes_its_part_of_the_responses(reference):
    """400 m away the humidity, whose absorption no other number shows, has a sensitivity of its own."""
    far = reference.replaced({"radiation.sphere_radius_m": 400.0})
    absorbing = far.replaced({"radiation.air_absorption": True})
    responses, sensitivity = found(absorbing)
    level = QUANTITIES.index("mesh_spl_4m_db")
    prediction = DriveModel(absorbing).evaluate()
    told = [sound.level_db(prediction.surface, "mesh") for sound in prediction.sound[:2]]
    assert responses.base[:2, level] == pytest.approx(told, rel=1e-9)
    told = [prediction.conditions[place].mesh_hz for place in (0, 1)]
    air, humidity = absorbing.number("radiation.temperature_degc"), absorbing.radiation.humidity_percent.value
    ends = [400.0 * absorption_db_per_m(told, air, part * humidity) for part in (0.99, 1.01)]
    wanted = (ends[0] - ends[1]) / 0.02 * 0.1  # the derivative, for 10 %
    assert changes(sensitivity, "radiation.humidity_percent", "mesh")[:2] == pytest.approx(wanted, rel=1e-3)
    assert "radiation.humidity_percent" in {left.key for left in found(far)[0].left_out}
