"""Intervals of what a change does: against a search of the test's own, over made campaigns, where there are none."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plain_fleets import plain_fleet

import tdacoustic as td
from tdacoustic.drive import DriveModel
from tdacoustic.drive.what_if import what_if_answer
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.settings import FitSettings, PosteriorSettings
from tdacoustic.fitting.what_if import WhatIfPlaces, what_if_intervals

from .conftest import CONSTANT, DAMPING, GAIN

SURFACE = "4 m"
QUANTILE = 1.959963984540054

MESH_DB = np.array([75.118, 79.668, 83.038, 85.904, 89.007, 96.411])
"""Meshing noise of the reference drive at 4 m in conditions 1 to 6 with a Masuda constant of 0 and a mesh damping ratio
of 0.08: ``levels_at_4_m_db(TrueDrive(masuda_constant_db=0.0, mesh_damping_ratio=0.08))`` of
tests/evidence/drive_levels.py, which marches the printed equations in time and uses nothing of the program."""

MOTOR_DB = 10.0 * math.log10(10.0**10.4 + 10.0**10.0) - 10.0 * math.log10(4.0 * math.pi * 4.0**2)
"""Of the two constant tones of `shared_fleet`, 104 and 100 dB of sound power, at 4 m."""


def energy_sum(*levels_db):
    return 10.0 * np.log10(sum(10.0 ** (0.1 * np.asarray(level)) for level in levels_db))


def answered(found, model, fleet=None, **changes):
    """The answer of a calibrated fleet at its surface, with intervals."""
    drive = DriveModel(fleet or found.fleet)
    conditions = drive.conditions
    sounds = [drive.sound_of(drive.gears(condition)) for condition in conditions]
    answer = what_if_answer(drive, conditions, sounds)
    calibration = replace(found, fleet=drive.fleet)
    places = WhatIfPlaces(conditions, (drive.field.surface,), None, {})
    return what_if_intervals(answer, calibration, model, places, **changes)


@pytest.fixture(scope="module")
def fitted(shared_fleet, levels_of):
    """Calibrate the shared fleet to levels of its own model: settings, keys and data as asked."""

    def made(keys, settings, values=None, fleet=None, data=None, **changes):
        fleet = fleet or shared_fleet
        data = data or levels_of(values or {CONSTANT: -4.0, GAIN: 1.0}, **changes)
        model = LevelModel(fleet, data)
        free = [free_parameter(fleet, key) for key in keys]
        return calibrate_fleet(fleet, data, free, settings, model=model), model

    return made


# ---------------------------------------------------------------- against a search of the test's own


def own_ends(measured_db, mesh_db, sigma_db, level_sigma_db):
    """Range of the change for 10 dB less of the motor in each condition, over all that chi square allows.

    By brute force: constants and gains on a grid, errors of both paths in all directions, energies written out.
    """
    constants, gains = np.meshgrid(np.linspace(-25.0, 15.0, 401), np.linspace(-25.0, 15.0, 401), indexing="ij")
    totals = energy_sum(mesh_db[:, None, None] + constants, MOTOR_DB + gains)
    square = (((totals - measured_db[:, None, None]) ** 2) / (sigma_db**2 + level_sigma_db**2)).sum(axis=0)
    room = QUANTILE**2 - (square - square.min())
    inside = room >= 0.0
    turns = np.linspace(0.0, 2.0 * np.pi, 181)
    ends = []
    for mesh in mesh_db:
        shaken = sigma_db * np.sqrt(room[inside])[:, None]
        first = (MOTOR_DB + gains[inside])[:, None] + shaken * np.cos(turns)
        second = (mesh + constants[inside])[:, None] + shaken * np.sin(turns)
        change = energy_sum(first - 10.0, second) - energy_sum(first, second)
        ends.append((change.min(), change.max()))
    return ends


@pytest.mark.parametrize("sigma_db", [1.0, 2.0])
def test_the_interval_is_that_of_all_values_and_errors_that_chi_square_allows(
    shared_fleet, fitted, levels_of, sigma_db
):
    fleet = shared_fleet.replaced({DAMPING: 0.08})
    measured = energy_sum(MESH_DB - 4.0, MOTOR_DB + 1.0) + np.array([0.5, -0.8, 0.3, 0.6, -0.4, -0.2])
    data = [replace(d, level_db=float(x)) for d, x in zip(levels_of({}), measured, strict=True)]
    found, model = fitted([CONSTANT, GAIN], FitSettings(sigma_db, starts=2), fleet=fleet, data=data)
    answer = answered(found, model)
    for condition, expected in zip("123456", own_ends(measured, MESH_DB, sigma_db, 0.3), strict=True):
        low, high = answer.level(condition, "motor 10 dB less", SURFACE).change_95_db
        # 0.1 dB: the grid of the test (0.1 dB a step) and the 16 directions of errors here (2 % of their length)
        assert low == pytest.approx(expected[0], abs=0.1)
        assert high == pytest.approx(expected[1], abs=0.1)


def test_a_level_is_off_by_the_parameter_and_the_scatter_together(fitted, shared_fleet):
    # One constant and meshing noise alone: all is straight, and variances add.
    quiet = shared_fleet.replaced({GAIN: -60.0})
    found, model = fitted([CONSTANT], FitSettings(2.0, starts=1), {CONSTANT: 10.0, GAIN: -60.0}, fleet=quiet)
    answer = answered(found, model)
    stderr = found.parameters[0].stderr
    level = answer.level("6", "mesh 10 dB less", SURFACE)
    half = QUANTILE * math.hypot(stderr, 2.0)
    # the edge is halved ten times, and the step before it is a part of the standard error: well below 1 %
    assert level.level_95_db[1] - level.level_db == pytest.approx(half, rel=0.02)
    assert level.level_db - level.level_95_db[0] == pytest.approx(half, rel=0.02)
    assert level.change_db == pytest.approx(-10.0, abs=1e-3)
    assert level.change_95_db == pytest.approx((-10.0, -10.0), abs=0.01)


def test_without_scatter_both_intervals_are_one(fitted):
    found, model = fitted([CONSTANT, GAIN], FitSettings(0.0, starts=2), sigma_db=1.0, scatter_db=1.0)
    for level in answered(found, model).levels:
        assert level.change_95_db == level.fit_95_db


def test_every_interval_holds_its_value(fitted):
    found, model = fitted([CONSTANT, DAMPING, GAIN], FitSettings(4.0, starts=2), scatter_db=4.0, seed=3)
    answer = answered(found, model)
    assert answer.basis.parameters == (CONSTANT, DAMPING, GAIN)
    assert answer.basis.model_sigma_db == 4.0
    for level in answer.levels:
        if level.change_db is not None:
            assert level.change_95_db[0] <= level.fit_95_db[0] <= level.change_db
            assert level.change_db <= level.fit_95_db[1] <= level.change_95_db[1]
            assert level.level_95_db[0] < level.level_db < level.level_95_db[1]


# ---------------------------------------------------------------- over many campaigns


def test_the_true_change_lies_in_the_interval(shared_fleet, levels_of, record_property):
    """16 campaigns from an independent truth; the model's scatter is drawn for each path, or once for both.

    The bands leave room for the campaigns being few, each with 12 cases of the same fit: of 40 campaigns of each kind
    tests/evidence/what_if_study.py has 0.97 and 0.98.
    """
    fleet = shared_fleet.replaced({DAMPING: 0.08})
    empty = levels_of({})
    model = LevelModel(fleet, empty)
    free = [free_parameter(fleet, key) for key in (CONSTANT, GAIN)]
    random = np.random.default_rng(20)
    held: dict[str, list[bool]] = {"apart": [], "alike": [], "level": []}
    for number in range(16):
        kind = ("apart", "alike")[number % 2]
        errors = 4.0 * random.standard_normal((2, 6))
        errors = errors if kind == "apart" else np.stack([errors[0], errors[0]])
        truth = np.stack([np.full(6, MOTOR_DB - 1.0), MESH_DB]) + errors
        measured = energy_sum(*truth) + 0.3 * random.standard_normal(6)
        data = [replace(datum, level_db=float(x)) for datum, x in zip(empty, measured, strict=True)]
        own = model.with_data(data)
        found = calibrate_fleet(fleet, data, free, FitSettings(4.0, starts=1), model=own)
        answer = answered(found, own)
        for index, condition in enumerate("123456"):
            for path, name in enumerate(("motor", "mesh")):
                level = answer.level(condition, f"{name} 10 dB less", SURFACE)
                after = truth[:, index] - 10.0 * (np.arange(2) == path)
                change = float(energy_sum(*after) - energy_sum(*truth[:, index]))
                low, high = level.change_95_db if kind == "apart" else level.fit_95_db
                held[kind].append(low <= change <= high)
                held["level"].append(level.level_95_db[0] <= energy_sum(*after) <= level.level_95_db[1])
    covered = {kind: float(np.mean(cases)) for kind, cases in held.items()}
    record_property("covered", covered)
    assert covered["apart"] >= 0.89
    assert covered["alike"] >= 0.86
    assert covered["level"] >= 0.93


# ---------------------------------------------------------------- other parameters


def test_a_changed_parameter_with_what_the_fit_leaves_open(fitted, tmp_path, shared_fleet):
    text = shared_fleet.path.read_text(encoding="utf-8")
    path = tmp_path / "fleet.toml"
    case = f'\n[[what_if]]\nname = "damped"\nparameters = {{ "{DAMPING}" = 0.3 }}\n'
    path.write_text(text + case, encoding="utf-8")
    fleet = td.load_fleet(path)
    found, model = fitted([CONSTANT, DAMPING], FitSettings(0.1, starts=2), {CONSTANT: -4.0, DAMPING: 0.06}, fleet=fleet)
    answer = answered(found, model)
    stated = found.fleet.replaced({DAMPING: 0.3})
    for level in answer.levels:
        expected = DriveModel(stated).evaluate().sound_of(level.condition) if level.weighting == "Z" else None
        if expected is not None:
            assert level.level_db == expected.level_db(SURFACE)
    # At a given damping the level after the change is open by the constant alone, and by what its errors were
    # correlated with: the change of condition 6, of meshing noise alone, is open by the damping before it.
    change = answer.level("6", "damped", SURFACE)
    dampings = found.parameters[1].ci95
    levels = [
        DriveModel(found.fleet.replaced({DAMPING: value})).evaluate().sound_of("6").level_db(SURFACE, "mesh")
        for value in (*dampings, 0.3)
    ]
    expected = sorted((levels[2] - levels[0], levels[2] - levels[1]))
    assert change.fit_95_db == pytest.approx(expected, abs=0.4)  # the motor's share in condition 6


# ---------------------------------------------------------------- where the data do not tell


def test_a_parameter_that_the_data_do_not_see_is_named_and_its_bounds_hold(fitted):
    # The motor is 30 dB below the meshing noise: its gain is held from above alone.
    found, model = fitted([CONSTANT, GAIN], FitSettings(1.0, starts=2), {CONSTANT: 30.0, GAIN: -20.0})
    answer = answered(found, model)
    assert answer.basis.open_parameters == (GAIN,)
    off = answer.level("3", "motor off", SURFACE)
    assert off.change_95_db[1] == pytest.approx(0.0, abs=0.02)  # it may be silent
    assert off.change_95_db[0] < -0.1  # or as loud as the data leave room for
    gear = answer.level("3", "mesh 10 dB less", SURFACE)
    assert gear.change_95_db[0] == pytest.approx(-10.0, abs=0.05)


def test_what_nothing_holds_has_no_interval_and_says_why(fitted, shared_fleet, levels_of):
    data = levels_of({CONSTANT: -4.0})
    model = LevelModel(shared_fleet, data)
    first = "motor.excitation.1.sound_power_level_db"
    free = [
        FreeParameter(GAIN, 0.0),
        FreeParameter(first, 104.0),
        FreeParameter("motor.excitation.2.sound_power_level_db", 100.0),
    ]
    found = calibrate_fleet(shared_fleet, data, free, FitSettings(1.0, starts=1), model=model)
    answer = answered(found, model)
    assert answer.basis is None
    assert all(level.change_95_db is None for level in answer.levels)
    assert any(
        doubt.startswith("what changes would do has no interval: neither the data nor bounds hold")
        for doubt in answer.doubts
    )


def test_a_calibration_without_its_fit_leaves_the_answer_as_it_is(fitted):
    found, model = fitted([CONSTANT], FitSettings(1.0, starts=1))
    assert answered(replace(found, fit=None), model).basis is None


def test_quantiles_of_a_posterior_where_one_was_sampled(fitted):
    settings = FitSettings(1.0, starts=2, posterior=PosteriorSettings(16, 400))
    sampled, model = fitted([CONSTANT, GAIN], settings)
    plain = replace(sampled, posterior=None)
    by_samples, by_profile = answered(sampled, model), answered(plain, model)
    assert (by_samples.basis.method, by_profile.basis.method) == ("posterior", "profile")
    for one, other in zip(by_samples.levels, by_profile.levels, strict=True):
        if one.change_db is not None:
            # of a fit that is straight enough the two are the same within the samples' own scatter
            assert one.change_95_db == pytest.approx(other.change_95_db, abs=0.6)
            assert one.level_95_db == pytest.approx(other.level_95_db, abs=0.6)


def test_the_same_numbers_each_time(fitted):
    found, model = fitted([CONSTANT, DAMPING, GAIN], FitSettings(4.0, starts=2), scatter_db=4.0)
    assert answered(found, model) == answered(found, model)


def test_the_fleet_of_these_tests_is_that_of_the_truth(shared_fleet):
    assert plain_fleet("reference-drive").read_text(encoding="utf-8")[:400] in shared_fleet.path.read_text(
        encoding="utf-8"
    )
    levels = DriveModel(shared_fleet.replaced({DAMPING: 0.08, CONSTANT: 0.0})).evaluate().sound
    assert [sound.level_db(SURFACE, "mesh") for sound in levels] == pytest.approx(MESH_DB, abs=0.02)
    assert levels[0].level_db(SURFACE, "motor") == pytest.approx(MOTOR_DB, abs=1e-9)
