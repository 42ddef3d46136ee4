"""The speed of a run from its logs: tachos good and bad, speed channels, and who leads."""

import h5py
import numpy as np
import pytest

from tdacoustic.formats import scan
from tdacoustic.measured.results import RunSpeed
from tdacoustic.measured.speed_step import SpeedSettings, measure_speed
from tdacoustic.recording import Channel
from tdacoustic.speed import SpeedProfile

RATE = 10240.0
T = np.arange(int(20 * RATE)) / RATE


class LogAt:
    """What the step needs of a hashed log."""

    def __init__(self, path):
        self.path = path


def speed_of(folder, x, quantity="tacho", pulses_per_rev=20.0):
    path = folder / "log.h5"
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        data = file.create_dataset("t", data=x)
        data.attrs["unit"], data.attrs["sample_rate_hz"] = "V", RATE
    assert scan(path).channels[0].raster.n_samples == x.size
    symbol = "V" if quantity == "tacho" else "1/s"
    channel = Channel("t", quantity, symbol, 0, 0, RATE, 0, x.size, shaft="motor", pulses_per_rev=pulses_per_rev)
    return measure_speed(SpeedSettings((channel,)), (LogAt(path),))


def pulses(turns_per_s, per_rev=20):
    phase = np.mod(turns_per_s * per_rev * T, 1.0)
    return 5.0 * np.clip(np.minimum(phase / 0.06, (0.56 - phase) / 0.06), 0.0, 1.0)


def test_a_tacho_gives_its_shafts_speed(tmp_path, conformance):
    speed = speed_of(tmp_path, pulses(17.3))
    (profile,) = speed.profiles
    assert (profile.shaft, profile.si_symbol, profile.doubtful, speed.problems) == ("motor", "1/s", False, ())
    conformance("speed from a tacho", 17.3, profile.mean, 17.3e-5, "1/s", "analytic")
    assert profile.is_constant(1e-3)
    assert "20 per revolution" in profile.notes[0]


def test_missing_pulses_are_said(tmp_path):
    x = pulses(17.3)
    for start in (5.0, 10.0, 15.0):
        x[(start <= T) & (start + 0.5 / 17.3 / 20 * 3 > T)] = 0.0
    (profile,) = speed_of(tmp_path, x).profiles
    assert profile.doubtful and "missing put in" in profile.notes[0]
    assert profile.mean == pytest.approx(17.3, rel=2e-3)


@pytest.mark.parametrize("scatter", [0.0, 1e-3, 0.2])
@pytest.mark.parametrize("seed", range(3))
def test_a_tacho_that_stands_gives_no_speed(tmp_path, scatter, seed):
    x = 2.5 + scatter * np.random.default_rng(seed).standard_normal(T.size)
    speed = speed_of(tmp_path, x)
    assert speed.profiles == ()
    assert speed.problems[0][0] == "t"
    if scatter == 0.0:
        assert speed.problems[0][1] == "tacho 't' has no pulses: it stays at 2.5 V"


def test_a_tacho_without_pulses_per_rev_is_a_problem(tmp_path):
    assert "needs pulses_per_rev" in speed_of(tmp_path, pulses(17.3), pulses_per_rev=None).problems[0][1]


def test_a_speed_channel_is_averaged_and_an_empty_one_is_a_problem(tmp_path):
    (profile,) = speed_of(tmp_path, np.full(T.size, 12.5), "speed").profiles
    assert set(profile.speed) == {12.5}
    assert "holds no numbers" in speed_of(tmp_path, np.full(T.size, np.nan), "speed").problems[0][1]


def test_the_motor_leads_then_the_wheelset():
    train, wheelset, motor = (
        SpeedProfile(name, name, "1/s", np.arange(3.0), np.full(3, 9.0)) for name in ("train", "wheelset", "motor")
    )
    assert RunSpeed((train, wheelset, motor)).leading is motor
    assert RunSpeed((train, wheelset)).leading is wheelset
    assert RunSpeed(()).leading is None and RunSpeed(()).is_steady(0.01)
    assert RunSpeed((train,)).of_shaft("motor") is None
