"""Cases are the drive model's own numbers, whatever is taken from what is known."""

import dataclasses
import math

import numpy as np
import pytest
from made_up_modes import air_of_made_up_modes, fleet_text, sound_of_made_up_modes
from plain_fleets import plain_fleet

from tdacoustic.drive import DriveModel, conditions_of
from tdacoustic.drive.housing_steps import housing_tasks
from tdacoustic.drive.what_if import changed_fleet, changed_model, what_if_answer
from tdacoustic.errors import FleetError
from tdacoustic.fleet import WhatIf, load_fleet
from tdacoustic.radiation import absorption_db_per_m
from tdacoustic.studies import QUANTITIES, CaseModel, conditions_under
from tdacoustic.studies.changed_fleet import housing_signature, housing_under

MOTOR = """
[motor]
position_m = [0.0, 0.6, 0.0]
carrier_hz = 300

[[motor.excitation]]
name = "carrier x2"
carrier = 2
sound_power_level_db = [[0, 90.0], [3000, 95.0]]
"""

SAME_DB = 1e-9
"""The same formulas in another order."""


@pytest.fixture(scope="module")
def housed(tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(fleet_text(MOTOR, 700), encoding="utf-8")
    fleet = load_fleet(path).replaced({"operation.helix_angle_deg": (0.1, 8.0), "model.gear_path": "sum"})
    return fleet, sound_of_made_up_modes(fleet)


def told_by_the_drive(fleet, housing=None):
    """What the drive model says, under the names of the quantities."""
    prediction = DriveModel(fleet, housing=housing).evaluate()
    states = [*prediction.conditions, *(case.gears for case in prediction.helix)]
    sounds = [*prediction.sound, *(case.sound for case in prediction.helix)]
    rows = []
    for state, sound, around in zip(states, sounds, prediction.directivity, strict=True):
        row = {f"{path}_spl_4m_db": sound.level_db(prediction.surface, path) for path in ("structure", "mesh", "motor")}
        row["spl_4m_db"] = sound.level_db(prediction.surface)
        row["masuda_spl_1m_db"], row["mesh_frequency_hz"] = state.masuda_db, state.mesh_hz
        row["dte_pp_um"] = 1e6 * state.steady.dte_pp_m
        first = int(np.flatnonzero(state.forces.harmonic == 1.0)[0])
        row["wheel_force_z_n"] = abs(state.forces.amplitude_n[1, 2, first])
        row["range_12m_db"] = np.ptp(around.level_db)
        if row["range_12m_db"] > 0.05:
            row["loudest_deg"] = around.angle_deg[around.level_db.argmax()]
        rows.append(row)
    return rows


def same(values, fleet, housing=None):
    rows = told_by_the_drive(fleet, housing)
    assert len(rows) == len(values.cases)
    for found, told in zip(values.values, rows, strict=True):
        for name, number in told.items():
            got = found[QUANTITIES.index(name)]
            assert math.isnan(got) if number is None else got == pytest.approx(number, rel=SAME_DB), name


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"masuda.constant_db": 12.0},
        {"model.structure_gain_db": -6.0, "model.motor_gain_db": 3.0},
        {"gear_dynamics.mesh_damping_ratio": 0.02},
        {"gear_pair.1.face_width_mm": 100.0},
        {"operation.torque_n_m": 3000.0},
        {"operation.train_speed_km_h.2": 33.0},
        {"housing.loss_factor": 0.1},
        {"housing.seat.1.position_m.2": 0.03},  # the gear between its bearings: their shares of its force
        {"motor.carrier_hz": 250.0},
        {"masuda.weighting": "A"},
        {"radiation.air_absorption": True},
        {"radiation.air_absorption": True, "masuda.constant_db": 12.0},
        {"model.coupling": "two_way"},
        {"model.coupling": "two_way", "housing.loss_factor": 0.2},
    ],
    ids=lambda change: ", ".join(change) or "as it is",
)
def test_a_changed_fleet_gives_what_the_drive_model_gives(housed, change):
    fleet, housing = housed
    model = CaseModel(fleet, housing, conditions_of(fleet))
    changed = fleet.replaced(change) if change else fleet
    assert not model.needs_vectors(changed)
    own_box = dataclasses.replace(housing, box=housing_tasks(changed).box)  # as the workflows put it together
    same(model.values(changed), changed, own_box)
    same(model.values(fleet), fleet, housing)  # and nothing of it stays behind


def test_point_sources_with_another_air_and_ground():
    fleet = load_fleet(plain_fleet("crrc-freight"))
    model = CaseModel(fleet, None, conditions_of(fleet))
    for change in (
        {"radiation.space": "half"},
        {"radiation.temperature_degc": 40.0},
        {"radiation.sphere_radius_m": 5.0},
    ):
        changed = fleet.replaced(change)
        assert not model.needs_vectors(changed)
        same(model.values(changed), changed)


