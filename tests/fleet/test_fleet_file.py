import math
import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tdacoustic.errors import FleetError, MissingFileError, TdacousticError
from tdacoustic.fleet import SCHEMA, Fleet, Parameter, fleet_toml, load_fleet
from tdacoustic.fleet.sections import SECTIONS
from tdacoustic.toml_models import steering_sign

ROOT = Path(__file__).resolve().parents[2]
HEAD = f'schema = "{SCHEMA}"\n'
TRAIN = "[train]\nwheel_diameter_mm = 1051.12\n"
PAIR = "[[gear_pair]]\nteeth = [31, 104]\n"
LEAST = HEAD + TRAIN + PAIR

FULL = f"""
schema = "{SCHEMA}"
name = "Reference \\"drive\\" Ö"

[meta]
owner = "us"
wear = {{ wheel = 0.5, where = ["a", "b"] }}

[train]
wheel_diameter_mm = {{ value = 1051.12, origin = "paper, Table 1" }}

[[gear_pair]]
name = "fast"
normal_module_mm = {{ value = 7.35, origin = "paper, Table 3" }}
teeth = [31, 104]
pressure_angle_deg = 20
helix_angle_deg = 4
addendum_coefficient = 1.2
clearance_coefficient = 0.35
profile_shift = [0.27807, -0.59026]
centre_distance_mm = 495
face_width_mm = 120
backlash_um = 200
transmission_error_um = [5, 0.1]

[[gear_pair]]
teeth = [25, 50]

[gear_dynamics]
mass_kg = [60, 280]
inertia_kg_m2 = [0.35, 22]
pinion_bearing_stiffness_n_per_m = [1e9, 1e9, 3e8]
wheel_bearing_stiffness_n_per_m = [1.2e9, 1.2e9, 4e8]
bearing_damping_ratio = 0.05
mesh_damping_ratio = {{ value = 0.05, origin = "calibrated", stderr = 0.01 }}
mesh_damping = "contact"

[operation]
train_speed_km_h = [20, 30, 114.455]
condition_names = [1, "two", "3"]
mode = {{ value = "brake", origin = "log" }}
torque = "table"
torque_n_m = -100
power_kw = 1200
resistance_n = [1000, 10, 0.1]
torque_table = [[0, 5000], [100, 4000]]
helix_angle_deg = [0.1, 4, 8, 12]

[masuda]
constant_db = 21
placement = "inside"
displacement = "static_ratio"
weighting = "A"
position_m = [0.2, 0.0, 0.6]

[model]
gear_path = "sum"
structure_gain_db = -1.5
gear_pair = "2"

[motor]
pole_pairs = 2
slip = 0.01
carrier_hz = [[0, 463], [1100, 463]]
position_m = [0, 0.45, 0.3]
frame_radius_mm = 460
frame_length_mm = 500
frame_thickness_mm = 20
core_radius_mm = 420
core_length_mm = 400
core_thickness_mm = 60
frame_modulus_gpa = 210
core_modulus_gpa = 150
density_kg_m3 = 7850
added_mass_kg = 0
loss_factor = 0.02

[[motor.excitation]]
name = "2fc"
order = 0
carrier = 2
flux_density_t = [[0, 0.2, 0.1], [1100, 0.3, 0.1]]
standing = true

[[motor.excitation]]
name = "side/2"
order = 4
carrier = 2
supply = -2
shaft = 1
fixed_hz = 0.5
sound_power_level_db = 95

[housing]
size_m = [0.45, 1.0, 0.9]
position_m = [0.0, -0.3, 0.0]
wall_mm = 12
bearing_panel_mm = 14
top_bottom_mm = 10
material = {{ modulus_gpa = 210, density_kg_m3 = {{ value = 7850, origin = "handbook" }}, poisson = 0.3 }}
loss_factor = 0.02
hanger_stiffness_n_per_m = 1e7
step_file = 'cad\\box.step'

[[housing.seat]]
shaft = "pinion"
position_m = [0.2, -0.3, 0]
radius_m = 0.14
thickness_mm = 60
stiffness_n_per_m = [1e9, 1e9, 3e8]

[radiation]
method = "boundary_elements"
space = "half"
max_frequency_hz = 1500
elements_per_wavelength = 11
sphere_radius_m = 4
circle_radius_m = 12
temperature_degc = -5
humidity_percent = 40
air_absorption = true
map_conditions = ["3", 5]
map_half_width_m = 1.2
map_spacing_m = 0.04
"""


