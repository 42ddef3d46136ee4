import pickle
import re
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tdacoustic.campaign import SCHEMA, AnalysisSettings, load_campaign
from tdacoustic.errors import CampaignError, MissingFileError

HEAD = f'schema = "{SCHEMA}"\norigin = "measured"\n'
CHANNEL = '[[channel]]\nname = "mic_1"\nunit = "Pa"\n'
RUN = '[[run]]\ncondition = "1"\nlogs = ["a.h5"]\n'

FULL = f'''
schema = "{SCHEMA}"
name   = "Freight locomotive, laboratory track"
origin = "synthetic"
fleet  = "../fleet.toml"

[meta]
weather = "dry"
wind = {{ speed_m_s = 3, from = ["N", "W"] }}

[[channel]]
name = "motor_z"
source = "Motor Z"
log = 1
component = "motor"
drive = "1"
quantity = "acceleration"
unit = "V"
sensitivity = "10.2 mV/(m/s^2)"
direction = "z"
position_m = [0.0, 0.1, 0.4]

[[channel]]
name = "mic_1"
source = 3
role = "receiver"
full_scale = "20 Pa"
distance_m = 4.0
height_above_rail_m = 1.2
side = "left"

[[channel]]
name = "tacho"
quantity = "tacho"
shaft = "motor"
pulses_per_rev = 60

[[run]]
name = "1a"
condition = "1"
kind = "test"
mode = "traction"
torque_n_m = -1500
direction = "forward"
wheel_diameter_mm = 1210
oil_temperature_degc = -5.5
train_speed_km_h = 20
logs = ["condition-1.h5"]
sample_rate_hz = 8192
start_s = 0.0
end_s = 10.0

[[run]]
condition = "1"
train_speed_km_h = 20.9
logs = ['sub\\b.h5', "c.h5"]
valid = false
reject_reason = "rain"

[[run]]
kind = "background"
logs = ["quiet.h5"]

[[level]]
condition = "3"
distance_m = 4.0
level_db = 88.3
sigma_db = 1.0
weighting = "Z"
origin = "paper, section 5.1"

[[exclude]]
condition = "1"
channel = "mic_1"
frequency_hz = [49, 51]
reason = "hum"

[[override]]
condition = "3"
frequency_hz = 462
source = "gearbox"
reason = "seen on the bench"

[analysis]
orders = [2, 4, 31]
level_band_hz = [20, 5000]

[calibration]
free = ["masuda.constant_db"]
'''


@pytest.fixture
def load(tmp_path):
    def loaded(text, head=HEAD):
        (tmp_path / "campaign.toml").write_text(head + text, encoding="utf-8")
        return load_campaign(tmp_path / "campaign.toml")

    return loaded


def fails(load, text, match, **more):
    with pytest.raises(CampaignError, match=match) as caught:
        load(text, **more)
    assert str(caught.value).splitlines()[0].count("campaign.toml: ") == 1
    return str(caught.value)


def test_the_whole_contract_is_read(load, tmp_path):
    campaign = load(FULL, head="")
    motor, mic, tacho = campaign.channels
    assert (motor.source, mic.source, tacho.source) == ("Motor Z", 3, "tacho")
    assert (motor.component, mic.component, tacho.component) == ("motor", "air", None)
    assert motor.position_m == (0.0, 0.1, 0.4)
    assert campaign.channel("motor_z") is motor
    assert campaign.run("background").kind == "background"
    assert [run.name for run in campaign.runs] == ["1a", "1#2", "background"]
    assert campaign.conditions() == ("1", "3")
    assert [run.name for run in campaign.test_runs()] == ["1a", "1#2"]
    assert [run.name for run in campaign.background_runs()] == ["background"]
    second = campaign.runs[1]
    assert [log.text for log in second.logs] == ["sub\\b.h5", "c.h5"]
    assert second.logs[0].path == tmp_path / "sub" / "b.h5"
    assert campaign.folder == tmp_path
    assert campaign.fleet.path == tmp_path / ".." / "fleet.toml"
    assert campaign.meta == (("weather", "dry"), ("wind.speed_m_s", "3"), ("wind.from", "N, W"))
    assert campaign.overrides[0].frequency_hz == 462.0
    assert {key: value for key, value in campaign.settings.items() if not key.startswith("calibration.")} == {
        "analysis.orders": (2.0, 4.0, 31.0),
        "analysis.level_band_hz": (20.0, 5000.0),
        "analysis.frequency_resolution_hz": 1.0,
        "analysis.overlap": 0.5,
        "analysis.run_up_resolution_hz": 8.0,
        "analysis.line_prominence_db": AnalysisSettings().line_prominence_db,
        "analysis.speed_tolerance": 0.03,
        "analysis.mains_hz": 50.0,
        "analysis.order_bandwidth": 0.5,
        "analysis.highest_order": None,
        "analysis.vold_kalman": True,
        "analysis.speed_from": "auto",
        "analysis.motor_speed_range_rpm": None,
        "analysis.motor_speed_change_rpm_s": None,
        "analysis.calibrators": "check",
        "analysis.sound_excerpts": True,
    }
    assert campaign.settings["calibration.free"] == ("masuda.constant_db",)
    assert campaign.settings["calibration.model_sigma_db"] == 4.0


