"""Speed without a tacho through the whole analysis: what is asked, what is found, what the tables say."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from small_campaigns import HEAD, RATE_HZ, run_table, table, write_log

from tdacoustic import analyze
from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError
from tdacoustic.fleet import load_fleet
from tdacoustic.recording import Channel, Recording
from tdacoustic.workflows.line_speed import line_speed_settings

FIRST_RUN = Path(__file__).resolve().parents[2] / "recordings" / "first-run"
CAR = Path(__file__).resolve().parents[3] / "shared" / "recordings" / "ansys_accel_with_rpm" / "accel_with_rpm.wav"
FLEET = """schema = "tdacoustic-fleet/1"
name = "Small"
[train]
wheel_diameter_mm = 1051.12
[[gear_pair]]
teeth = [31, 104]
normal_module_mm = 7.35
pressure_angle_deg = 20
centre_distance_mm = 495
face_width_mm = 120
"""
PER_METRE = 104 / 31 / (np.pi * 1.05112)
GEARBOX = table("channel", name="gearbox", component="gearbox", quantity="acceleration")
TACHO = table("channel", name="tacho", quantity="tacho", shaft="motor", pulses_per_rev=20)
GPS = table("channel", name="gps", quantity="speed", unit="m/s")
SECONDS = 12.0
T = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
SPEED = 8.0 + 0.8 * T
TURNS = 8.0 * T + 0.4 * T**2


def shaken(seed=0, turns=TURNS):
    rng = np.random.default_rng(seed)
    lines = sum(0.4 * np.cos(2.0 * np.pi * order * turns + rng.uniform(0.0, 6.3)) for order in (31, 62, 93, 1, 2))
    return lines + rng.standard_normal(turns.size)


def pulses(turns=TURNS, per_rev=20):
    phase = np.mod(turns * per_rev, 1.0)
    return 5.0 * np.clip(np.minimum(phase / 0.06, (0.56 - phase) / 0.06), 0.0, 1.0)


def campaign(folder, channels=GEARBOX, text="", fleet=FLEET, run=None, **logged):
    """One run-up "up"; `logged` are channels {name: (values, unit)} beside the gearbox's."""
    folder.mkdir(parents=True, exist_ok=True)
    write_log(folder / "up.h5", {"gearbox": (shaken(), "m/s^2"), **logged})
    head = HEAD if fleet is None else HEAD + 'fleet = "fleet.toml"\n\n'
    (folder / "fleet.toml").write_text(fleet or "", encoding="utf-8")
    run = run or table("run", condition="up", logs=["up.h5"])
    path = folder / "campaign.toml"
    path.write_text(head + channels + run + text, encoding="utf-8")
    return path


def analysed(path, **options):
    return analyze(path, path.parent / "store", jobs=1, deeper=False, **options)


def speeds(analysis):
    return analysis.tables["speeds"].to_dict("records")


def said(analysis, check):
    table = analysis.tables["quality"]
    return table[table["check"].str.startswith(check)]


def bound(*channels):
    made = tuple(
        Channel(name, quantity, "x", 0, 0, 8192.0, 0, 80000, component=component, drive=drive)
        for name, quantity, component, drive in channels
    )
    return Recording("up", (), made)


SENSORS = bound(
    ("mic", "sound_pressure", "air", "1"),
    ("bogie", "acceleration", "bogie", "1"),
    ("motor", "acceleration", "motor", "1"),
    ("gearbox", "acceleration", "gearbox", "1"),
    ("other", "acceleration", "gearbox", "2"),
)


# ---------------------------------------------------------------- what is asked


def settings(folder, text="", run=None, recording=SENSORS, fleet=FLEET):
    loaded = load_campaign(campaign(folder, text=text, run=run, fleet=fleet))
    known = None if fleet is None else load_fleet(folder / "fleet.toml")
    return line_speed_settings(loaded, loaded.runs[0], recording, known)