@pytest.fixture
def load(tmp_path):
    def of_text(text):
        (tmp_path / "fleet.toml").write_text(text, encoding="utf-8")
        return load_fleet(tmp_path)

    return of_text


def test_the_least_that_the_measured_side_needs(load, tmp_path):
    fleet = load(LEAST)
    assert fleet.name == tmp_path.name
    assert fleet.train.wheel_diameter_m == pytest.approx(1.05112)
    assert fleet.gear_pair[0].teeth == Parameter((31, 104), "assumed")
    assert fleet.gear_pair[0].name == "1"
    assert (fleet.gear_dynamics, fleet.motor, fleet.housing) == (None, None, None)
    assert fleet.operation.train_speed_km_h is None and fleet.operation.names == ()


def test_defaults_are_those_of_the_contract_and_say_so(load):
    values = {stated.key: (stated.value, stated.origin) for stated in load(LEAST).parameters()}
    values.pop("train.wheel_diameter_mm"), values.pop("gear_pair.1.teeth")
    default = "assumed, default"
    assert values == {
        "gear_pair.1.pressure_angle_deg": (20.0, default),
        "operation.mode": ("traction", default),
        "operation.torque": ("constant", default),
        "masuda.constant_db": (20.0, "paper, equation (8)"),
        "masuda.placement": ("free", default),
        "masuda.displacement": ("um_pp", default),
        "masuda.weighting": ("Z", default),
        "model.gear_path": ("masuda", default),
        "model.structure_gain_db": (0.0, default),
        "model.motor_gain_db": (0.0, default),
        "model.coupling": ("one_way", default),
        "radiation.method": ("point_sources", default),
        "radiation.space": ("free", default),
        "radiation.max_frequency_hz": (3000.0, default),
        "radiation.elements_per_wavelength": (7.5, default),
        "radiation.sphere_radius_m": (4.0, "paper, section 5.1"),
        "radiation.circle_radius_m": (12.0, "paper, section 5.1"),
        "radiation.temperature_degc": (20.0, default),
        "radiation.humidity_percent": (50.0, default),
        "radiation.air_absorption": (False, default),
        "radiation.map_half_width_m": (1.5, default),
        "radiation.map_spacing_m": (0.05, default),
    }


def test_the_whole_contract_is_read(load, tmp_path):
    fleet = load(FULL)
    assert fleet.name == 'Reference "drive" Ö'
    assert fleet.meta == (("owner", "us"), ("wear.wheel", "0.5"), ("wear.where", "a, b"))
    assert [pair.name for pair in fleet.gear_pair] == ["fast", "2"]
    assert fleet.modelled_pair is fleet.gear_pair[1] and fleet.modelled_pair_number == 2
    assert fleet.gear_pair[0].normal_module_mm == Parameter(7.35, "paper, Table 3")
    assert fleet.gear_dynamics.mesh_damping_ratio == Parameter(0.05, "calibrated", 0.01)
    assert fleet.operation.names == ("1", "two", "3")
    assert fleet.operation.mode == Parameter("brake", "log")
    assert fleet.operation.torque_table.value == ((0.0, 5000.0), (100.0, 4000.0))
    assert fleet.motor.excitation[0].flux_density_t.value == ((0.0, 0.2, 0.1), (1100.0, 0.3, 0.1))
    assert fleet.motor.excitation[1].terms == (2.0, -2.0, 1.0, 0.5)
    assert fleet.housing.material.density_kg_m3.origin == "handbook"
    assert fleet.housing.hanger_stiffness_n_per_m.value == (1e7, 1e7, 1e7)
    assert fleet.step_path == tmp_path / "cad" / "box.step"
    assert fleet.folder == tmp_path


