"""The mesh order over run-ups as data of a calibration."""

import math

import numpy as np
import pytest
from level_campaigns import REFERENCE, Made, campaign_of, mic, pascal, run_of, tone
from small_campaigns import RATE_HZ, table

from tdacoustic.errors import FittingError
from tdacoustic.workflows.measured_levels import campaign_conditions

MESH_ORDER = 31.0


def run_up(level_of_rpm, seconds=20.0, noise_db=50.0, seed=1, extra=None):
    """A run-up from 600 to 1800 rpm: microphone and speed; the mesh order by plain integration of its phase."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    turns_hz = 10.0 + 20.0 * t / seconds
    phase = 2.0 * np.pi * np.cumsum(turns_hz) / RATE_HZ
    sound = np.sqrt(2.0) * pascal(level_of_rpm(60.0 * turns_hz)) * np.sin(MESH_ORDER * phase)
    sound += pascal(noise_db) * np.random.default_rng(seed).standard_normal(t.size)
    if extra is not None:
        sound += extra(t)
    return {"m": (sound, "Pa"), "n": (60.0 * turns_hz, "rpm")}


SPEED = table("channel", name="n", quantity="speed", shaft="motor", unit="rpm")


def made_run_up(folder, logs, text="", fleet=None, **keys):
    runs = [run_of("up", name, **{"train_speed_km_h": None, **keys}) for name in logs]
    runs = [run.replace("train_speed_km_h = null\n", "") for run in runs]
    return Made(folder, mic("m", distance_m=4.0) + SPEED, runs, logs, text, fleet)


def test_the_mesh_order_over_a_run_up(tmp_path, conformance):
    def level_of(rpm):
        return 75.0 + 8.0 * np.sin(2.0 * np.pi * (rpm - 600.0) / 1200.0)

    made = made_run_up(tmp_path, {"up1": run_up(level_of)})
    data, doubts = made.levels("orders")
    assert 8 <= len(data) <= 12
    speeds = [60.0 * datum.condition.motor_hz for datum in data]
    assert np.diff(speeds) == pytest.approx(np.full(len(data) - 1, np.diff(speeds).mean()), rel=0.1)
    assert speeds[0] < 700.0 and speeds[-1] > 1700.0
    worst = max(abs(datum.level_db - level_of(speed)) for datum, speed in zip(data, speeds, strict=True))
    conformance(
        "mesh order over a run-up of a campaign",
        0.0,
        worst,
        0.3,
        "dB",
        "known input: an order of known level over speed",
    )
    for datum, speed in zip(data, speeds, strict=True):
        assert datum.condition.name == f"up at {speed:.0f} rpm"
        assert (datum.what, datum.group, datum.receiver.name) == ("mesh order", "up", "4 m")
        low, high = datum.band_hz
        assert 0.5 * (low + high) == pytest.approx(MESH_ORDER * datum.condition.motor_hz)
        assert 32.0 < high - low < 60.0  # four lines of 8 Hz and the order's travel in a segment
        assert datum.condition.train_speed_km_h == pytest.approx(speed / 60 * math.pi * 1.05112 * 31 / 104 * 3.6)
        assert datum.condition.torque_n_m == 5913.0
        assert "segments; 1 run, 1 receiver; sigma of instruments 0.3 dB, the record itself" in datum.source
        assert 0.3 < datum.sigma_db < 0.6
    assert doubts == ["run up1 of condition up is a run-up: it has no one speed, and no level of its own"]


def test_two_run_ups_are_averaged_and_their_torque_is_kept(tmp_path):
    logs = {"u1": run_up(lambda rpm: 74.0 + 0 * rpm), "u2": run_up(lambda rpm: 76.0 + 0 * rpm, seed=2)}
    data, _ = made_run_up(tmp_path, logs, torque_n_m=1500.0).levels("orders")
    expected = 10.0 * math.log10(0.5 * (10.0**7.4 + 10.0**7.6))
    assert [datum.level_db for datum in data] == pytest.approx([expected] * len(data), abs=0.2)
    assert {datum.condition.torque_n_m for datum in data} == {1500.0}
    # Runs 2 dB apart at each speed: s = sqrt(2) dB, over ten speeds ten degrees of freedom (1.0526 by Student).
    sigma = math.hypot(0.3, 1.0526 * math.sqrt(2.0) / math.sqrt(2.0))
    assert [datum.sigma_db for datum in data] == pytest.approx([sigma] * len(data), rel=0.1)


@pytest.mark.parametrize("shaft", ["motor", "wheelset", "train"])
def test_any_speed_channel_and_a_cut_of_the_log_will_do(tmp_path, shaft):
    """The order's level tells the speed: an axis of times that is off by the cut's 4 s would lose or misplace it."""

    def level_of(rpm):
        return 70.0 + 10.0 * (rpm - 600.0) / 1200.0

    held = run_up(level_of)
    motor_rpm, unit = held["n"][0], "rpm"
    if shaft == "wheelset":
        held["n"] = (motor_rpm * 31 / 104, unit)
    if shaft == "train":
        held["n"] = (motor_rpm / 60 * 31 / 104 * math.pi * 0.98 * 3.6, "km/h")  # of a worn wheel
    keys = {} if shaft == "train" else {"shaft": shaft}
    channel = table("channel", name="n", quantity="speed", unit="km/h" if shaft == "train" else unit, **keys)
    run = table("run", name="up1", condition="up", logs=["up1.h5"], start_s=4.0, end_s=18.0, wheel_diameter_mm=980.0)
    data, _ = Made(tmp_path, mic("m", distance_m=4.0) + channel, [run], {"up1": held}).levels("orders")
    speeds = [60.0 * datum.condition.motor_hz for datum in data]
    assert len(data) >= 8 and 840.0 < min(speeds) < 900.0 and 1600.0 < max(speeds) < 1680.0
    assert [d.level_db - level_of(s) for d, s in zip(data, speeds, strict=True)] == pytest.approx(
        np.zeros(len(data)), abs=0.2
    )
    assert data[0].condition.train_speed_km_h == pytest.approx(speeds[0] / 60 * 31 / 104 * math.pi * 0.98 * 3.6)


def test_speeds_with_another_line_or_without_the_order_are_counted(tmp_path):
    """A line that the fleet has at 600 Hz meets the mesh order at 1161 rpm; below 840 rpm the order is gone."""
    fleet = REFERENCE.read_text(encoding="utf-8").replace(
        "[housing]\n", '[[motor.excitation]]\nname = "fan"\nfixed_hz = 600\n\n[housing]\n', 1
    )
    level = lambda rpm: np.where(rpm < 840.0, 20.0, 75.0)  # noqa: E731
    fan = lambda t: np.sqrt(2.0) * pascal(80.0) * np.sin(2.0 * np.pi * 600.0 * t)  # noqa: E731
    data, doubts = made_run_up(tmp_path, {"up1": run_up(level, extra=fan)}, fleet=fleet).levels("orders")
    speeds = [60.0 * datum.condition.motor_hz for datum in data]
    assert min(speeds) > 840.0 and not any(abs(speed - 1161.0) < 40.0 for speed in speeds)
    assert [datum.level_db for datum in data] == pytest.approx([75.0] * len(data), abs=0.3)
    (doubt,) = [doubt for doubt in doubts if "speeds are not used" in doubt]
    assert doubt.startswith(f"run-up up: {10 - len(data)} of 10 speeds are not used: ")
    assert "2 at which the mesh order does not stand 6 dB over its floor" in doubt
    assert "1 at which another line of the fleet lies beside it" in doubt


def test_what_lies_outside_of_the_model_or_is_excluded_is_counted(tmp_path):
    fleet = REFERENCE.read_text(encoding="utf-8").replace("max_frequency_hz = 3000", "max_frequency_hz = 700")
    exclude = table("exclude", condition="up", frequency_hz=[390.0, 410.0], reason="fan")
    made = made_run_up(tmp_path, {"up1": run_up(lambda rpm: 75.0 + 0 * rpm)}, exclude, fleet)
    data, doubts = made.levels("orders")
    assert max(datum.band_hz[1] for datum in data) <= 700.0
    assert not any(datum.band_hz[0] < 410.0 and datum.band_hz[1] > 390.0 for datum in data)
    assert "outside of the model's frequencies or of the torque law" in doubts[-1]
    assert "1 excluded by the campaign" in doubts[-1]
    law = 'torque = "table"\ntorque_table = [[10, 4000], [40, 4000]]'
    fleet = REFERENCE.read_text(encoding="utf-8").replace('torque = "constant"', law)
    data, doubts = made_run_up(tmp_path / "law", {"up1": run_up(lambda rpm: 75.0 + 0 * rpm)}, fleet=fleet).levels(
        "orders"
    )
    assert {datum.condition.torque_n_m for datum in data} == {4000.0}
    assert max(datum.condition.train_speed_km_h for datum in data) <= 40.0
    assert "outside of the model's frequencies or of the torque law" in doubts[-1]


def test_a_run_up_has_no_overall_level(tmp_path):
    """Even where a speed is stated: the level belongs to no one speed, and the model has no such condition."""
    logs = {
        "up1": run_up(lambda rpm: 75.0 + 0 * rpm),
        "a1": {"m": (tone(80.0, 500.0), "Pa"), "n": (1200.0 + 0 * tone(0, 9), "rpm")},
    }
    runs = [run_of("up", "up1", train_speed_km_h=30.0), run_of("a", "a1", train_speed_km_h=70.0)]
    made = Made(tmp_path, mic("m", distance_m=4.0) + SPEED, runs, logs)
    for data in ("surface", "receivers", "bands"):
        found, doubts = made.levels(data)
        assert {datum.condition.name for datum in found} == {"a"}
        assert "run up1 of condition up is a run-up: it has no one speed, and no level of its own" in doubts
    conditions, _ = campaign_conditions(made.campaign, made.analysis, made.fleet)
    assert set(conditions) == {"a"}


def test_run_ups_that_cannot_be_used(tmp_path):
    made = made_run_up(tmp_path, {"up1": run_up(lambda rpm: 75.0 + 0 * rpm)})
    with pytest.raises(FittingError, match=r"no level to calibrate with.*not \(any longer\) in the store"):
        made.levels("orders", store=None)
    steady = campaign_of(tmp_path / "steady", {"a1": ("a", {"m": 80.0})})
    with pytest.raises(FittingError, match="no run is a run-up with a known speed: there are no order levels"):
        steady.levels("orders")
    data, doubts = steady.levels("orders", "surface")
    assert len(data) == 1 and "no run is a run-up with a known speed: there are no order levels" in doubts
