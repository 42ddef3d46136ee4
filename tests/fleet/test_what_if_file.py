"""``[[what_if]]`` of a fleet file: what it may say, what it is refused for, and that it is written as it was read."""

import math

import pytest
from plain_fleets import plain_fleet

from tdacoustic.errors import FleetError
from tdacoustic.fleet import fleet_toml, load_fleet

HEAD = '[[what_if]]\nname = "quiet"\n'


@pytest.fixture
def fleet_with(tmp_path):
    """Load the reference drive with more tables at its end."""

    def made(text):
        path = tmp_path / "fleet.toml"
        path.write_text(f"{plain_fleet('reference-drive').read_text(encoding='utf-8')}\n{text}", encoding="utf-8")
        return load_fleet(path)

    return made


def test_changes_in_db_and_of_parameters(fleet_with):
    text = 'motor_db = -10\nmesh_db = "off"\nconditions = [1, "2"]\n'
    (case,) = fleet_with(f'{HEAD}{text}parameters = {{ "gear_dynamics.mesh_damping_ratio" = 0.1 }}').what_if
    assert (case.gain_db("motor"), case.gain_db("structure"), case.gain_db("mesh")) == (-10.0, 0.0, -math.inf)
    assert case.stated_paths == ("motor", "mesh")
    assert case.parameters == (("gear_dynamics.mesh_damping_ratio", 0.1),)
    assert case.conditions == ("1", "2")


def test_keys_without_quotes_mean_the_same(fleet_with):
    quoted = fleet_with(f'{HEAD}parameters = {{ "gear_dynamics.mass_kg.2" = 300, "masuda.constant_db" = 1.5 }}')
    bare = fleet_with(f"{HEAD}parameters = {{ gear_dynamics.mass_kg.2 = 300, masuda.constant_db = 1.5 }}")
    assert bare.what_if == quoted.what_if


def test_written_and_read_again(fleet_with, tmp_path):
    fleet = fleet_with(
        f'{HEAD}motor_db = 2.5\n[[what_if]]\nname = "b"\nmesh_db = "off"\nconditions = ["1"]\n'
        'parameters = { "gear_pair.1.transmission_error_um" = [3, 1], "gear_dynamics.mass_kg.2" = 300 }\n'
    )
    (tmp_path / "again.toml").write_text(fleet_toml(fleet), encoding="utf-8")
    again = load_fleet(tmp_path / "again.toml")
    assert again.what_if == fleet.what_if
    assert again == fleet
    assert hash(again) == hash(fleet)


def test_a_changed_fleet_keeps_its_cases(fleet_with):
    fleet = fleet_with(f"{HEAD}motor_db = -10")
    assert fleet.replaced({"masuda.constant_db": 3.0}).what_if == fleet.what_if


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "[[what_if]] 'quiet': names no change: motor_db, structure_db, mesh_db or parameters is needed"),
        ("parameters = {}", "parameters must name a key with its new value"),
        ("motor_db = -1\nparameters = {}", "got an empty table; leave it out where no parameter changes"),
        (
            'parameters = { "masuda.constant_db" = 1, masuda.constant_db = 2 }',
            "parameters names 'masuda.constant_db' twice, with and without quotes",
        ),
        (
            "motor_db = nan",
            "[[what_if]] 'quiet': motor_db must be a change in dB, below 0 for quieter, or \"off\", got nan",
        ),
        ("motor_db = inf", "must be a change in dB"),
        ('motor_db = "of"', "got 'of'"),
        ("motor_db = true", "got true"),
        ("mesh_db = -1000", 'mesh_db must be from -100 to 100 dB, or "off", got -1000'),
        ("motr_db = -3", "unknown key 'motr_db' in [[what_if]]; the nearest known key is 'motor_db'"),
        (
            'parameters = { "gear_dynamics.mesh_dampin_ratio" = 0.1 }',
            "[[what_if]] 'quiet': unknown parameter 'gear_dynamics.mesh_dampin_ratio'; the nearest known one is "
            "'gear_dynamics.mesh_damping_ratio'",
        ),
        (
            'parameters = { "gear_dynamics.mesh_damping_ratio" = 3 }',
            "[[what_if]] 'quiet': [gear_dynamics]: mesh_damping_ratio must be <= 1, got 3",
        ),
        (
            'parameters = { "masuda.constant_db" = nan }',
            "masuda.constant_db must be a number or a list of numbers, got nan",
        ),
        ('parameters = { "masuda.placement" = "off" }', "masuda.placement must be a number or a list of numbers"),
        ('parameters = { "gear_dynamics.mass_kg.3" = 3 }', "gear_dynamics.mass_kg has no such entry"),
        ("parameters = 3", "parameters must be a table of keys of the fleet and their values, got 3"),
        (
            'parameters = { "radiation.sphere_radius_m" = 3 }',
            "radiation.sphere_radius_m says where and at which speeds levels are wanted, not what the drive is",
        ),
        ('parameters = { "operation.train_speed_km_h.1" = 3 }', "at which speeds levels are wanted"),
        ("motor_db = -1\nconditions = []", "conditions must have at least 1 entry"),
        ('motor_db = -1\nconditions = ["1", "1"]', "conditions names '1' twice"),
        (f"motor_db = -1\n{HEAD}motor_db = -2", "[[what_if]]: the name 'quiet' stands twice"),
    ],
)
def test_what_is_refused_is_one_line(fleet_with, text, message):
    with pytest.raises(FleetError) as error:
        fleet_with(HEAD + text)
    assert message in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_a_name_is_one_and_the_table_is_a_list(fleet_with):
    with pytest.raises(FleetError, match="name '<b>' begins with '<', allowed is a letter or digit"):
        fleet_with('[[what_if]]\nname = "<b>"\nmotor_db = -1')
    with pytest.raises(FleetError, match=r"\[\[what_if\]\] 1: name is missing"):
        fleet_with("[[what_if]]\nmotor_db = -1")
    with pytest.raises(FleetError, match=r"what_if must be written as .*, with two brackets"):
        fleet_with('[what_if]\nname = "a"\nmotor_db = -1')