def test_every_key_of_the_contract_is_in_the_full_file(load):
    fleet = load(FULL)
    for section in (fleet.train, fleet.gear_pair[0], fleet.gear_dynamics, fleet.operation, fleet.masuda, fleet.model):
        assert {key for key, value in section if value is None} == set()
    for section in (fleet.motor, fleet.housing, fleet.housing.seat[0], fleet.housing.material, fleet.radiation):
        assert {key for key, value in section if value is None} == set()


def test_what_is_written_loads_to_an_equal_fleet(load, tmp_path):
    for text in (LEAST, FULL):
        fleet = load(text)
        (tmp_path / "again").mkdir(exist_ok=True)
        again = tmp_path / "again" / "fleet.toml"
        again.write_text(fleet_toml(fleet), encoding="utf-8")
        assert load_fleet(again) == fleet
        assert load_fleet(again).path != fleet.path
        assert fleet_toml(load_fleet(again)) == fleet_toml(fleet)


numbers = st.floats(allow_nan=False, allow_infinity=False)
WORDS = st.text(min_size=1).filter(lambda text: text.strip() and steering_sign(text) is None)


@settings(max_examples=100, deadline=None)
@given(numbers, st.floats(1e-300, 1e300), WORDS, st.floats(0, 1e300))
def test_any_number_and_any_words_of_origin_survive_writing(tmp_path_factory, constant, module, origin, stderr):
    path = tmp_path_factory.getbasetemp() / "any" / "fleet.toml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(LEAST)
    values = {"masuda.constant_db": constant, "gear_pair.1.normal_module_mm": module}
    try:
        origin.encode()
    except UnicodeEncodeError:
        return
    fleet = load_fleet(path).replaced(values, stderr={"masuda.constant_db": stderr}, origin=origin)
    path.write_text(fleet_toml(fleet), encoding="utf-8", newline="")
    assert load_fleet(path) == fleet
    assert load_fleet(path).get("masuda.constant_db") == Parameter(constant, origin, stderr)


def test_a_fleet_goes_to_another_process_and_into_a_set(load):
    fleet = load(FULL)
    assert pickle.loads(pickle.dumps(fleet)) == fleet
    assert len({fleet, load(FULL)}) == 1
    with pytest.raises(AttributeError):
        fleet.name = "x"
    with pytest.raises(AttributeError):
        fleet.train.wheel_diameter_mm.value = 1.0


def test_every_parameter_is_found_under_its_key(load):
    fleet = load(FULL)
    stated = list(fleet.parameters())
    assert len({parameter.key for parameter in stated}) == len(stated) > 70
    for key, value, origin, stderr in stated:
        assert fleet.get(key) == Parameter(value, origin, stderr)
        assert fleet.replaced({key: value}, origin=origin).get(key).value == value
    assert {parameter.key.split(".")[0] for parameter in stated} == set(SECTIONS)


def test_a_replaced_value_is_a_copy_with_its_origin(load):
    fleet = load(FULL)
    calibrated = fleet.replaced(
        {"masuda.constant_db": 21.3, "gear_pair.2.face_width_mm": 100}, stderr={"masuda.constant_db": 0.4}
    )
    assert calibrated.get("masuda.constant_db") == Parameter(21.3, "calibrated", 0.4)
    assert calibrated.get("gear_pair.2.face_width_mm") == Parameter(100.0, "calibrated")
    assert fleet.get("masuda.constant_db") == Parameter(21.0, "assumed")
    assert calibrated.name == fleet.name and calibrated.meta == fleet.meta and calibrated.path == fleet.path
    changed = {"masuda.constant_db", "gear_pair.2.face_width_mm"}
    before = {stated.key: stated for stated in fleet.parameters()}
    assert {s.key for s in calibrated.parameters() if before.get(s.key) != s} == changed


