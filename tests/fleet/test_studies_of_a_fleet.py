"""``[[sweep]]``, ``[[reference]]`` and ``[[feature]]`` in a fleet's file."""

import dataclasses
from pathlib import Path

import pytest
from plain_fleets import plain_fleet

from tdacoustic.errors import FleetError
from tdacoustic.fleet import fleet_toml, load_fleet
from tdacoustic.fleet.design_sweep import Range
from tdacoustic.fleet.study_problems import check_studies

ROOT = Path(__file__).resolve().parents[2]

ASKED = """
[[sweep]]
name = "Damping and width"
conditions = ["1", 3]
[sweep.parameters]
"gear_dynamics.mesh_damping_ratio" = [0.02, 0.05]
"gear_pair.1.face_width_mm" = [100, 120, 140]
"model.gear_path" = ["masuda", "sum"]

[[reference]]
quantity = "spl_4m_db"
condition = ["4", "5"]
value = 88
kind = "measured"
tolerance = 2
origin = "a book"

[[reference]]
quantity = "dte_pp_um"
helix_angle_deg = 8
value = 14.8
origin = "a book"

[[feature]]
name = "Level"
quantity = "spl_4m_db"
shape = "highest_at"
at = ["4", "5"]
origin = "a book"

[[feature]]
quantity = "spl_4m_db"
over = "helix"
shape = "lowest_at"
at = [12, 0.1]
origin = "a book"
"""


@pytest.fixture
def load(tmp_path):
    def of_text(more):
        path = tmp_path / "fleet.toml"
        head = plain_fleet("crrc-freight").read_text(encoding="utf-8")
        path.write_text(head + more, encoding="utf-8")
        return load_fleet(path)

    return of_text


def test_what_is_asked_is_read(load):
    fleet = load(ASKED)
    (sweep,) = fleet.sweep
    assert (sweep.n_points, sweep.sampling) == (12, "grid")
    assert sweep.conditions == ("1", "3")
    assert [one.condition for one in fleet.reference] == [("4", "5"), None]
    assert [one.tolerated for one in fleet.reference] == [2.0, 1.0]
    assert [one.label for one in fleet.feature] == ["Level", "spl_4m_db lowest at over the helix angles"]
    assert fleet.feature[1].at == ("12", "0.1")
    assert not any(stated.key.startswith(("sweep", "reference", "feature")) for stated in fleet.parameters())


def test_it_is_written_as_it_was_and_stays_with_a_changed_fleet(load, tmp_path):
    fleet = load(ASKED)
    again = tmp_path / "again.toml"
    again.write_text(fleet_toml(fleet), encoding="utf-8")
    assert load_fleet(again) == fleet
    changed = fleet.replaced({"masuda.constant_db": 1.0})
    assert (changed.sweep, changed.reference, changed.feature) == (fleet.sweep, fleet.reference, fleet.feature)


def one_sweep(parameters, more=""):
    return f'[[sweep]]\nname = "one"\nparameters = {{ {parameters} }}\n{more}'


def one_feature(more):
    return f'[[feature]]\nquantity = "spl_4m_db"\norigin = "a book"\n{more}\n'


