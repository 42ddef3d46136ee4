"""Masuda's constant in a calibration with the source inside the housing: found where it is heard, doubted where not."""

import numpy as np
import pytest
from made_up_modes import air_of_made_up_modes, fleet_text, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.drive import DriveModel, Receiver
from tdacoustic.fitting import FreeParameter
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.fitting.settings import FitSettings

CONSTANT, DAMPING = "masuda.constant_db", "gear_dynamics.mesh_damping_ratio"
AIR = "housing.cavity_loss_factor"
PLACES = (Receiver("4 m", 4.0), Receiver("beside", 4.0, (0.0, 4.0, 0.0)))


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(fleet_text("", 700), encoding="utf-8")
    speeds = {"operation.train_speed_km_h": (20.0, 30.0, 40.0, 50.0, 60.0, 70.0), "operation.helix_angle_deg": (4.0,)}
    return td.load_fleet(path).replaced(speeds | {"masuda.placement": "inside"})


@pytest.fixture(scope="module")
def housing(fleet):
    return air_of_made_up_modes(fleet, sound_of_made_up_modes(fleet, PLACES))


def data_of(fleet, housing, values):
    """Levels of the drive model, not of the level model."""
    prediction = DriveModel(fleet.replaced(values), housing=housing).evaluate(receivers=PLACES[1:])
    return [
        MeasuredLevel(state.condition, place, sound.level_db(place.name), 0.3, "Z", "synthetic", "made")
        for state, sound in zip(prediction.conditions, prediction.sound, strict=True)
        for place in PLACES
    ]


def test_the_level_model_is_the_drive_model(fleet, housing):
    values = {CONSTANT: 33.0, AIR: 0.05, "housing.loss_factor": 0.06, DAMPING: 0.09}
    data = data_of(fleet, housing, values)
    assert LevelModel(fleet, data, housing).levels_db(values) == pytest.approx([d.level_db for d in data], abs=1e-4)


def test_constant_and_damping_come_back(fleet, housing):
    truth = {CONSTANT: 41.0, DAMPING: 0.08}
    data = data_of(fleet, housing, truth)
    free = [FreeParameter(CONSTANT, 20.0, -40.0, 100.0), free_parameter(fleet, DAMPING)]
    found = calibrate_fleet(fleet, data, free, FitSettings(model_sigma_db=0.5), housing=housing)
    values = {parameter.key: parameter.value for parameter in found.parameters}
    assert values[CONSTANT] == pytest.approx(41.0, abs=0.1)
    assert values[DAMPING] == pytest.approx(0.08, rel=0.02)
    assert any("makes up for the insertion loss" in doubt for doubt in found.doubts)
    assert not any("cannot see it" in doubt for doubt in found.doubts)


def test_in_a_full_sum_the_constant_of_the_source_inside_is_not_determined(fleet, housing):
    """Physics.md, sections 4 and 6: with the bearing forces' sound far above it the constant cannot be found."""
    both = fleet.replaced({"model.gear_path": "sum", "model.structure_gain_db": 40.0, CONSTANT: -20.0})
    data = data_of(both, housing, {})
    parts = DriveModel(both, housing=housing).evaluate().sound
    apart = [sound.level_db("4 m", "structure") - sound.level_db("4 m", "mesh") for sound in parts]
    assert min(apart) > 25.0
    found = calibrate_fleet(
        both, data, [FreeParameter(CONSTANT, -20.0, -60.0, 20.0)], FitSettings(4.0), housing=housing
    )
    (constant,) = found.parameters
    assert constant.stderr is None or constant.stderr > 100.0
    assert any(f"the interval of {CONSTANT} reaches" in doubt or "cannot see it" in doubt for doubt in found.doubts)
    assert any("gear counted twice" in doubt for doubt in found.doubts)


def test_the_loss_factor_of_the_air_can_be_free(fleet, housing):
    data = data_of(fleet, housing, {AIR: 0.06})
    found = calibrate_fleet(fleet, data, [free_parameter(fleet, AIR)], FitSettings(0.3), housing=housing)
    assert np.isfinite(found.parameters[0].value)
    assert found.parameters[0].value == pytest.approx(0.06, rel=0.1)