def test_a_value_can_open_a_section(load):
    fleet = load(LEAST).replaced({"gear_dynamics.mesh_damping_ratio": 0.1}, origin="guess")
    assert fleet.gear_dynamics.mesh_damping_ratio == Parameter(0.1, "guess")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"masuda.constant": 1}, r"unknown parameter 'masuda.constant'; the nearest known one is 'masuda.constant_db'"),
        ({"masuda.placement": "outside"}, r"\[masuda\]: placement must be one of free, inside, off, got 'outside'"),
        ({"gear_pair.3.face_width_mm": 1}, r"gear_pair.3.face_width_mm: there are 2 \[\[gear_pair\]\], not 3"),
        ({"gear_pair.0.face_width_mm": 1}, "unknown parameter 'gear_pair.0.face_width_mm'"),
        ({"gear_pair.1.name": "x"}, "unknown parameter 'gear_pair.1.name'"),
        ({"gear_pair.1.face_width_mm": -1}, r"\[\[gear_pair\]\] 'fast': face_width_mm must be > 0, got -1"),
        ({"masuda.constant_db": math.nan}, r"\[masuda\]: constant_db must be a finite number, got nan"),
        ({"housing.seat.2.radius_m": 1}, r"housing.seat.2.radius_m: there are 1 \[\[housing.seat\]\], not 2"),
    ],
)
def test_what_cannot_be_replaced_is_refused(load, values, message):
    with pytest.raises(FleetError, match=r"fleet\.toml: .*" + message):
        load(FULL).replaced(values)


def test_the_error_of_a_value_that_is_not_replaced_is_refused(load):
    with pytest.raises(FleetError, match=r"stderr of model.structure_gain_db, which is not replaced"):
        load(FULL).replaced({"masuda.constant_db": 1.0}, stderr={"model.structure_gain_db": 1.0})


def test_numbers_in_si(load):
    fleet = load(FULL)
    assert fleet.number("gear_pair.1.normal_module_mm") == pytest.approx(7.35e-3)
    assert fleet.number("gear_pair.1.backlash_um") == pytest.approx(200e-6)
    assert fleet.number("gear_pair.1.pressure_angle_deg") == pytest.approx(math.radians(20))
    assert fleet.numbers("gear_pair.1.transmission_error_um") == pytest.approx((5e-6, 0.1e-6))
    assert fleet.numbers("operation.train_speed_km_h")[0] == pytest.approx(20 / 3.6)
    assert fleet.number("operation.power_kw") == pytest.approx(1.2e6)
    assert fleet.number("housing.material.modulus_gpa") == pytest.approx(210e9)
    assert fleet.number("radiation.temperature_degc") == pytest.approx(268.15)
    assert fleet.number("radiation.humidity_percent") == pytest.approx(0.4)
    assert fleet.numbers("gear_dynamics.mass_kg") == (60.0, 280.0)
    for key in ("gear_pair.1.teeth", "masuda.weighting", "radiation.air_absorption"):
        with pytest.raises(FleetError, match=f"{key} is no single number"):
            fleet.number(key)
    with pytest.raises(FleetError, match=r"operation\.torque_table is no list of numbers"):
        fleet.numbers("operation.torque_table")


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("gear_pair.1.face_width_mm", r"\[\[gear_pair\]\]: face_width_mm is missing, and it is needed here"),
        ("motor.loss_factor", r"\[motor\]: loss_factor is missing"),
        ("housing.material.poisson", r"\[housing.material\]: poisson is missing"),
        ("motor.excitation.1.order", r"order is missing"),
        ("radiation.sphere_radius", r"unknown parameter .* nearest known one is 'radiation.sphere_radius_m'"),
    ],
)
def test_a_model_that_needs_what_is_not_there_says_what(load, key, message):
    with pytest.raises(FleetError, match=r"fleet\.toml: .*" + message):
        load(LEAST).get(key)


