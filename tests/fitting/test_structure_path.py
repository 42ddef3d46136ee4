"""The bearing forces' way through the housing in a calibration: gain and loss factor come back, the rest is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_up_modes import fleet_text, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.drive import DriveModel, Receiver
from tdacoustic.errors import FittingError
from tdacoustic.fitting import FreeParameter
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.fitting.settings import FitSettings

GAIN, LOSS = "model.structure_gain_db", "housing.loss_factor"
SPEEDS = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0)
PLACES = (Receiver("4 m", 4.0), Receiver("beside", 4.0, (0.0, 4.0, 0.0)), Receiver("ahead", 4.0, (4.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(fleet_text("", 700), encoding="utf-8")
    speeds = {"operation.train_speed_km_h": SPEEDS, "operation.helix_angle_deg": (4.0,)}
    return td.load_fleet(path).replaced(speeds | {"model.gear_path": "structure"})


@pytest.fixture(scope="module")
def housing(fleet):
    return sound_of_made_up_modes(fleet, PLACES)


def data_of(fleet, housing, values):
    """Levels of the drive model, not of the level model, with other values."""
    prediction = DriveModel(fleet.replaced(values), housing=housing).evaluate(receivers=PLACES[1:])
    return [
        MeasuredLevel(state.condition, place, sound.level_db(place.name), 0.3, "Z", "synthetic", "made")
        for state, sound in zip(prediction.conditions, prediction.sound, strict=True)
        for place in PLACES
    ]


def test_the_level_model_is_the_drive_model(fleet, housing):
    values = {GAIN: 4.0, LOSS: 0.07, "gear_dynamics.mesh_damping_ratio": 0.09}
    data = data_of(fleet, housing, values)
    model = LevelModel(fleet, data, housing)
    assert model.levels_db(values) == pytest.approx([datum.level_db for datum in data], abs=1e-5)
    assert model.prepare([free_parameter(fleet, LOSS)]) < 0.05
    assert model.levels_db(values) == pytest.approx([datum.level_db for datum in data], abs=0.15)


def test_gain_and_loss_factor_come_back(fleet, housing):
    truth = {GAIN: 5.0, LOSS: 0.08}
    data = data_of(fleet, housing, truth)
    free = [FreeParameter(GAIN, 0.0, -30.0, 30.0), free_parameter(fleet, LOSS)]
    found = calibrate_fleet(fleet, data, free, FitSettings(model_sigma_db=0.5), housing=housing)
    values = {parameter.key: parameter.value for parameter in found.parameters}
    assert values[GAIN] == pytest.approx(5.0, abs=0.05)
    assert values[LOSS] == pytest.approx(0.08, rel=0.02)
    assert found.fleet.get(LOSS).value == pytest.approx(values[LOSS])
    sounds = [sound.level_db("4 m", "structure") for sound in found.after]
    assert np.isfinite(sounds).all()


def test_the_structures_gain_is_the_level_added(fleet, housing):
    data = data_of(fleet, housing, {})
    model = LevelModel(fleet, data, housing)
    assert model.levels_db({GAIN: 6.0}) - model.levels_db({}) == pytest.approx(np.full(len(data), 6.0), abs=1e-9)


def test_a_path_that_the_total_leaves_out_is_not_computed(fleet, housing, monkeypatch):
    from tdacoustic.drive import HousingField

    masuda = fleet.replaced({"model.gear_path": "masuda"})
    data = data_of(fleet, housing, {})
    monkeypatch.setattr(
        HousingField, "structure_sources", lambda _, forces: pytest.fail("not asked for") if forces is not None else ()
    )
    assert np.isfinite(LevelModel(masuda, data, housing).levels_db({})).all()


@pytest.mark.parametrize("key", ["housing.wall_mm", "radiation.temperature_degc", "housing.material.modulus_gpa"])
def test_what_transfer_vectors_depend_on_cannot_be_free(fleet, housing, key):
    data = data_of(fleet, housing, {})
    value = float(fleet.get(key).value)
    free = [FreeParameter(key, value, 0.5 * value, 2.0 * value)]
    with pytest.raises(FittingError, match=f"{key} cannot be free with boundary elements"):
        calibrate_fleet(fleet, data, free, housing=housing)
    followed = [FreeParameter(key, value, 0.5 * value, 2.0 * value, expression=f"{value} + 0 * {GAIN}")]
    with pytest.raises(FittingError, match=f"{key} cannot be free with boundary elements"):
        calibrate_fleet(fleet, data, [FreeParameter(GAIN, 0.0, -30.0, 30.0), *followed], housing=housing)


def test_masuda_alone_next_to_structure_is_said_to_count_twice(fleet, housing):
    both = fleet.replaced({"model.gear_path": "sum"})
    data = [replace(datum, level_db=datum.level_db + 20.0) for datum in data_of(fleet, housing, {})]
    found = calibrate_fleet(both, data, [FreeParameter(GAIN, 0.0, -30.0, 60.0)], housing=housing)
    assert any("counted twice" in doubt for doubt in found.doubts)
    assert math.isfinite(found.parameters[0].value)


def test_a_calibration_has_the_fleets_coupling(fleet, housing):
    """Two-way: the levels are the drive model's, and the housing's loss factor changes the motion of the gears too."""
    coupled = fleet.replaced({"model.coupling": "two_way"})
    for values in ({LOSS: 0.07}, {LOSS: 0.15, "gear_dynamics.mesh_damping_ratio": 0.09}, {GAIN: 4.0}):
        data = data_of(coupled, housing, values)
        model = LevelModel(coupled, data, housing)
        model.levels_db({})  # a motion of another loss factor is known
        assert model.levels_db(values) == pytest.approx([datum.level_db for datum in data], abs=1e-5)
    one_way = LevelModel(fleet, data, housing)
    assert np.abs(model.levels_db({}) - one_way.levels_db({})).max() > 0.5
    kept, moved = (held._motion(held._fleet({LOSS: 0.2}), {LOSS: 0.2})[1] for held in (one_way, model))
    assert kept is one_way._motion(one_way.fleet, {})[1]
    assert moved is not model._motion(model.fleet, {})[1]


def test_the_loss_factor_comes_back_through_both_ways(fleet, housing):
    coupled = fleet.replaced({"model.coupling": "two_way"})
    data = data_of(coupled, housing, {GAIN: 5.0, LOSS: 0.08})
    free = [FreeParameter(GAIN, 0.0, -30.0, 30.0), free_parameter(coupled, LOSS)]
    found = calibrate_fleet(coupled, data, free, FitSettings(model_sigma_db=0.5), housing=housing)
    values = {parameter.key: parameter.value for parameter in found.parameters}
    assert values[GAIN] == pytest.approx(5.0, abs=0.05)
    assert values[LOSS] == pytest.approx(0.08, rel=0.02)
