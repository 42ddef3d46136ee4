"""A fleet fitted to levels: recovery without scatter, and doubts where the data cannot tell."""

from dataclasses import replace

import pytest
from plain_fleets import plain_fleet

import tdacoustic as td
from tdacoustic.drive import Receiver
from tdacoustic.errors import FittingError
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.fitting.settings import FitSettings

CONSTANT, DAMPING = "masuda.constant_db", "gear_dynamics.mesh_damping_ratio"
TRUTH = {CONSTANT: -3.0, DAMPING: 0.08}


@pytest.fixture(scope="module")
def fleet():
    return td.load_fleet(plain_fleet("reference-drive"))


@pytest.fixture(scope="module")
def data(fleet):
    """Levels of the model itself with other values: conditions 2, 5 and 6."""
    conditions = [td.DriveModel(fleet).conditions[index] for index in (1, 4, 5)]
    empty = [MeasuredLevel(c, Receiver("4 m", 4.0), 0.0, 0.1, "Z", "synthetic", "made") for c in conditions]
    levels = LevelModel(fleet, empty).levels_db(TRUTH)
    return [replace(datum, level_db=float(level)) for datum, level in zip(empty, levels, strict=True)]


def test_values_come_back_and_the_fleet_carries_them(fleet, data):
    free = [free_parameter(fleet, key) for key in TRUTH]
    found = calibrate_fleet(fleet, data, free, FitSettings(0.0, starts=2), origin="calibrated by a test")
    for parameter in found.parameters:
        assert parameter.value == pytest.approx(TRUTH[parameter.key], rel=1e-4)
        low, high = parameter.ci95
        assert low < TRUTH[parameter.key] < high
    assert found.doubts == ()
    carried = found.fleet.get(CONSTANT)
    assert (carried.origin, carried.stderr) == ("calibrated by a test", pytest.approx(found.parameters[0].stderr))
    assert all(abs(level.error_db) < 1e-3 for level in found.levels)
    assert all(abs(left.error_db) < 0.02 for left in found.left_out)
    assert fleet.get(CONSTANT).value == 20.0


def test_a_source_inside_the_box_cannot_be_seen(fleet, data):
    inside = fleet.replaced({"masuda.placement": "inside"})
    with pytest.raises(FittingError, match="the model gives no level in condition 2, 5, 6"):
        calibrate_fleet(inside, data, [free_parameter(inside, CONSTANT)])


def test_a_condition_far_off_and_one_condition_alone_are_doubted(fleet, data):
    free = [free_parameter(fleet, CONSTANT)]
    off = [*data[:-1], replace(data[-1], level_db=data[-1].level_db + 15.0)]
    found = calibrate_fleet(fleet, off, free, FitSettings(0.5, starts=1))
    assert any("does not reach the data" in doubt for doubt in found.doubts)
    alone = calibrate_fleet(fleet, data[:1], free, FitSettings(1.0, starts=1))
    assert any("one condition" in doubt for doubt in alone.doubts)
    assert alone.left_out[0].error_db is None


def test_levels_need_a_standard_deviation(data):
    with pytest.raises(
        FittingError, match=r"condition 2: the level's standard deviation must be > 0 dB .at least 0.001., got 0"
    ):
        replace(data[0], sigma_db=0.0)