MOTOR = "[motor]\n"
EXCITATION = '[[motor.excitation]]\nname = "e"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TRAIN + PAIR, r"schema is missing, the file has to begin with schema = \"tdacoustic-fleet/1\""),
        ('schema = "tdacoustic-campaign/1"\n', r"schema must be 'tdacoustic-fleet/1', .*; this is a campaign file"),
        ('schema = "tdacoustic-fleet/2"\n', r"schema must be 'tdacoustic-fleet/1', got 'tdacoustic-fleet/2'$"),
        (HEAD + PAIR, "train is missing"),
        (HEAD + TRAIN, "gear_pair is missing"),
        (HEAD + "gear_pair = []\n" + TRAIN, "gear_pair must have at least 1 entry"),
        (HEAD + TRAIN + "[gear_pair]\nteeth = [31, 104]\n", r"gear_pair must be written as \[\[gear_pair\]\]"),
        (LEAST + "[[motor]]\npole_pairs = 2\n", r"motor must be written as \[motor\], with one bracket"),
        (
            LEAST + "face_width = 3\n",
            r"\[\[gear_pair\]\] 1: unknown key 'face_width' .* nearest known key is 'face_width_mm'",
        ),
        (
            LEAST + "pole_pairs = 3\n",
            r"\[\[gear_pair\]\] 1: unknown key 'pole_pairs' in \[\[gear_pair\]\]; it belongs in \[motor\]",
        ),
        (LEAST + "[mesuda]\n", r"unknown key 'mesuda' at the top level; the nearest known key is 'masuda'"),
        (LEAST + MOTOR + "[motor.excitations]\n", r"\[motor\]: unknown key 'excitations' .* 'excitation'"),
        (
            HEAD + PAIR + "[train]\nwheel_diameter_mm = 1.05\n",
            r"\[train\]: wheel_diameter_mm must be >= 100, got 1\.05",
        ),
        (
            HEAD + PAIR + '[train]\nwheel_diameter_mm = "1 m"\n',
            r"\[train\]: wheel_diameter_mm must be a number, got '1 m'",
        ),
        (
            HEAD + PAIR + "[train]\nwheel_diameter_mm = { value = true }\n",
            "wheel_diameter_mm must be a number, got true",
        ),
        (
            HEAD + PAIR + '[train]\nwheel_diameter_mm = { value = 1000, orign = "x" }\n',
            r"\[train\]: unknown key 'orign' in wheel_diameter_mm = \{ ... \}; the nearest known key is 'origin'",
        ),
        (HEAD + PAIR + '[train]\nwheel_diameter_mm = { origin = "x" }\n', "wheel_diameter_mm is a table without value"),
        (
            HEAD + PAIR + '[train]\nwheel_diameter_mm = { value = 1000, origin = "" }\n',
            "origin of wheel_diameter_mm must not be",
        ),
        (
            HEAD + PAIR + "[train]\nwheel_diameter_mm = { value = 1000, stderr = -1 }\n",
            "stderr of wheel_diameter_mm must be >= 0",
        ),
        (HEAD + TRAIN + "[[gear_pair]]\nteeth = [31]\n", r"\[\[gear_pair\]\] 1: teeth has too few entries, 1"),
        (HEAD + TRAIN + "[[gear_pair]]\nteeth = [31, 104, 3]\n", "teeth must have 2 entries"),
        (HEAD + TRAIN + "[[gear_pair]]\nteeth = [31, 10.5]\n", "teeth, entry 2, must be a whole number, got 10.5"),
        (HEAD + TRAIN + "[[gear_pair]]\nteeth = [31, 2]\n", "teeth, entry 2, must be >= 5, got 2"),
        (LEAST + "helix_angle_deg = -4\n", "helix_angle_deg must be >= 0, got -4"),
        (LEAST + "transmission_error_um = []\n", "transmission_error_um must have at least 1 entry"),
        (LEAST + "backlash_um = nan\n", "backlash_um must be a finite number, got nan"),
        (LEAST + 'name = "2"\n' + PAIR, r"\[\[gear_pair\]\] 2: the name '2' stands twice, also at 1"),
        (LEAST + '[model]\ngear_pair = "slow"\n', r"\[model\]: gear_pair must be one of 1, got 'slow'"),
        (LEAST + '[model]\ngear_path = "both"\n', "gear_path must be one of masuda, structure, sum, got 'both'"),
        (LEAST + '[model]\ncoupling = "both"\n', "coupling must be one of one_way, two_way, got 'both'"),
        (
            LEAST + '[model]\ncoupling = "two_way"\n',
            r'\[model\]: coupling = "two_way" needs \[radiation\] method = "boundary_elements", got "point_sources"',
        ),
        (LEAST + "[operation]\ntrain_speed_km_h = [20, -1]\n", "train_speed_km_h, entry 2, must be > 0, got -1"),
        (
            LEAST + '[operation]\ntrain_speed_km_h = [20]\ncondition_names = ["a", "b"]\n',
            "condition_names has 2 .* train_speed_km_h 1",
        ),
        (
            LEAST + '[operation]\ntrain_speed_km_h = [1, 2]\ncondition_names = ["a", "a"]\n',
            "condition_names names 'a' twice",
        ),
        (
            LEAST + '[operation]\ntorque = "constant_power"\n',
            r"\[operation\]: torque = 'constant_power' needs power_kw",
        ),
        (
            LEAST + "[operation]\ntorque_table = [[10, 1], [5, 2]]\n",
            "torque_table must ascend in km/h, got 10 and then 5",
        ),
        (LEAST + '[operation]\nmode = "push"\n', "mode must be one of traction, brake, coast, hauled, got 'push'"),
        (
            LEAST + MOTOR + 'carrier_hz = "463"\n',
            r"\[motor\]: carrier_hz must be a number in Hz or rows \[rpm, Hz\], got '463'",
        ),
        (LEAST + MOTOR + "carrier_hz = -1\n", "carrier_hz must be >= 0, got -1"),
        (LEAST + MOTOR + "carrier_hz = [[0, 400, 1]]\n", r"carrier_hz must be a number in Hz or rows \[rpm, Hz\]"),
        (LEAST + MOTOR + "carrier_hz = [[500, 1], [500, 2]]\n", "carrier_hz must ascend in rpm, got 500 and then 500"),
        (LEAST + MOTOR + "slip = 1\n", "slip must be < 1, got 1"),
        (LEAST + MOTOR + EXCITATION, r"\[\[motor.excitation\]\] 'e': has no frequency"),
        (
            LEAST + MOTOR + EXCITATION + "carrier = 2\n",
            r"\[motor\]: excitation 'e' follows the carrier, but carrier_hz is missing",
        ),
        (LEAST + MOTOR + EXCITATION + "supply = 2\n", "excitation 'e' follows the supply, but pole_pairs is missing"),
        (LEAST + MOTOR + (EXCITATION + "shaft = 2\n") * 2, r"two \[\[motor.excitation\]\] are called 'e'"),
        (
            LEAST + MOTOR + EXCITATION + "shaft = 2\nflux_density_t = [1, 2]\nsound_power_level_db = 3\n",
            "are both given",
        ),
        (
            LEAST + MOTOR + EXCITATION + "shaft = 2\nflux_density_t = 1\n",
            r"'e': flux_density_t must be \[B1, B2\] or rows",
        ),
        (LEAST + MOTOR + EXCITATION + "shaft = 2\nsize = 1\n", r"unknown key 'size' in \[\[motor.excitation\]\]"),
        (LEAST + "[housing]\nloss_factor = 0\n", r"\[housing\]: loss_factor must be > 0, got 0"),
        (LEAST + "[housing.material]\npoison = 0.3\n", r"\[housing.material\]: unknown key 'poison' .* 'poisson'"),
        (
            LEAST + '[[housing.seat]]\nshaft = "axle"\n',
            r"\[\[housing.seat\]\] 1: shaft must be one of pinion, wheel, got",
        ),
        (
            LEAST + "[housing]\nhanger_stiffness_n_per_m = [1, 2]\n",
            r"hanger_stiffness_n_per_m must be a number or \[x, y, z\]",
        ),
        (LEAST + '[radiation]\nspace = "open"\n', r"\[radiation\]: space must be one of free, half, got 'open'"),
        ("a = x", "line 1, column 5: no valid TOML"),
    ],
)
def test_an_error_names_file_table_and_key(load, text, message):
    with pytest.raises(FleetError, match=r"fleet\.toml: .*" + message) as caught:
        load(text)
    assert "\n" not in str(caught.value) or "more problem" in str(caught.value).splitlines()[0]