def test_orders_range_and_channels_come_from_the_fleet(tmp_path):
    """Sensors of one drive, the gearbox's first; 2 m/s up to 40 m/s where nobody names a speed."""
    found = settings(tmp_path)
    assert [channel.name for channel in found.channels] == ["gearbox", "motor", "bogie"]
    orders = {item.name: (item.order, item.presence) for item in found.orders}
    assert (
        orders["mesh x1"] == (31.0, 0.7)
        and orders["mesh x6"] == (186.0, 0.2)
        and orders["motor shaft x4"] == (4.0, 0.3)
    )
    assert not any("wheelset" in name or "carrier" in name for name in orders)
    assert (found.lowest_hz, found.highest_hz) == pytest.approx((2.0 * PER_METRE, 1.25 * 40.0 * PER_METRE), rel=0.26)
    assert found.acceleration_hz_s == pytest.approx(2.5 * PER_METRE)
    assert found.turns_per_metre == pytest.approx(PER_METRE) and not found.always and found.start_hz is None


def test_motor_excitations_and_the_supply_are_orders_too(tmp_path):
    motor = "[motor]\npole_pairs = 2\nslip = 0.01\ncarrier_hz = 500\n"
    motor += '[[motor.excitation]]\nname = "slots"\norder = 0\nshaft = 36\n'
    carrier = '[[motor.excitation]]\nname = "pwm"\norder = 0\ncarrier = 2\n'
    found = settings(tmp_path, fleet=FLEET + motor + carrier)
    orders = {item.name: (item.order, item.reach) for item in found.orders}
    assert orders["slots"] == (36.0, 0.0) and "pwm" not in orders
    assert orders["supply x2"] == pytest.approx((4.0 / 0.99, 0.015))


@pytest.mark.parametrize(
    ("run", "expected_hz"),
    [
        ({"start_motor_speed_rpm": 480.0}, 8.0),
        ({"start_train_speed_km_h": 18.0}, 5.0 * PER_METRE),
        ({"start_train_speed_km_h": 0.0}, None),
    ],
)
def test_a_start_is_what_the_run_states(tmp_path, run, expected_hz):
    found = settings(tmp_path, run=table("run", condition="up", logs=["up.h5"], **run))
    assert found.start_hz == (None if expected_hz is None else pytest.approx(expected_hz))


@pytest.mark.parametrize(
    ("text", "run", "read"),
    [
        ("", {}, True),
        ("", {"train_speed_km_h": 30.0}, False),
        ("", {"motor_speed_rpm": 500.0}, False),
        ('[analysis]\nspeed_from = "channels"\n', {}, False),
        ('[analysis]\nspeed_from = "lines"\n', {"train_speed_km_h": 30.0}, True),
        ("", {"kind": "background"}, False),
    ],
)
def test_lines_are_asked_for_by_key_and_need(tmp_path, text, run, read):
    text = text + table("level", condition="x", distance_m=4.0, level_db=80.0) if "kind" in run else text
    found = settings(tmp_path, text, table("run", condition="up", logs=["up.h5"], **run))
    assert (found is not None) == read
    assert not read or (found.always, found.start_hz is not None) == ("lines" in text, bool(run))


def test_the_campaign_sets_the_range_and_without_a_fleet_the_orders(tmp_path):
    text = "[analysis]\norders = [2, 4]\nmotor_speed_range_rpm = [600, 6000]\nmotor_speed_change_rpm_s = 300\n"
    found = settings(tmp_path, text, fleet=None)
    assert [(item.name, item.order) for item in found.orders] == [("order 2", 2.0), ("order 4", 4.0)]
    assert (found.lowest_hz, found.highest_hz, found.acceleration_hz_s) == (10.0, 100.0, 5.0)


def test_microphones_are_listened_to_where_there_is_no_accelerometer(tmp_path):
    found = settings(tmp_path, recording=bound(("mic", "sound_pressure", "air", "1")))
    assert [channel.name for channel in found.channels] == ["mic"]


@pytest.mark.parametrize(
    ("recording", "fleet", "words"),
    [
        (SENSORS, None, "no order of the drive is known: name a fleet, or [analysis] orders"),
        (bound(("f", "force", None, "1")), FLEET, "there is no accelerometer and no microphone to look in"),
    ],
)
def test_what_is_missing_is_said(tmp_path, recording, fleet, words):
    assert settings(tmp_path, recording=recording, fleet=fleet) == words