def one_reference(more):
    return f'[[reference]]\norigin = "a book"\n{more}\n'


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (one_sweep('"gear_dynamics.mesh_damping" = ["always"], "gear_dynamics.mesh_dampin_ratio" = [0.1]'),
         r"\[\[sweep\]\] 'one': unknown parameter 'gear_dynamics.mesh_dampin_ratio'; the nearest known one is "
         r"'gear_dynamics.mesh_damping_ratio'"),
        (one_sweep('"gear_dynamics.mass_kg.3" = [1.0]'), r"\[\[sweep\]\] 'one': gear_dynamics.mass_kg.3: "),
        (one_sweep('"masuda.constant_db" = [20, 20]'), r"parameters names 20 twice for 'masuda.constant_db'"),
        (one_sweep('"masuda.constant_db" = 20'), r"must have a list of values for 'masuda.constant_db', got 20"),
        (one_sweep(""), r"parameters must name a key with a list of values, as .*, got an empty table"),
        (one_sweep('"masuda.constant_db" = []'), r"must have a list of values for 'masuda.constant_db', got \[\]"),
        (one_sweep('"masuda.constant_db" = [1, nan]'), r"must have finite values for 'masuda.constant_db', got nan"),
        (one_sweep('"masuda.constant_db" = [1, -inf]'), r"must have finite values for 'masuda.constant_db', got -inf"),
        (one_sweep('"gear_dynamics.mass_kg" = [[60, nan]]'), r"must have finite values for .*, got \[60, nan\]"),
        (one_sweep('"masuda.constant_db" = [1, true]'),
         r"\[\[sweep\]\] 'one': parameters must have numbers for 'masuda.constant_db', got true"),
        (one_sweep('"gear_dynamics.mass_kg.1" = ["60", 70, "x"]'), r"must have numbers for .*, got '60', 'x'"),
        (one_sweep('"gear_dynamics.mass_kg" = [[60, "x"]]'), r"must have numbers for .*, got \[60, 'x'\]"),
        (one_sweep('"masuda.weighting" = ["A", 1]'), r"must have words for 'masuda.weighting', got 1"),
        (one_sweep('"masuda.weighting" = ["A", "B"]'), r"\[masuda\]: weighting must be one of Z, A, got 'B'"),
        (one_sweep('"radiation.air_absorption" = [true, 1]'), r"must have true or false for .*, got 1"),
        (one_sweep('"masuda.constant_db" = [1], masuda.constant_db = [2]'), r"'masuda.constant_db' twice, with and"),
        (one_sweep('"masuda.constant_db" = [1]', 'conditions = ["1", 1]'), r"conditions names '1' twice"),
        (one_sweep('"masuda.constant_db" = [1]', 'conditions = ["7"]'),
         r"there is no condition '7'; the nearest is .*; there are 1, 2"),
        (one_sweep('"masuda.constant_db" = [1]', 'conditions = ["1", "7", "x"]'),
         r"there is no condition '7', 'x'; there are 1, 2, 3, 4, 5, 6"),
        (one_sweep('"masuda.constant_db" = [1]') + one_sweep('"masuda.constant_db" = [2]'),
         r"\[\[sweep\]\]: the name 'one' stands twice"),
        (one_sweep('"masuda.constant_db" = [1]', 'condition = ["1"]'), r"unknown key 'condition' in \[\[sweep\]\]"),
        (one_reference('quantity = "spl_db"\ncondition = "1"\nvalue = 1'), r"quantity must be one of spl_4m_db, "),
        (one_reference('quantity = "spl_4m_db"\nvalue = 1'), r"one of condition and helix_angle_deg must be given"),
        (one_reference('quantity = "spl_4m_db"\ncondition = "9"\nvalue = 1'), r"there is no condition '9'"),
        (one_reference('quantity = "spl_4m_db"\nhelix_angle_deg = 5\nvalue = 1'), r"there is no helix angle 5°"),
        (one_reference('quantity = "dte_pp_um"\ncondition = "1"\nvalue = 0'), r"value must be > 0 for dte_pp_um"),
        (one_reference('quantity = "pattern"\ncondition = "1"\nvalue = 1'), r"'pattern' has no value to refer to"),
        ('[[reference]]\nquantity = "spl_4m_db"\ncondition = "1"\nvalue = 1\n', r"origin is missing"),
        (one_feature('shape = "rise"'), r"shape must be one of rises, falls"),
        (one_feature('shape = "highest_at"'), r"shape = 'highest_at' needs at"),
        (one_feature('shape = "rises"\nat = ["1"]'), r"shape = 'rises' has no use for at"),
        (one_feature('shape = "rises"\nat = ["1"]\nvalue = 3'), r"shape = 'rises' has no use for at and value"),
        (one_feature('shape = "above"\nvalue = 3'), r"shape = 'above' needs than and has no use for value"),
        (one_feature('shape = "highest_at"\nat = ["1", "2", "3", "4", "5", "6"]'),
         r"at names all conditions, so that nothing is said: leave out where the highest value is not"),
        (one_feature('shape = "lowest_at"\nover = "helix"\nat = [0.1, 4, 8, 12]'), r"at names all helix angles"),
        (one_feature('shape = "highest_at"\nat = ["8", "1", "9"]'), r"there is no condition '8', '9'; there are 1, "),
        (one_feature('shape = "highest_at"\nover = "helix"\nat = [8.5, 4, 9]'), r"there is no helix angle 8.5°, 9°"),
        (one_feature('shape = "span"\nvalue = -10'), r"value must be > 0 for shape = 'span', got -10"),
        (one_feature('shape = "above"\nthan = ["mesh_spl_4m_db", "mesh_spl_4m_db"]'), r"'mesh_spl_4m_db' twice"),
        (one_feature('shape = "span"\nvalue = nan'), r"value must be .*, got nan"),
        (one_reference('quantity = "spl_4m_db"\ncondition = "1"\nvalue = 1') * 2,
         r"\[\[reference\]\] 2: says the same as \[\[reference\]\] 1"),
        (one_feature('shape = "highest_at"\nat = ["1", "1"]'), r"names '1' twice"),
        (one_feature('shape = "highest_at"\nat = ["8"]'), r"there is no condition '8'"),
        (one_feature('shape = "highest_at"\nover = "helix"\nat = [8.5]'), r"there is no helix angle 8.5°"),
        (one_feature('shape = "span"'), r"shape = 'span' needs value"),
        (one_feature('shape = "above"\nthan = ["dte_pp_um"]'), r"than must name quantities of one kind"),
        (one_feature('shape = "alike"\nvalue = 0.8'), r"quantity 'pattern' and shape 'alike' go together"),
        (one_feature('shape = "rises"\ntolerance = -1'), r"tolerance must be >= 0"),
        (one_feature('shape = "rises"') + one_feature('shape = "rises"'), r"\[\[feature\]\]: the name .* stands twice"),
    ],
    ids=lambda value: value[:60].replace("\n", " ") if value.startswith("[[") else "",
)  # fmt: skip
def test_what_is_wrong_is_named(load, more, message):
    with pytest.raises(FleetError, match=message):
        load(more)