CALIBRATION = """
[calibration]
free = ["masuda.constant_db"]
data = ["receivers", "bands"]
model_sigma_db = 2
fit_model_sigma = true
level_sigma_db = 0.5
loss = "huber"
starts = 5
posterior = true
posterior_walkers = 40
posterior_steps = 500
prior_fleet = "../first/fleet.calibrated.toml"
prior_discount = 3
with_campaigns = ["../second"]
offset_sigma_db = 0.7
[[calibration.parameter]]
name = "gear_dynamics.mesh_damping_ratio"
value = 0.04
min = 0.01
max = 0.2
prior_mean = 0.05
prior_sigma = 0.02
scale = "log"
[[calibration.parameter]]
name = "twice"
expression = "2 * gear_dynamics.mesh_damping_ratio"
[[level]]
condition = "1"
distance_m = 4
level_db = 80
"""


def test_the_whole_of_calibration_is_read(load, tmp_path):
    calibration = load(CALIBRATION).calibration
    assert calibration.names == ("masuda.constant_db", "gear_dynamics.mesh_damping_ratio", "twice")
    damping = calibration.stated("gear_dynamics.mesh_damping_ratio")
    assert (damping.min, damping.max, damping.prior_mean, damping.prior_sigma) == (0.01, 0.2, 0.05, 0.02)
    assert calibration.stated("masuda.constant_db").min is None
    assert calibration.data == ("receivers", "bands")
    assert calibration.prior_fleet.path == tmp_path / ".." / "first" / "fleet.calibrated.toml"
    assert [campaign.text for campaign in calibration.with_campaigns] == ["../second"]
    shown = load(CALIBRATION).settings
    assert shown["calibration.parameter"][1] == "name = twice, expression = 2 * gear_dynamics.mesh_damping_ratio"
    assert shown["calibration.with_campaigns"] == ("../second",)
    assert shown["calibration.prior_fleet"] == "../first/fleet.calibrated.toml"


def test_a_campaign_is_frozen_hashable_and_picklable(load):
    campaign = load(FULL, head="")
    assert pickle.loads(pickle.dumps(campaign)) == campaign
    assert hash(campaign) == hash(load(FULL, head=""))
    for thing, key in ((campaign, "name"), (campaign.channels[0], "name"), (campaign.analysis, "overlap")):
        with pytest.raises((AttributeError, ValueError)):
            setattr(thing, key, "x")


def test_levels_alone_are_a_campaign_and_the_folder_names_it(load, tmp_path):
    campaign = load("[[level]]\ncondition = 3\ndistance_m = 4\nlevel_db = 88.3\n")
    assert (campaign.name, campaign.runs, campaign.conditions()) == (tmp_path.name, (), ("3",))
    assert (campaign.levels[0].sigma_db, campaign.levels[0].weighting) == (None, "Z")


def test_a_folder_stands_for_its_campaign(load, tmp_path):
    campaign = load(CHANNEL + RUN)
    assert load_campaign(tmp_path) == campaign
    with pytest.raises(MissingFileError, match=r"the folder holds no campaign\.toml"):
        (tmp_path / "empty").mkdir()
        load_campaign(tmp_path / "empty")
    with pytest.raises(MissingFileError, match=r"nowhere\.toml: no such file"):
        load_campaign(tmp_path / "nowhere.toml")