@pytest.mark.parametrize(
    ("text", "run", "match"),
    [
        ('[analysis]\nspeed_from = "mesh"\n', {}, "speed_from must be one of auto, channels, lines, got 'mesh'"),
        ("[analysis]\nmotor_speed_range_rpm = [600, 60]\n", {}, r"from < to, got \[600, 60\]"),
        ("[analysis]\nmotor_speed_range_rpm = [0, 60]\n", {}, "must be > 0"),
        ("", {"start_train_speed_km_h": 5.0, "start_motor_speed_rpm": 5.0}, "are both given; leave one out"),
        ("", {"start_train_speed_km_h": 5.0, "motor_speed_rpm": 5.0}, "states one for all of it; leave one out"),
        ("", {"start_motor_speed_rpm": -5.0}, "must be >= 0"),
    ],
)
def test_keys_that_are_wrong_are_refused(tmp_path, text, run, match):
    with pytest.raises(CampaignError, match=match):
        load_campaign(campaign(tmp_path, text=text, run=table("run", condition="up", logs=["up.h5"], **run)))


# ---------------------------------------------------------------- what is found


def test_a_run_up_without_a_tacho_is_read_as_the_tacho_would_say(tmp_path):
    """The synthetic first run of recordings/, its tacho left out; its own synthesis made the lines."""
    shutil.copytree(FIRST_RUN, tmp_path / "first")
    path = tmp_path / "first" / "campaign.toml"
    (tmp_path / "first" / "fleet.toml").write_text(FLEET, encoding="utf-8")
    text = path.read_text(encoding="utf-8").replace(
        'origin = "synthetic"', 'origin = "synthetic"\nfleet = "fleet.toml"', 1
    )
    with_tacho = text + '\n[analysis]\nspeed_from = "lines"\n'
    path.write_text(with_tacho, encoding="utf-8")
    rows = {(row["run"], row["source"]): row for row in speeds(analysed(path))}
    for run in ("30", "50", "run-up"):
        assert abs(rows[run, "lines"]["beside_leading"]) <= 1e-3
    cut = text.index('[[channel]]\nname = "tacho"')
    path.write_text(text[:cut] + text[text.index("[[run]]") :], encoding="utf-8")
    analysis = analysed(path)
    alone = {(row["run"], row["source"]): row for row in speeds(analysis)}
    assert set(alone) == {("30", "stated"), ("50", "stated"), ("run-up", "lines")}
    assert alone["run-up", "lines"]["mean"] == pytest.approx(rows["run-up", "lines"]["mean"])
    assert not analysis.runs[2].measurement.steady and analysis.problems == ()


def test_lines_stand_in_for_a_tacho_that_is_dead(tmp_path):
    path = campaign(tmp_path, GEARBOX + TACHO, tacho=(np.full(T.size, 2.5), "V"))
    analysis = analysed(path)
    rows = {row["source"]: row for row in speeds(analysis)}
    assert rows["lines"]["mean"] == pytest.approx(60.0 * SPEED.mean(), rel=5e-3) and rows["lines"]["confidence"] > 0.8
    assert "has no pulses" in rows["tacho"]["reason"] and rows["tacho"]["known_share"] == 0.0
    assert any("has no pulses" in detail for detail in said(analysis, "speed")["detail"])


def test_a_speed_that_is_not_found_is_said_in_every_place(tmp_path):
    path = campaign(tmp_path)
    write_log(tmp_path / "up.h5", {"gearbox": (np.random.default_rng(0).standard_normal(T.size), "m/s^2")})
    analysis = analysed(path)
    (row,) = speeds(analysis)
    assert row["reason"].startswith("no speed in the lines") and np.isnan(row["mean"]) and row["source"] == "lines"
    (verdict,) = said(analysis, "speed").to_dict("records")
    assert verdict["verdict"] == "warning" and verdict["detail"] == row["reason"]
    assert any(problem == f"run 'up': its speed is not known: {row['reason']}" for problem in analysis.problems)
    assert analysis.runs[0].measurement.steady  # nothing says otherwise


def test_what_lines_need_is_said_where_they_are_asked_for(tmp_path):
    analysis = analysed(campaign(tmp_path, text='[analysis]\nspeed_from = "lines"\n', fleet=None))
    assert any("its speed is not read from lines: no order of the drive is known" in text for text in analysis.problems)


