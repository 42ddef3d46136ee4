"""What a change of the drive does to its levels: energies by hand, and parameters as a new prediction has them."""

import math

import numpy as np
import pytest
from plain_fleets import plain_fleet

from tdacoustic.drive import DriveModel, Receiver
from tdacoustic.drive.what_if import cases_of, changed_fleet, changed_total_db, what_if_answer
from tdacoustic.errors import FleetError
from tdacoustic.fleet import WhatIf, load_fleet
from tdacoustic.tables import COLUMNS, what_if_table

MOTOR = '[[motor.excitation]]\nname = "tone"\nfixed_hz = 600\nsound_power_level_db = {}\n'
NEAR = Receiver("near", 1.0, (0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def drive_with(tmp_path_factory):
    """The reference drive with one tone of the motor and more tables at the end."""
    folder = tmp_path_factory.mktemp("fleets")

    def made(more="", level_db="105", **values):
        text = plain_fleet("reference-drive").read_text(encoding="utf-8")
        start = text.index("[housing]")
        path = folder / "fleet.toml"
        path.write_text(f"{text[:start]}{MOTOR.format(level_db)}\n{text[start:]}\n{more}", encoding="utf-8")
        fleet = load_fleet(path)
        return DriveModel(fleet.replaced(values) if values else fleet)

    return made


def answer_of(model, receivers=()):
    conditions = model.conditions
    return what_if_answer(model, conditions, [model.sound_of(model.gears(c), receivers) for c in conditions], receivers)


# ---------------------------------------------------------------- energies


@pytest.mark.parametrize(
    ("case", "change_db"),
    [
        ({"motor_db": -10}, 10.0 * math.log10((1.0 + 0.1) / 2.0)),  # -2.596 dB
        ({"motor_db": -3}, 10.0 * math.log10((1.0 + 10.0**-0.3) / 2.0)),
        ({"motor_db": "off"}, 10.0 * math.log10(0.5)),
        ({"motor_db": -10, "mesh_db": -10}, -10.0),
        ({"mesh_db": 3}, 10.0 * math.log10((1.0 + 10.0**0.3) / 2.0)),
        ({"structure_db": -20}, 0.0),
    ],
)
def test_two_equal_sources(case, change_db):
    equal = {"motor": np.array([80.0, 20.0]), "mesh": np.array([80.0, 20.0])}
    with_structure = {**equal, "structure": np.full(2, -math.inf)}
    before = changed_total_db(with_structure, WhatIf(name="as it is", motor_db=0))
    assert before == pytest.approx([83.0103, 23.0103], abs=1e-4)
    after = changed_total_db(with_structure, WhatIf.model_validate({"name": "a", **case}))
    assert after - before == pytest.approx([change_db] * 2, abs=1e-12)


def test_nothing_is_left_of_two_sources_that_are_off():
    equal = {"motor": np.array([80.0]), "mesh": np.array([80.0])}
    assert changed_total_db(equal, WhatIf(name="a", motor_db="off", mesh_db="off")) == -math.inf


def test_the_answer_adds_the_energies_of_the_prediction(drive_with):
    model = drive_with()
    answer = answer_of(model, [NEAR])
    assert {level.receiver for level in answer.levels} == {"4 m", "near"}
    assert answer.assumed
    for level in answer.levels:
        sound = model.sound_of(model.gears(next(c for c in model.conditions if c.name == level.condition)), [NEAR])
        held = {p: sound.level_db(level.receiver, p, level.weighting) for p in ("motor", "mesh")}
        path, step = level.case.split(" ", 1)
        less = {"10 dB less": 0.1, "3 dB less": 10.0**-0.3, "off": 0.0}[step]
        energies = {p: 10.0 ** (0.1 * x) * (less if p == path else 1.0) for p, x in held.items()}
        assert level.level_db == pytest.approx(10.0 * math.log10(sum(energies.values())), abs=1e-9)
        assert level.before_db == sound.level_db(level.receiver, "total", level.weighting)
        assert level.change_db == pytest.approx(level.level_db - level.before_db, abs=1e-12)
        assert (level.change_95_db, level.fit_95_db, level.level_95_db) == (None, None, None)


def test_usual_cases_are_of_the_paths_that_sound(drive_with):
    assert answer_of(drive_with()).paths == ("motor", "mesh")
    silent = answer_of(drive_with(level_db="[[10, 100], [20, 100]]"))  # no tone at any speed of the operation
    assert silent.paths == ("mesh",)
    assert [case.name for case in silent.cases] == ["mesh 10 dB less", "mesh 3 dB less", "mesh off"]
    off = [level for level in silent.levels if level.case == "mesh off"]
    assert all(level.level_db is None and level.change_db is None for level in off)
    less = [level for level in silent.levels if level.case == "mesh 10 dB less"]
    assert [level.change_db for level in less] == pytest.approx([-10.0] * len(less), abs=1e-9)


def test_a_source_that_the_total_does_not_add_has_no_usual_case(drive_with):
    model = drive_with(**{"masuda.placement": "inside"})
    answer = answer_of(model)
    assert answer.paths == ("motor",)
    assert {case.name for case in answer.cases} == {"motor 10 dB less", "motor 3 dB less", "motor off"}


# ---------------------------------------------------------------- cases of the fleet

SOFTER = """
[[what_if]]
name = "softer"
parameters = { "gear_dynamics.mesh_damping_ratio" = 0.2, "gear_pair.1.transmission_error_um.1" = 3.0 }
[[what_if]]
name = "softer and quiet"
motor_db = -6
parameters = { "gear_dynamics.mesh_damping_ratio" = 0.2, "gear_pair.1.transmission_error_um.1" = 3.0 }
conditions = ["3"]
"""


def test_a_changed_parameter_is_the_prediction_of_the_changed_fleet(drive_with):
    model = drive_with(SOFTER)
    changed = {"gear_dynamics.mesh_damping_ratio": 0.2, "gear_pair.1.transmission_error_um.1": 3.0}
    other = DriveModel(model.fleet.replaced(changed)).evaluate(receivers=[NEAR])
    answer = answer_of(model, [NEAR])
    for level in answer.levels:
        if level.case == "softer":
            expected = other.sound_of(level.condition).level_db(level.receiver, "total", level.weighting)
            assert level.level_db == expected
    both = [level for level in answer.levels if level.case == "softer and quiet"]
    assert {level.condition for level in both} == {"3"}
    for level in both:
        held = [other.sound_of("3").level_db(level.receiver, path, level.weighting) for path in ("motor", "mesh")]
        expected = 10.0 * math.log10(10.0 ** (0.1 * (held[0] - 6.0)) + 10.0 ** (0.1 * held[1]))
        assert level.level_db == pytest.approx(expected, abs=1e-9)


def test_a_changed_torque_law_moves_the_conditions(drive_with):
    model = drive_with('[[what_if]]\nname = "half"\nparameters = { "operation.torque_n_m" = 2956.5 }\n')
    expected = DriveModel(model.fleet.replaced({"operation.torque_n_m": 2956.5})).evaluate()
    for level in answer_of(model).levels:
        assert level.level_db == expected.sound_of(level.condition).level_db("4 m", "total", level.weighting)


def test_a_condition_that_there_is_not(drive_with):
    model = drive_with('[[what_if]]\nname = "a"\nmotor_db = -3\nconditions = ["9"]\n')
    with pytest.raises(
        FleetError, match="'a': conditions names '9', which is no condition; there are 1, 2, 3, 4, 5, 6"
    ):
        answer_of(model)


def test_a_change_that_does_nothing_is_said(drive_with):
    answer = answer_of(drive_with('[[what_if]]\nname = "a"\nstructure_db = -3\n'))
    assert answer.doubts == (
        "[[what_if]] 'a' changes the path structure, which does nothing here: the total does not add it",
    )
    assert all(level.change_db == 0.0 for level in answer.levels)


def test_gears_that_cannot_be_are_named_with_their_case(drive_with):
    model = drive_with('[[what_if]]\nname = "apart"\nparameters = { "gear_pair.1.centre_distance_mm" = 900 }\n')
    with pytest.raises(FleetError, match=r"\[\[what_if\]\] 'apart': "):
        answer_of(model)


def test_the_table_has_its_columns_and_a_row_a_level(drive_with):
    model = drive_with()
    answer = answer_of(model, [NEAR])
    frame = what_if_table(answer)
    assert list(frame.columns) == COLUMNS["what_if"].split()
    assert len(frame) == len(answer.levels) == 6 * 2 * 2 * 6
    assert frame["change_low_db"].isna().all()
    assert (frame["level_db"] - frame["before_db"]).to_numpy() == pytest.approx(frame["change_db"].to_numpy())


def test_cases_of_a_fleet_stand_instead_of_the_usual_ones(drive_with):
    model = drive_with(SOFTER)
    cases, paths = cases_of(model.fleet, model.evaluate().sound)
    assert [case.name for case in cases] == ["softer", "softer and quiet"]
    assert paths == ("motor", "mesh")
    assert changed_fleet(model.fleet, cases[0]).get("gear_dynamics.mesh_damping_ratio").origin == "what if: softer"
