"""Interpolated levels beside computed ones."""

import numpy as np
import pytest

from tdacoustic.fitting import FreeParameter
from tdacoustic.fitting.calibration import free_parameter
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.response import TOLERANCE_DB, response_of

from .conftest import CONSTANT, DAMPING, GAIN

BEARING = "gear_dynamics.bearing_damping_ratio"


def test_levels_between_the_nodes_are_the_computed_ones(shared_fleet, levels_of):
    model = LevelModel(shared_fleet, levels_of({}))
    assert model.prepare([free_parameter(shared_fleet, key) for key in (CONSTANT, DAMPING)]) <= TOLERANCE_DB
    random = np.random.default_rng(3)
    worst = 0.0
    for place in random.uniform(np.log(0.005), np.log(0.5), 40):
        values = {CONSTANT: 3.0, DAMPING: float(np.exp(place))}
        worst = max(worst, float(np.abs(model.levels_db(values) - model.levels_db(values, exact=True)).max()))
    assert worst <= 0.01


def test_over_two_parameters_too(shared_fleet, levels_of):
    model = LevelModel(shared_fleet, levels_of({}, [4, 5]))
    free = [free_parameter(shared_fleet, DAMPING), free_parameter(shared_fleet, BEARING, low=0.02, high=0.2)]
    assert model.prepare(free) <= TOLERANCE_DB
    values = {DAMPING: 0.037, BEARING: 0.066}
    assert model.levels_db(values) == pytest.approx(model.levels_db(values, exact=True), abs=0.05)


def test_what_is_not_smooth_is_refused():
    jump = FreeParameter("x", 0.5, 0.0, 1.0)
    assert response_of(lambda values: np.array([80.0 if values["x"] < 0.4 else 90.0]), [jump]) is None
    assert response_of(lambda values: np.array([80.0 + values["x"] ** 2]), [jump]) is not None


def test_a_place_outside_of_the_bounds_is_computed(shared_fleet, levels_of):
    model = LevelModel(shared_fleet, levels_of({}, [5]))
    model.prepare([free_parameter(shared_fleet, DAMPING, low=0.03, high=0.2)])
    values = {DAMPING: 0.25}
    assert model.levels_db(values)[0] == model.levels_db(values, exact=True)[0]


def test_gains_add_as_they_stand(shared_fleet, levels_of):
    data = levels_of({})
    model = LevelModel(shared_fleet, data)
    values = {CONSTANT: -7.0, GAIN: 3.0, DAMPING: 0.1}
    sounds = {sound.condition: sound for sound in model.sounds(values)}
    for datum, level in zip(data, model.levels_db(values), strict=True):
        assert level == pytest.approx(sounds[datum.condition.name].level_db("4 m"), abs=1e-9)