def test_the_kinematics_of_a_steady_run_rests_on_its_lines(tmp_path):
    """Constant at 12 turns/s, told by nobody; error and source are those of the lines."""
    path = campaign(tmp_path)
    write_log(tmp_path / "up.h5", {"gearbox": (shaken(turns=12.0 * T), "m/s^2")})
    analysis = analysed(path)
    (found,) = analysis.tables["kinematics"].to_dict("records")
    assert found["speed_source"].startswith("lines of gearbox, confidence ")
    assert found["motor_speed_rpm"] == pytest.approx(720.0, rel=1e-3)
    assert found["mesh_frequency_hz"] == pytest.approx(31.0 * 12.0, rel=1e-3)


def test_the_range_is_that_of_the_operation_or_of_what_the_runs_state(tmp_path):
    low, high = 2.0 * PER_METRE, 1.25 * 30.0 / 3.6 * 3.6 * PER_METRE
    found = settings(tmp_path / "a", fleet=FLEET + "[operation]\ntrain_speed_km_h = [36, 108]\ntorque_n_m = 100\n")
    assert (found.lowest_hz, found.highest_hz) == pytest.approx((low, high))
    run = table("run", condition="up", logs=["up.h5"], start_train_speed_km_h=216.0)
    assert settings(tmp_path / "b", run=run).highest_hz == pytest.approx(2.0 * high)


@pytest.mark.parametrize(
    ("range_rpm", "words"),
    [
        ([420, 1060], "it reaches 1060 rpm, up to which it was sought; [analysis] motor_speed_range_rpm sets"),
        ([120, 720], "its lines would be orders of 2 times the speed too, beyond the 120 to 720 rpm searched"),
    ],
)
def test_a_speed_outside_of_the_range_that_is_searched_is_doubted(tmp_path, range_rpm, words):
    """It turns at 480 to 1056 rpm: at half of that mesh x1 would be mesh x2."""
    analysis = analysed(campaign(tmp_path, text=f"[analysis]\nmotor_speed_range_rpm = {range_rpm}\n"))
    (row,) = speeds(analysis)
    assert words in row["notes"]
    assert any(words in text for text in said(analysis, "speed").query("verdict == 'warning'")["detail"])


@pytest.mark.parametrize("quantity", ["motor", "train"])
def test_a_run_backwards_has_the_orders_of_one_forwards(tmp_path, quantity):
    """A speed channel that reads below zero, steady."""
    keys = {"shaft": "motor", "unit": "Hz"} if quantity == "motor" else {"unit": "m/s"}
    channel = table("channel", name="speed", quantity="speed", **keys)
    value = -12.0 if quantity == "motor" else -12.0 / PER_METRE
    analysis = analysed(campaign(tmp_path, GEARBOX + channel, speed=(np.full(T.size, value), keys["unit"])))
    (found,) = analysis.tables["kinematics"].to_dict("records")
    assert found["motor_speed_rpm"] == pytest.approx(720.0) and found["train_speed_km_h"] > 0.0


def test_a_run_at_rest_is_one(tmp_path):
    """No pulse, no motion: a speed channel at zero gives no kinematics, and nothing fails."""
    channel = table("channel", name="speed", quantity="speed", shaft="motor", unit="Hz")
    analysis = analysed(campaign(tmp_path, GEARBOX + channel, speed=(np.zeros(T.size), "Hz")))
    assert any("stands still" in detail for detail in said(analysis, "speed")["detail"])
    (row,) = speeds(analysis)
    assert (row["mean"], row["known_share"]) == (0.0, pytest.approx(1.0, abs=0.01))


# ---------------------------------------------------------------- several speeds


def test_slip_is_told_where_train_and_motor_are_known(tmp_path, conformance):
    """1 % of creep, and a slip of 6 % from 6 s to 8 s."""
    slip = np.where((T > 6.0) & (T < 8.0), 0.06, 0.01)
    turns = np.cumsum(SPEED) / RATE_HZ
    train = SPEED / PER_METRE / (1.0 + slip)
    path = campaign(tmp_path, GEARBOX + TACHO + GPS, tacho=(pulses(turns), "V"), gps=(train, "m/s"))
    analysis = analysed(path)
    (row,) = analysis.tables["slip"].to_dict("records")
    assert (row["train_channel"], row["shaft_channel"], row["shaft"]) == ("gps", "tacho", "motor")
    conformance(
        "usual slip, by the analysis", 0.01, row["usual_slip"], 5e-4, "1", "known input: wheel and train of known slip"
    )
    assert row["n_events"] == 1 and row["worst_event"] == "slip"
    assert (row["worst_slip"], row["worst_from_s"], row["worst_to_s"]) == pytest.approx((0.05, 6.0, 8.0), abs=0.1)
    assert row["reason"] is None or row["reason"] != row["reason"]
    assert analysis.slips["up"][0].slip.times_s.size > 100