def test_keys_of_a_sweep_without_quotes_mean_the_same(load):
    quoted = load(one_sweep('"masuda.constant_db" = [20, 30], "gear_dynamics.mass_kg.2" = [280, 300]'))
    assert load(one_sweep("masuda.constant_db = [20, 30], gear_dynamics.mass_kg.2 = [280, 300]")).sweep == quoted.sweep


def test_a_number_for_a_table_and_a_number_out_of_range_are_points(load):
    both = '"gear_pair.1.transmission_error_um" = [5, [5, 1]], "gear_dynamics.mesh_damping_ratio" = [2]'
    assert load(one_sweep(both)).sweep[0].n_points == 2


def test_conditions_that_a_campaign_names_are_checked_against_it(load):
    text = one_sweep('"masuda.constant_db" = [1]', 'conditions = ["slow", "fast"]')
    fleet = load(text.replace("slow", "1").replace("fast", "2"))
    check_studies(fleet, ["a"])  # its own [operation] was held against them when it was read
    bare = dataclasses.replace(fleet, operation=fleet.operation.model_copy(update={"train_speed_km_h": None}))
    if bare.operation.names:
        bare = dataclasses.replace(bare, operation=bare.operation.model_copy(update={"condition_names": None}))
    assert not bare.operation.names
    check_studies(bare, ["1", "2", "3"])
    with pytest.raises(FleetError, match=r"\[\[sweep\]\] 'one': there is no condition '2'; the nearest is '3'"):
        check_studies(dataclasses.replace(bare, reference=(), feature=()), ["1", "3"])


def test_too_many_points_are_refused_with_their_number(load):
    values = ", ".join(str(number) for number in range(1, 321))
    with pytest.raises(FleetError, match="has 320 x 320 = 102400 points, allowed are 100000"):
        load(one_sweep(f'"masuda.constant_db" = [{values}], "operation.torque_n_m" = [{values}]'))


HYPERCUBE = 'sampling = "latin_hypercube"\npoints = 200'
SALTELLI = 'sampling = "saltelli"\nbase_points = 128'
LEVEL = '"masuda.constant_db" = { from = 18, to = 26 }'
DAMPING = '"gear_dynamics.mesh_damping_ratio" = { from = 0.02, to = 0.2, scale = "log" }'


def test_ranges_are_read_and_written(load, tmp_path):
    fleet = load(one_sweep(f"{LEVEL}, {DAMPING}", f"{HYPERCUBE}\nseed = 7"))
    (sweep,) = fleet.sweep
    assert (sweep.n_points, sweep.seed) == (200, 7)
    assert sweep.ranges == (Range(18, 26), Range(0.02, 0.2, "log"))
    again = tmp_path / "again.toml"
    again.write_text(fleet_toml(fleet), encoding="utf-8")
    assert load_fleet(again).sweep == fleet.sweep
    plain = "masuda.constant_db = { from = 18, to = 26 }, gear_dynamics.mesh_damping_ratio.from = 0.02"
    plain += ', gear_dynamics.mesh_damping_ratio.to = 0.2, gear_dynamics.mesh_damping_ratio.scale = "log"'
    assert load(one_sweep(plain, f"{HYPERCUBE}\nseed = 7")).sweep == fleet.sweep
    assert load(one_sweep(f"{LEVEL}, {DAMPING}", SALTELLI)).sweep[0].n_points == 128 * 4