def test_all_problems_stand_in_one_message(load):
    with pytest.raises(FleetError, match=r"wheel_diameter_mm must be >= 100, got 1 \(and 2 more problems\)"):
        load(HEAD + "[train]\nwheel_diameter_mm = 1\n[[gear_pair]]\nteeth = [1, 104]\nhelix = 3\n")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(MissingFileError, match=r"the folder holds no fleet\.toml"):
        load_fleet(tmp_path)
    with pytest.raises(MissingFileError, match="no such file"):
        load_fleet(tmp_path / "x.toml")
    assert issubclass(FleetError, TdacousticError) and issubclass(FleetError, ValueError)


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(["value", "origin", "stderr", "x"]), inner),
    max_leaves=4,
)


@settings(max_examples=60, deadline=None)
@given(anything)
def test_any_value_of_any_key_gives_a_fleet_or_one_clear_error(value):
    from tdacoustic.toml_models import frozen

    for table, keys in (
        ("gear_pair", ("teeth", "name", "face_width_mm", "profile_shift")),
        ("operation", ("torque_table", "condition_names", "mode")),
        ("motor", ("carrier_hz", "pole_pairs", "excitation")),
        ("housing", ("material", "seat", "hanger_stiffness_n_per_m", "step_file")),
    ):
        for key in keys:
            raw = {"train": {"wheel_diameter_mm": 1000.0}, "gear_pair": [{"teeth": [31, 104]}]}
            raw |= {table: [{"teeth": [31, 104], key: value}] if table == "gear_pair" else {key: value}}
            try:
                fleet = Fleet.of_tables(Path("fleet.toml"), frozen(raw))
            except FleetError as error:
                assert re.match(rf"fleet\.toml: .*{table}", str(error))
            else:
                hash(fleet)


