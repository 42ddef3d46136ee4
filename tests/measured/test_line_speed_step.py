"""The motor's speed from the lines of made-up vibration, as a step: when it is read, how sure, and when it is not."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from tdacoustic.measured import line_speed_step
from tdacoustic.measured.line_speed_step import LineSpeedSettings, complete_speed
from tdacoustic.measured.results import RunSpeed
from tdacoustic.recording import Channel
from tdacoustic.speed import CombOrder, Decimator, SpeedProfile

RATE = 4096.0
T = np.arange(int(12 * RATE)) / RATE
SPEED = 8.0 + 0.8 * T
ORDERS = tuple(CombOrder(f"mesh x{h}", 23.0 * h, 0.8 - 0.1 * h) for h in (1, 2, 3)) + tuple(
    CombOrder(f"motor shaft x{h}", float(h), 0.3) for h in (1, 2)
)


class LogAt:
    """What the step needs of a hashed log."""

    def __init__(self, path):
        self.path = path


def shaken(speed, seed=0, rms=0.3, rate=RATE):
    """Orders 1, 2, 23, 46 and 69 of one amplitude in white noise of rms 1."""
    rng = np.random.default_rng(seed)
    turns = np.cumsum(speed) / rate
    lines = sum(
        rms * np.sqrt(2.0) * np.cos(2.0 * np.pi * k * turns + rng.uniform(0.0, 6.3)) for k in (1, 2, 23, 46, 69)
    )
    return lines + rng.standard_normal(speed.size)


def log_of(folder, signals, rate=RATE):
    path = folder / "log.h5"
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for number, x in enumerate(signals):
            data = file.create_dataset(f"acc{number}", data=x)
            data.attrs["unit"], data.attrs["sample_rate_hz"] = "m/s^2", rate
    return LogAt(path)


def settings_of(count=1, n_samples=T.size, rate=RATE, start_s=0.0, **changes):
    channels = tuple(
        Channel(f"acc{k}", "acceleration", "m/s^2", 0, k, rate, 0, n_samples, start_s=start_s) for k in range(count)
    )
    values = {"orders": ORDERS, "lowest_hz": 3.0, "highest_hz": 30.0, "acceleration_hz_s": 3.0, **changes}
    return LineSpeedSettings(channels, **values)


def told(shaft="motor", si_symbol="1/s", factor=1.0):
    return RunSpeed((SpeedProfile("tacho", shaft, si_symbol, T[::200], factor * SPEED[::200]),))


def rms_off(profile, start_s=0.0):
    true = np.interp(profile.times_s - start_s, T, SPEED)
    return float(np.sqrt(np.mean((profile.speed / true - 1.0) ** 2)))


def test_a_speed_that_no_channel_tells_is_read_from_lines(tmp_path, conformance):
    """On the run's time axis, which begins 100 s earlier; a dead channel beside it does no harm."""
    log = log_of(tmp_path, [shaken(SPEED), np.zeros(T.size)])
    speed = complete_speed(settings_of(2, start_s=100.0), (log,), RunSpeed(()))
    (profile,) = speed.profiles
    assert (profile.channel, profile.shaft, profile.source) == ("lines of acc0", "motor", "lines")
    assert speed.lines.reason is None and speed.lines.channels == ("acc0",)
    conformance(
        "run-up from lines, as a step, rms",
        0.0,
        rms_off(profile, 100.0),
        2e-4,
        "1",
        "known input: vibration of a known speed",
    )
    assert speed.angle_of("motor").channel == "lines of acc0"
    assert profile.known_share(100.0, 112.0) > 0.9 and np.median(profile.confidence) > 0.9
    assert {"mesh x1", "mesh x2", "mesh x3"} <= {name for name, part in speed.lines.heard if part > 0.5}


@pytest.mark.parametrize(
    ("speed", "changes", "read"),
    [
        (told("motor"), {}, False),
        (told("wheelset"), {}, False),
        (told(None, "m/s"), {"turns_per_metre": 1.0}, False),
        (told(None, "m/s"), {}, True),
        (told(None), {}, True),
        (told("motor"), {"always": True}, True),
    ],
)
def test_lines_are_read_only_where_they_are_needed(tmp_path, speed, changes, read):
    log = log_of(tmp_path, [shaken(SPEED)])
    got = complete_speed(settings_of(**changes), (log,), speed)
    assert len(got.profiles) == 1 + read and (got.lines is not None) == read
    assert got.profiles[0] is speed.profiles[0]  # the channel leads


def test_noise_gives_no_speed_and_the_reason(tmp_path):
    log = log_of(tmp_path, [np.random.default_rng(1).standard_normal(T.size)])
    speed = complete_speed(settings_of(), (log,), RunSpeed(()))
    assert speed.profiles == () and speed.angles == ()
    assert speed.lines.reason.startswith("no speed in the lines: ") and speed.is_steady(0.03)