def test_a_byte_order_mark_is_taken(tmp_path):
    (tmp_path / "campaign.toml").write_bytes(b"\xef\xbb\xbf" + (HEAD + CHANNEL + RUN).replace("\n", "\r\n").encode())
    assert load_campaign(tmp_path).conditions() == ("1",)


@pytest.mark.parametrize(
    ("head", "match"),
    [
        ('origin = "measured"\n', r'schema is missing, the file has to begin with schema = "tdacoustic-campaign/1"'),
        ('Schema = "x"\n', r"schema is missing.*unknown key 'Schema' at the top level; .*'schema'"),
        ('schema = "tdacoustic-fleet/1"\n', r"schema must be .*, got 'tdacoustic-fleet/1'; this is a fleet file"),
        ("schema = 1\n", r"schema must be 'tdacoustic-campaign/1', got 1"),
        (f'schema = "{SCHEMA}"\n', r"origin is missing"),
        (
            f'schema = "{SCHEMA}"\norigin = "guessed"\n',
            r"origin must be one of measured, synthetic, printed, got 'guessed'",
        ),
    ],
)
def test_the_head_of_the_file(load, head, match):
    fails(load, CHANNEL + RUN, match, head=head)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("a = = 1", r"line 3, column 5: no valid TOML: Invalid value: 'a = = 1'"),
        ("x = " + "[" * 5000, r"no valid TOML"),
        ("x = 1" + "0" * 5000, r"no valid TOML"),
    ],
)
def test_toml_that_is_none(load, text, match):
    fails(load, text, match)


def test_a_file_that_is_not_utf8(tmp_path):
    (tmp_path / "campaign.toml").write_bytes(HEAD.encode() + b'name = "\xe4"\n')
    with pytest.raises(CampaignError, match=r"is not UTF-8 \(byte \d+"):
        load_campaign(tmp_path)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("chanel = 1", r"unknown key 'chanel' at the top level; the nearest known key is 'channel'"),
        (CHANNEL + "sensitivty = 1", r"channel 'mic_1': unknown key 'sensitivty' in \[\[channel\]\]; .*'sensitivity'"),
        (CHANNEL + "Unit = 1", r"the nearest known key is 'unit'"),
        (RUN + "pulses_per_rev = 1", r"unknown key 'pulses_per_rev' in \[\[run\]\]; it belongs in \[\[channel\]\]"),
        (RUN + "model_sigma = 1", r"the nearest known key is 'model_sigma_db' in \[calibration\]"),
        (
            RUN + "zzz = 1",
            r"unknown key 'zzz' in \[\[run\]\]; the nearest known key is '\w+'; known are name, condition",
        ),
        ("[analysis]\noverlapp = 1", r"\[analysis\]: unknown key 'overlapp' in \[analysis\]; .* 'overlap'"),
        ('[channel]\nname = "a"', r"channel must be written as \[\[channel\]\], with two brackets"),
        ("[[analysis]]\noverlap = 0.5", r"analysis must be written as \[analysis\], with one bracket"),
        ("meta = 3", r"meta must be a table, got 3"),
        ("fleet = 3", r"fleet must be a path relative to the campaign file, got 3"),
        ("runs = 3", r"runs must be a path relative to the campaign file, got 3"),
        ("channel = [3]", r"channel 1: must be a table, got 3"),
    ],
)
def test_keys_and_tables(load, text, match):
    fails(load, text, match)