@pytest.mark.parametrize(
    ("parameters", "more", "message"),
    [
        (LEVEL, "", r"has a range for 'masuda.constant_db': a grid takes lists of values; ranges need sampling = "),
        ('"masuda.constant_db" = [18, 26]', HYPERCUBE, r"has a list of values for 'masuda.constant_db': sampling = .*"
         r"takes ranges, as \{ \"masuda.constant_db\" = \{ from = 18, to = 26 \} \}"),
        (LEVEL, 'sampling = "hypercube"', r"sampling must be one of grid, latin_hypercube, saltelli, got 'hypercube'"),
        (LEVEL, 'sampling = "latin_hypercube"', r"sampling = 'latin_hypercube' needs points$"),
        (LEVEL, 'sampling = "saltelli"\npoints = 64', r"sampling = 'saltelli' needs base_points and has no use for "
         r"points"),
        ('"masuda.constant_db" = [18, 26]', "points = 4\nseed = 1", r"'grid' has no use for points and seed"),
        (LEVEL, 'sampling = "saltelli"\nbase_points = 100', r"must be a power of two, as 64 or 128, got 100"),
        (LEVEL, 'sampling = "saltelli"\nbase_points = 65536', r"base_points has 65536 x 3 = 196608 points, "),
        (LEVEL, 'sampling = "latin_hypercube"\npoints = 100001', r"points must be <= 100000, got 100001"),
        (LEVEL, 'sampling = "latin_hypercube"\npoints = 1', r"points must be >= 2, got 1"),
        (LEVEL, f"{HYPERCUBE}\nseed = -1", r"seed must be >= 0, got -1"),
        (LEVEL, f"{HYPERCUBE}\nseeds = 1", r"unknown key 'seeds' in \[\[sweep\]\]; the nearest known key is 'seed'"),
        ('"masuda.constant_db" = { from = 18, too = 26 }', HYPERCUBE, r"names an unknown key 'too' in the range of "
         r"'masuda.constant_db'; the nearest known key is 'to'"),
        ('"masuda.constant_db" = { from = 18 }', HYPERCUBE, r"a finite number as to in .*, got none"),
        ('"masuda.constant_db" = { from = "a", to = 2 }', HYPERCUBE, r"a finite number as from in .*, got 'a'"),
        ('"masuda.constant_db" = { from = 18, to = inf }', HYPERCUBE, r"a finite number as to in .*, got inf"),
        ('"masuda.constant_db" = { from = 26, to = 18 }', HYPERCUBE, r"from < to in .*, got from = 26 and to = 18"),
        ('"masuda.constant_db" = { from = 18, to = 26, scale = "ln" }', HYPERCUBE, r"a scale of linear or log .* 'ln'"),
        ('"masuda.constant_db" = { from = 0, to = 26, scale = "log" }', HYPERCUBE, r'from > 0 .* scale = "log", got 0'),
        ('"masuda.constant" = { from = 18, to = 26 }', HYPERCUBE, r"unknown parameter 'masuda.constant'; the nearest"),
        ('"gear_dynamics.mass_kg" = { from = 18, to = 26 }', HYPERCUBE, r"'gear_dynamics.mass_kg', which is a list: "
         r"name one of its entries, as 'gear_dynamics.mass_kg.1'"),
        ('"model.gear_path" = { from = 18, to = 26 }', HYPERCUBE, r"which is no number: it is 'masuda'"),
        ('"radiation.air_absorption" = { from = 0, to = 1 }', HYPERCUBE, r"which is no number: it is false"),
        ('"gear_pair.1.teeth.1" = { from = 28.5, to = 32 }', HYPERCUBE, r"must have whole numbers as from and to"),
        ('"gear_dynamics.mesh_damping_ratio" = { from = 0.1, to = 2 }', HYPERCUBE, r"the range of "
         r"'gear_dynamics.mesh_damping_ratio' reaches too far: .* mesh_damping_ratio must be <= 1, got 2"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_range_is_named_in_one_line(load, parameters, more, message):
    with pytest.raises(FleetError, match=message) as caught:
        load(one_sweep(parameters, more))
    assert "[[sweep]] 'one': " in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