@pytest.mark.parametrize(
    ("signal", "words"),
    [(np.zeros(T.size), "no channel that changes"), (shaken(SPEED[:2000]), "are too short for a speed from lines")],
)
def test_what_cannot_be_searched_is_a_reason_and_no_error(tmp_path, signal, words):
    log = log_of(tmp_path, [signal])
    speed = complete_speed(settings_of(n_samples=signal.size), (log,), RunSpeed(()))
    assert speed.profiles == () and words in speed.lines.reason


def test_a_train_speed_guides_on_the_runs_own_time(tmp_path):
    """Orders whose lines fit twice the speed as well; a train speed 4 % off tells which, 100 s later."""
    orders = tuple(CombOrder(f"order {k:g}", k) for k in (11.5, 23.0, 46.0, 92.0))
    turns = np.cumsum(SPEED) / RATE
    x = sum(0.4 * np.cos(2.0 * np.pi * k * turns) for k in (23.0, 46.0))
    log = log_of(tmp_path, [x + np.random.default_rng(0).standard_normal(T.size)])
    train = SpeedProfile("gps", None, "m/s", 100.0 + T[::200], 0.96 * 0.5 * SPEED[::200])
    known = settings_of(start_s=100.0, orders=orders, always=True)
    blind = complete_speed(known, (log,), RunSpeed((train,)))
    guided = complete_speed(replace(known, turns_per_metre=2.0), (log,), RunSpeed((train,)))
    assert blind.lines.reason is not None and "times the speed as well" in blind.lines.reason
    assert rms_off(guided.profiles[1], 100.0) < 0.003


def test_a_known_start_tells_two_readings_apart_and_rest_says_nothing(tmp_path):
    orders = tuple(CombOrder(f"order {k:g}", k) for k in (11.5, 23.0, 46.0, 92.0))
    turns = np.cumsum(SPEED) / RATE
    x = sum(0.4 * np.cos(2.0 * np.pi * k * turns) for k in (23.0, 46.0))
    log = log_of(tmp_path, [x + np.random.default_rng(0).standard_normal(T.size)])
    known = complete_speed(settings_of(orders=orders, start_hz=8.1), (log,), RunSpeed(()))
    rest = complete_speed(settings_of(orders=orders, start_hz=0.5), (log,), RunSpeed(()))
    assert rms_off(known.profiles[0]) < 0.003 and rest.profiles == ()


def test_a_long_run_is_searched_in_sections_that_go_on_from_each_other(tmp_path, monkeypatch):
    """One section is noise alone: it is said, and the others are read."""
    monkeypatch.setattr(line_speed_step, "SECTION_S", 8.0)
    t = np.arange(int(32 * RATE)) / RATE
    speed = 10.0 + 4.0 * np.sin(2.0 * np.pi * t / 20.0)
    x = shaken(speed)
    silent = (t >= 16.0) & (t < 24.0)
    x[silent] = np.random.default_rng(3).standard_normal(int(silent.sum()))
    got = complete_speed(settings_of(n_samples=t.size), (log_of(tmp_path, [x]),), RunSpeed(()))
    (profile,) = got.profiles
    assert np.all(np.diff(profile.times_s) > 0.0)
    assert np.sqrt(np.mean((profile.speed / np.interp(profile.times_s, t, speed) - 1.0) ** 2)) < 1e-3
    assert np.isnan(profile.speed_at(20.0)) and np.isfinite(profile.speed_at([4.0, 12.0, 28.0])).all()
    assert any(fault.startswith("not known from 16.00 s to 24.00 s: no speed in the lines") for fault in profile.faults)
    assert np.isnan(got.angles[0].turns_at(20.0))


def test_a_fast_log_gives_the_same_speed_from_fewer_samples(tmp_path):
    rate = 8.0 * RATE
    t = np.arange(int(12 * rate)) / rate
    x = shaken(8.0 + 0.8 * t, rms=0.3, rate=rate)
    (profile,) = complete_speed(
        settings_of(n_samples=t.size, rate=rate), (log_of(tmp_path, [x], rate),), RunSpeed(())
    ).profiles
    assert np.sqrt(np.mean((profile.speed / (8.0 + 0.8 * profile.times_s) - 1.0) ** 2)) < 2e-4


@pytest.mark.parametrize("factor", [1, 2, 5])
def test_decimation_keeps_what_is_heard_and_folds_nothing(factor):
    rate, n = 9000.0 * factor, 30000
    t = np.arange(n) / rate
    low, high = np.cos(2.0 * np.pi * 3900.0 * t), np.cos(2.0 * np.pi * 5200.0 * t)
    whole, pieces = (Decimator(factor, 2) for _ in range(2))
    one = whole.take(np.stack((low, high)))
    parts = [pieces.take(part) for part in np.split(np.stack((low, high)), [7, 8, 1000, 1003, 20000], axis=1)]
    assert np.array_equal(one, np.concatenate(parts, axis=1))
    assert one.shape[1] == whole.count(n)
    inner = slice(60, -60)
    assert np.allclose(one[0][inner], low[::factor][: one.shape[1]][inner], atol=2e-3)
    if factor > 1:
        assert np.max(np.abs(one[1][inner])) < 3e-4