@pytest.mark.parametrize(
    ("key", "match"),
    [
        ('name = "a:b"', r"channel 'a:b': name 'a:b' has ':'; allowed are letters, digits, space and _\.#/\(\)-"),
        ('name = "_a"', r"begins with '_', allowed is a letter or digit"),
        ('name = ""', r"name '' is empty"),
        (f'name = "{"a" * 65}"', r"has 65 characters, allowed are 64"),
        ("name = 1.5", r"name must be text in quotes \(a whole number also counts\), got 1.5"),
        ('name = "a"\nsource = 0', r"channel 'a': source must be the name in the log or its index from 1, got 0"),
        ('name = "a"\nsource = true', r"source must be"),
        ('name = "a"\nlog = 0', r"log must be >= 1, got 0"),
        ('name = "a"\ncomponent = "moter"', r"component must be one of motor, gearbox, .*, got 'moter'"),
        ('name = "a"\nrole = "x"', r"role must be one of receiver, near_field, reference, got 'x'"),
        ('name = "a"\nquantity = "velocity"', r"quantity must be one of acceleration, .*, got 'velocity'"),
        ('name = "a"\nunit = "furlong"', r"channel 'a': unit 'furlong' is not known"),
        ('name = "a"\nsensitivity = "50"', r"channel 'a': sensitivity '50' is not of the form"),
        ('name = "a"\nsensitivity = "5 Pa/mV"', r"'Pa' is no electrical unit"),
        ('name = "a"\nsensitivity = 50', r"sensitivity must be text in quotes, got 50"),
        ('name = "a"\nfull_scale = "20"', r"full_scale '20' is not of the form"),
        ('name = "a"\nfull_scale = "20 xx"', r"full_scale: unit 'xx' is not known"),
        ('name = "a"\nposition_m = [0, 1]', r"position_m has too few entries, 2"),
        ('name = "a"\nposition_m = [0, 1, 2, 3]', r"position_m must have 3 entries, got \[0, 1, 2, 3\]"),
        ('name = "a"\nposition_m = [0, "b", 2]', r"position_m, entry 2, must be a number, got 'b'"),
        ('name = "a"\nposition_m = 3', r"position_m must be a list in \[ \], got 3"),
        ('name = "a"\ndistance_m = -4', r"distance_m must be >= 0, got -4"),
        ('name = "a"\ndistance_m = nan', r"distance_m must be a finite number, got nan"),
        ('name = "a"\ndistance_m = true', r"distance_m must be a number, got true"),
        ('name = "a"\nshaft = "cardan"', r"shaft must be one of motor, wheelset, got 'cardan'"),
        ('name = "a"\nquantity = "tacho"', r"channel 'a': a tacho needs pulses_per_rev, which is missing"),
        (
            'name = "a"\nquantity = "force"\npulses_per_rev = 2',
            r"pulses_per_rev = 2 is of a tacho, but quantity is 'force'",
        ),
        ('name = "a"\nquantity = "force"\nshaft = "motor"', r"shaft = 'motor' is of a speed or tacho"),
        ('name = "a"\nquantity = "force"\nrole = "receiver"', r"role 'receiver' is of a microphone"),
        (
            'name = "a"\nquantity = "acceleration"\nunit = "Pa"',
            r"unit 'Pa' does not fit quantity 'acceleration', which is in m",
        ),
        ('name = "a"\nquantity = "speed"\nunit = "Pa"', r"which is in 1/s or m/s"),
        ('name = "a"\nrole = "receiver"\nunit = "g"', r"unit 'g' does not fit quantity 'sound_pressure'"),
        ('name = "a"\nquantity = "force"\nfull_scale = "1 Pa"', r"full_scale '1 Pa' does not fit quantity 'force'"),
        (
            'name = "a"\nquantity = "force"\nsensitivity = "5 mV/Pa"',
            r"sensitivity '5 mV/Pa' does not fit quantity 'force'",
        ),
        (
            'name = "a"\nunit = "Pa"\nsensitivity = "5 mV/Pa"',
            r"unit 'Pa' does not fit sensitivity '5 mV/Pa', which is for V",
        ),
        ('name = "a"\nunit = "V"\nfull_scale = "1 Pa"', r"full_scale '1 Pa' does not fit unit 'V'"),
        (
            'name = "a"\nquantity = "tacho"\npulses_per_rev = 1\nsensitivity = "5 mV/Pa"',
            r"sensitivity has no meaning for a tacho",
        ),
    ],
)
def test_channels(load, key, match):
    fails(load, f"[[channel]]\n{key}\n" + RUN, match)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ('[[run]]\nlogs = ["a"]', r"run 1: condition is missing; a run of kind 'test' needs one"),
        ('[[run]]\ncondition = "1"', r"run 1 \(condition '1'\): logs is missing"),
        ('[[run]]\nname = "x"\ncondition = "1"\nlogs = []', r"run 'x': logs must have at least 1 entry, got \[\]"),
        ('[[run]]\nname = "x"\ncondition = "1"\nlogs = "a"', r"run 'x': logs must be a list in \[ \], got 'a'"),
        ('[[run]]\ncondition = "1"\nlogs = [""]', r"logs, entry 1, must be a path relative to the campaign file"),
        ('[[run]]\ncondition = "1"\nlogs = ["a", "a"]', r"logs names 'a' 2 times|logs names '.*a' 2 times"),
        (RUN + 'kind = "x"', r"kind must be one of test, background, calibration_before, calibration_after, got 'x'"),
        (RUN + 'mode = "x"', r"mode must be one of traction, brake, coast, hauled, got 'x'"),
        (RUN + "train_speed_km_h = -1", r"train_speed_km_h must be >= 0, got -1"),
        (RUN + 'train_speed_km_h = "20"', r"train_speed_km_h must be a number, got '20'"),
        (RUN + "sample_rate_hz = 0", r"sample_rate_hz must be > 0, got 0"),
        (RUN + "start_s = 5\nend_s = 5", r"end_s must be > start_s = 5, got 5"),
        (RUN + "valid = false", r"valid = false needs a reject_reason"),
        (RUN + 'valid = "no"', r"valid must be true or false, got 'no'"),
        (RUN + 'reject_reason = "x"', r"reject_reason 'x' stands beside valid = true"),
        (RUN + "oil_temperature_degc = -300", r"oil_temperature_degc must be >= -273.15, got -300"),
        (RUN + RUN, r"runs '1#1' and '1#2' have the same data: a\.h5, 0 s to the end"),
        (
            RUN + 'name = "x"\n[[run]]\nname = "x"\ncondition = "2"\nlogs = ["b"]',
            r"run 'x': the name stands twice, in run 1 and 2",
        ),
        (
            RUN + 'train_speed_km_h = 20\n[[run]]\ncondition = 1\nlogs = ["b"]\ntrain_speed_km_h = 21.1',
            r"condition '1': runs '1#1' and '1#2' differ in train_speed_km_h by more than 5 %: 20 and 21\.1",
        ),
        (
            RUN + 'motor_speed_rpm = 0\n[[run]]\ncondition = 1\nlogs = ["b"]\nmotor_speed_rpm = 1',
            r"differ in motor_speed_rpm by more than 5 %",
        ),
    ],
)
def test_runs(load, text, match):
    fails(load, CHANNEL + text, match)