@pytest.mark.parametrize("name", ["reference-drive", "crrc-freight"])
def test_the_committed_fleets_have_the_papers_geometry_with_its_origin(name):
    fleet = load_fleet(ROOT / "calibration" / name)
    for key in ("normal_module_mm", "teeth", "pressure_angle_deg", "addendum_coefficient", "clearance_coefficient"):
        assert fleet.get(f"gear_pair.1.{key}").origin == "paper, Table 3"
    for key in ("profile_shift", "centre_distance_mm"):
        assert fleet.get(f"gear_pair.1.{key}").origin == "paper, Table 3"
    assert fleet.get("train.wheel_diameter_mm") == Parameter(
        1051.12, "paper, Table 1 (all five rows agree for it only)"
    )
    for key in ("gear_pair.1.face_width_mm", "gear_dynamics.mass_kg", "operation.torque_n_m", "housing.size_m"):
        assert fleet.get(key).is_assumed
    assert fleet.operation.names == ("1", "2", "3", "4", "5", "6")
    assert fleet.get("operation.mode").value == {"reference-drive": "traction", "crrc-freight": "traction"}[name]
    # 1.2 MW at 1938 rpm
    assert fleet.number("operation.torque_n_m") * 2 * math.pi * 1938 / 60 == pytest.approx(1.2e6, rel=1e-4)


def test_the_demonstration_differs_from_the_reference_drive_in_motor_places_range_and_gear_path_alone():
    reference, demonstration = (
        {stated.key: stated for stated in load_fleet(ROOT / "calibration" / name).parameters()}
        for name in ("reference-drive", "crrc-freight")
    )
    differing = {key for key in reference | demonstration if reference.get(key) != demonstration.get(key)}
    own = {"motor.carrier_hz", "motor.position_m", "housing.position_m", "radiation.max_frequency_hz"}
    own |= {"model.gear_path", "model.structure_gain_db", "masuda.displacement"}
    assert {key for key in differing if not key.startswith("motor.excitation.")} == own
    assert all(demonstration[key].origin == "assumed" for key in own)


def test_loading_needs_no_heavy_library():
    code = (
        "import sys, tdacoustic.fleet;"
        "print([m for m in ('numpy', 'scipy', 'pandas', 'matplotlib') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert run.stdout.strip() == "[]"