def test_no_table_of_slip_without_two_speeds(tmp_path):
    assert "slip" not in analysed(campaign(tmp_path)).tables


def test_a_wrong_number_of_pulses_is_said_with_the_right_one(tmp_path):
    train = SPEED / PER_METRE
    tacho = (pulses(per_rev=40), "V")  # the campaign says 20
    analysis = analysed(campaign(tmp_path, GEARBOX + TACHO + GPS, tacho=tacho, gps=(train, "m/s")))
    found = said(analysis, "tacho")
    assert any(
        detail.startswith("reads 2 times the speed that is expected: pulses_per_rev = 40 would fit, not 20 (by gps)")
        for detail in found["detail"]
    )
    (row,) = [row for row in speeds(analysis) if row["channel"] == "gps"]
    assert row["beside_leading"] == pytest.approx(-0.5, abs=0.01)


@pytest.mark.parametrize("stated", [{"motor_speed_rpm": 360.0}, {"train_speed_km_h": 3.6 * 6.0 / PER_METRE}])
def test_a_stated_speed_doubts_a_tacho_too(tmp_path, stated):
    run = run_table("up", **{"train_speed_km_h": None, **stated})
    run = "\n".join(line for line in run.splitlines() if "null" not in line) + "\n"
    path = campaign(tmp_path, GEARBOX + TACHO, run=run, tacho=(pulses(12.0 * T), "V"))
    assert any("pulses_per_rev = 40 would fit" in detail for detail in said(analysed(path), "tacho")["detail"])


# ---------------------------------------------------------------- result file, real run-up


def test_the_result_file_holds_speeds_with_their_errors(tmp_path):
    from tdacoustic.tables.result_file import write_result_file

    x = pulses(12.0 * T)
    x[T > 8.0] = 0.0
    analysis = analysed(campaign(tmp_path, GEARBOX + TACHO + GPS, tacho=(x, "V"), gps=(np.full(T.size, 12.0), "m/s")))
    write_result_file(tmp_path / "r.h5", "x", "measured", analysis.runs, None, analysis.slips)
    with h5py.File(tmp_path / "r.h5") as file:
        tacho = file["up/speed/tacho"]
        assert tacho.attrs["source"] == "tacho" and tacho["error"].shape == tacho["speed"].shape
        assert tacho["unknown_from_s"][0] == pytest.approx(8.0, abs=0.1) and tacho["unknown_to_s"][0] == SECONDS
        assert file["up/slip/tacho/slip"].shape == file["up/slip/tacho/time_s"].shape


@pytest.mark.skipif(not CAR.exists(), reason="the shared recordings are not here")
def test_the_real_run_up_through_the_analysis(tmp_path, conformance):
    """A car's sound beside its own speed channel; orders 2, 4, 6 of the crank are all that is known."""
    shutil.copy(CAR, tmp_path / "up.wav")
    mic = table("channel", name="mic", source=1, quantity="sound_pressure", role="near_field")
    rpm = table("channel", name="rpm", source=2, quantity="speed", shaft="motor")
    run = table("run", condition="up", logs=["up.wav"])
    text = "[analysis]\norders = [2, 4, 6]\nmotor_speed_range_rpm = [600, 6000]\n"
    found = {}
    for name, channels, keys in (("alone", mic, ""), ("beside", mic + rpm, 'speed_from = "lines"\n')):
        path = tmp_path / f"{name}.toml"
        path.write_text(HEAD + channels + run + text + keys, encoding="utf-8")
        found[name] = analysed(path)
    (row,) = speeds(found["alone"])
    assert (row["source"], row["channel"]) == ("lines", "lines of mic") and row["known_share"] > 0.9
    profiles = found["beside"].runs[0].measurement.speed.profiles
    crank, lines = profiles
    off = lines.speed / crank.speed_at(lines.times_s) - 1.0
    source = "recording: Ansys, accel_with_rpm.wav, its own speed channel"
    conformance("car run-up through the analysis, rms", 0.0, float(np.sqrt(np.mean(off**2))), 0.006, "1", source)
    assert row["mean"] == pytest.approx(60.0 * lines.mean)