def test_speeds_five_per_cent_apart_and_rejected_runs_pass(load):
    campaign = load(
        CHANNEL
        + RUN
        + 'train_speed_km_h = 20\n[[run]]\ncondition = "1"\nlogs = ["b"]\ntrain_speed_km_h = 21\n'
        + '[[run]]\ncondition = "1"\nlogs = ["c"]\ntrain_speed_km_h = 90\nvalid = false\nreject_reason = "wrong gear"\n'
    )
    assert [run.name for run in campaign.runs] == ["1#1", "1#2", "1#3"]


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", r"nothing was measured: there is no \[\[run\]\]"),
        (
            CHANNEL + '[[run]]\nkind = "background"\nlogs = ["a"]',
            r"nothing was measured: all runs are of kind background",
        ),
        (RUN, r"there are runs but no \[\[channel\]\]"),
        (CHANNEL + CHANNEL + RUN, r"channel 'mic_1': the name stands twice, \[\[channel\]\] 1 and 2"),
        (
            CHANNEL + '[[channel]]\nname = "b"\nsource = "mic_1"\n' + RUN,
            r"channels 'mic_1' and 'b' have the same source 'mic_1'",
        ),
        (
            CHANNEL + RUN + '[[exclude]]\ncondition = "2"\nfrequency_hz = [1, 2]\nreason = "x"',
            r"exclude 1: no condition '2'; there are 1",
        ),
        (
            CHANNEL + RUN + '[[exclude]]\ncondition = 1\nchannel = "x"\nfrequency_hz = [1, 2]\nreason = "x"',
            r"exclude 1: no channel 'x'; there are mic_1",
        ),
        (
            CHANNEL + RUN + '[[exclude]]\ncondition = 1\nfrequency_hz = [2, 2]\nreason = "x"',
            r"exclude 1 \(condition 1\): frequency_hz must be \[from, to\] with from < to, got \[2, 2\]",
        ),
        (
            CHANNEL + RUN + '[[exclude]]\ncondition = 1\nfrequency_hz = [1, 2]\nreason = " "',
            r"reason must not be empty",
        ),
        (
            CHANNEL + RUN + '[[override]]\ncondition = "2"\nfrequency_hz = 1\nsource = "motor"\nreason = "x"',
            r"override 1: no condition '2'; there are 1",
        ),
        (
            CHANNEL + RUN + '[[override]]\ncondition = "1"\nfrequency_hz = 1\nsource = "me"\nreason = "x"',
            r"source must be one of motor, gearbox, .*, ambiguous, unassigned, got 'me'",
        ),
        (
            CHANNEL
            + RUN
            + '[[override]]\ncondition = "1"\nfrequency_hz = 1\nsource = "motor"\nreason = "x"\n'
            + '[[override]]\ncondition = "1"\nfrequency_hz = 1\nsource = "gearbox"\nreason = "x"',
            r"override 2: 1 Hz of condition '1' is given to 'motor' and to 'gearbox'",
        ),
        ("[[level]]\ncondition = 1\nlevel_db = 3", r"level 1 \(condition 1\): distance_m is missing"),
        (
            "[[level]]\ncondition = 1\ndistance_m = 4\nlevel_db = 3\n" * 2,
            r"level 2 \(condition '1'\): the same as level 1",
        ),
        ("[analysis]\norders = [2, 2]", r"\[analysis\]: orders names 2.0 twice"),
        ('[analysis]\norders = [2, "x"]', r"\[analysis\]: orders, entry 2, must be a number, got 'x'"),
        ("[analysis]\noverlap = 1", r"overlap must be <= 0.95, got 1"),
        ("[analysis]\nspeed_tolerance = 1", r"speed_tolerance must be < 1, got 1"),
        ("[analysis]\nfrequency_resolution_hz = 0", r"frequency_resolution_hz must be > 0, got 0"),
        ("[calibration]\nmodel_sigma_db = -1", r"model_sigma_db must be >= 0, got -1"),
    ],
)
def test_contradictions_and_settings(load, text, match):
    fails(load, text, match)