@pytest.mark.parametrize(
    "change",
    [
        {"housing.wall_mm": 7.0},
        {"radiation.temperature_degc": 40.0},
        {"motor.position_m.2": 0.7},
        {"housing.material.poisson": 0.29},
        {"housing.seat.1.stiffness_n_per_m.3": 1e7},
        {"radiation.space": "half"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_what_asks_for_modes_or_vectors_of_its_own(housed, change):
    fleet, housing = housed
    assert CaseModel(fleet, housing, conditions_of(fleet)).needs_vectors(fleet.replaced(change))


def test_a_drive_that_cannot_be_is_refused(housed):
    fleet, housing = housed
    model = CaseModel(fleet, housing, conditions_of(fleet))
    with pytest.raises(FleetError, match="backlash"):
        model.values(fleet.replaced({"gear_pair.1.transmission_error_um": (500.0,)}))


def test_conditions_follow_the_fleet_where_they_followed_it_before(reference):
    held = conditions_of(reference)
    doubled = reference.replaced({"operation.torque_n_m": 2.0 * held[0].torque_n_m})
    assert conditions_under(reference, doubled, held) == conditions_of(doubled)
    measured = (
        dataclasses.replace(held[0], name="run 7"),  # torque by the law, another name
        dataclasses.replace(held[1], name="run 8", torque_n_m=123.0),  # of the run itself
    )
    by_law, of_run = conditions_under(reference, doubled, measured)
    assert (by_law.torque_n_m, of_run.torque_n_m) == (2.0 * held[0].torque_n_m, 123.0)
    smaller = reference.replaced({"train.wheel_diameter_mm": 500.0})
    fast = dataclasses.replace(measured[0], motor_hz=7.0)  # a tacho's, not of the wheel
    assert [one.motor_hz for one in conditions_under(reference, smaller, (fast,))] == [7.0]


def test_what_the_air_absorbs_is_in_the_values():
    """Over 400 m it takes what the drive model says it takes, from each case by its own frequency."""
    plain = load_fleet(plain_fleet("reference-drive")).replaced({"radiation.sphere_radius_m": 400.0})
    absorbing = plain.replaced({"radiation.air_absorption": True})
    level = QUANTITIES.index("mesh_spl_4m_db")
    held, other = (CaseModel(fleet, None, conditions_of(fleet)) for fleet in (plain, absorbing))
    same(other.base, absorbing)
    same(held.values(absorbing), absorbing)
    same(other.values(plain), plain)
    taken = held.base.values[:, level] - other.base.values[:, level]
    hz = held.base.values[:, QUANTITIES.index("mesh_frequency_hz")]
    wanted = 400.0 * absorption_db_per_m(hz, 273.15 + 20.0, absorbing.radiation.humidity_percent.value)
    assert taken == pytest.approx(wanted, rel=1e-9)
    assert wanted.max() > 1.0


# ------------------------------------------------------------------ gears that move along their shafts

MOVED = {"housing.seat.1.position_m.2": 0.02}


@pytest.fixture(scope="module")
def aired(housed):
    """The small fleet with Masuda's source inside, and the air around it."""
    fleet = housed[0].replaced({"masuda.placement": "inside", "model.gear_path": "masuda"})
    return fleet, air_of_made_up_modes(fleet, sound_of_made_up_modes(fleet))


def test_the_source_inside_moves_with_its_gear(aired):
    """It stands where the pinion does: another place of the pinion takes air with the source there."""
    fleet, housing = aired
    moved = fleet.replaced(MOVED)
    assert housing_signature(moved) != housing_signature(fleet)
    assert housing_under(fleet, moved, housing) is None
    assert CaseModel(fleet, housing, conditions_of(fleet)).needs_vectors(moved)
    own = air_of_made_up_modes(moved, sound_of_made_up_modes(moved))
    assert housing.inside.source_m[1] == pytest.approx(0.0)
    assert own.inside.source_m == pytest.approx((housing.inside.source_m[0], 0.02, housing.inside.source_m[2]))
    levels = [
        CaseModel(of, sound, conditions_of(of)).base.values[:5, QUANTITIES.index("mesh_spl_4m_db")]
        for of, sound in ((fleet, housing), (moved, own))
    ]
    assert np.abs(levels[1] - levels[0]).max() > 0.01
    told = moved.replaced({"masuda.position_m": (0.0, 0.0, 0.0)})
    assert housing_signature(told) == housing_signature(told.replaced({"housing.seat.1.position_m.2": 0.0}))


def test_a_free_source_stays_and_its_gear_moves(housed):
    fleet, housing = housed
    moved = fleet.replaced(MOVED)
    found = housing_under(fleet, moved, housing)
    assert found.box.seats[0].gear_y_m == pytest.approx(0.02)
    assert found.points is housing.points


def test_a_what_if_with_another_place_of_the_gear_has_the_source_there(aired):
    """As a new prediction of the changed fleet has it."""
    fleet, housing = aired
    case = WhatIf(name="further left", parameters=tuple(MOVED.items()))
    asked = dataclasses.replace(fleet, what_if=(case,))
    moved = changed_fleet(asked, case)
    own = air_of_made_up_modes(moved, sound_of_made_up_modes(moved))
    model, other = DriveModel(asked, housing=housing), changed_model(asked, case, own)
    conditions = model.conditions[:5]
    sounds = [model.sound_of(model.gears(condition)) for condition in conditions]
    answer = what_if_answer(model, conditions, sounds, (), {case.name: other})
    expected = DriveModel(moved, housing=own).evaluate(conditions)
    for level in answer.levels:
        assert level.level_db == expected.sound_of(level.condition).level_db("4 m", "total", level.weighting)
    assert max(abs(level.change_db) for level in answer.levels) > 0.01