def test_several_problems_come_in_one_message_one_a_line(load):
    keys = "\n".join(f"zz{k} = 1" for k in range(14))
    lines = fails(load, CHANNEL + keys, r"'zz0' .*\(and 13 more problems\)").splitlines()
    assert len(lines) == 11
    assert lines[1].startswith("  channel 'mic_1': unknown key 'zz1'")
    assert lines[-1] == "  ... and 4 not shown"


@pytest.mark.parametrize(
    ("kinds", "names"),
    [
        (["condition = 1", "condition = 1"], ["1#1", "1#2"]),
        (["condition = 1", 'condition = 1\nname = "x"', "condition = 2"], ["1#1", "x", "2"]),
        (["condition = 1", 'kind = "background"', 'kind = "background"'], ["1", "background#1", "background#2"]),
        (["condition = 1", 'kind = "background"\ncondition = 1'], ["1", "1 background"]),
    ],
)
def test_default_names(load, kinds, names):
    text = "".join(f'[[run]]\n{kind}\nlogs = ["{k}"]\n' for k, kind in enumerate(kinds))
    assert [run.name for run in load(CHANNEL + text).runs] == names


@settings(max_examples=60)
@given(st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(), st.lists, max_leaves=4))
def test_any_value_of_any_key_gives_a_campaign_or_one_clear_error(tmp_path_factory, value):
    from tdacoustic.campaign.load import _check_schema, _frozen, _validated

    path = tmp_path_factory.getbasetemp() / "c.toml"
    for table, keys in (
        ("channel", ("source", "unit", "position_m", "drive")),
        ("run", ("logs", "name", "valid", "end_s")),
    ):
        for key in keys:
            raw = _frozen({"schema": SCHEMA, "origin": "measured", table: [{"name": "a", key: value}]})
            _check_schema(path, raw)
            try:
                _validated(path, raw, {})
            except CampaignError as error:
                assert re.match(rf".*c\.toml: {table} ", str(error))


def test_loading_needs_no_heavy_library():
    code = (
        "import sys, tdacoustic.campaign;"
        "print([m for m in ('numpy', 'scipy', 'pandas', 'matplotlib') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
