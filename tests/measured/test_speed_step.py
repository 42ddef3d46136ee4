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
    conformance("speed from a tacho", 17.3, profile.mean, 17.3e-5, "1/s", "known input: tacho pulses of known speed")
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
        assert speed.problems[0][1].startswith("tacho 't' has no pulses: it stays at 2.5 V; the shaft stands, or")


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


def both(folder, first, second, **changes):
    """Two tachos of one log."""
    path = folder / "log.h5"
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name, x in (("a", first), ("b", second)):
            data = file.create_dataset(name, data=x)
            data.attrs["unit"], data.attrs["sample_rate_hz"] = "V", RATE
    known = {"shaft": "motor", "pulses_per_rev": 20.0, **changes}
    channels = tuple(Channel(name, "tacho", "V", 0, k, RATE, 0, first.size, **known) for k, name in enumerate("ab"))
    return measure_speed(SpeedSettings(channels), (LogAt(path),))


def of_angle(turns, per_rev=20, shift=0.0):
    """Trapezoids of the angle, a part of a tooth late."""
    phase = np.mod(turns * per_rev - shift, 1.0)
    return 5.0 * np.clip(np.minimum(phase / 0.06, (0.56 - phase) / 0.06), 0.0, 1.0)


def test_a_run_up_has_an_angle_with_its_channels_name(tmp_path, conformance):
    speed = speed_of(tmp_path, of_angle(5.0 * T + 0.4 * T**2))
    angle = speed.angle_of("motor")
    assert (angle.channel, angle.shaft, speed.angles) == ("t", "motor", (angle,))
    t = np.linspace(1.0, 19.0, 500)
    turned = angle.turns_at(t) - (5.0 * t + 0.4 * t**2)
    # A flank lasts one and a half samples at 21 turns/s: a fifth of a sample is 4e-4 turns.
    conformance(
        "angle of a run-up from a tacho, spread",
        0.0,
        float(np.ptp(turned)),
        4e-4,
        "1",
        "known input: tacho pulses of known speed",
    )


def test_a_speed_channel_has_an_angle_and_a_trains_has_none(tmp_path):
    """A train's speed turns a shaft by a wheel that the step does not know."""
    speed = speed_of(tmp_path, 5.0 + 0.8 * T, "speed")
    t = np.array([2.0, 18.0])
    assert np.diff(speed.angle_of("motor").turns_at(t)) == pytest.approx(5.0 * 16.0 + 0.4 * (18.0**2 - 4.0), rel=1e-5)
    path = tmp_path / "log.h5"
    train = Channel("t", "speed", "m/s", 0, 0, RATE, 0, T.size)
    assert measure_speed(SpeedSettings((train,)), (LogAt(path),)).angles == ()


def test_a_tacho_that_stops_halfway_is_known_until_then(tmp_path):
    x = pulses(17.3)
    x[T > 11.0] = 0.0
    speed = speed_of(tmp_path, x)
    (profile,) = speed.profiles
    assert profile.doubtful and np.isfinite(profile.speed).all()
    assert profile.known_share(0.0, 20.0) == pytest.approx(0.55, abs=0.01)
    assert any("no pulses after 11.0" in fault for fault in profile.faults)
    assert np.isnan(speed.angle_of("motor").turns_at(15.0)) and np.isnan(profile.speed_at(15.0))


@pytest.mark.parametrize(
    ("span", "share", "words"),
    [
        ((0.0, 20.0), 1.0, None),
        ((-5.0, 20.0), 0.8, "not known from -5.00 s to 0.0"),
        ((0.0, 30.0), 2.0 / 3.0, "not known from 19.9"),
    ],
)
def test_a_tacho_that_is_shorter_than_the_signals_is_said(tmp_path, span, share, words):
    path = tmp_path / "log.h5"
    speed_of(tmp_path, pulses(17.3))
    channel = Channel("t", "tacho", "V", 0, 0, RATE, 0, T.size, shaft="motor", pulses_per_rev=20.0)
    (profile,) = measure_speed(SpeedSettings((channel,), span), (LogAt(path),)).profiles
    assert profile.known_share(*span) == pytest.approx(share, abs=0.01)
    assert bool(profile.faults) == (words is not None) and all(words in fault for fault in profile.faults)


def test_a_speed_outside_of_the_signals_time_is_none(tmp_path):
    path = tmp_path / "log.h5"
    speed_of(tmp_path, np.full(T.size, 12.5), "speed")
    channel = Channel("t", "speed", "1/s", 0, 0, RATE, 0, T.size, start_s=100.0, shaft="motor")
    speed = measure_speed(SpeedSettings((channel,), (0.0, 20.0)), (LogAt(path),))
    assert speed.profiles == () and speed.angles == ()
    assert speed.problems == (
        (
            "t",
            "speed channel 't' tells the speed from 100.02 s to 119.97 s alone, outside of the signals' time "
            "from 0.00 s to 20.00 s",
        ),
    )


def test_a_speed_channel_with_a_hole_leaves_it_open(tmp_path):
    x = np.full(T.size, 12.5)
    x[(T > 5.0) & (T < 8.0)] = np.nan
    speed = speed_of(tmp_path, x, "speed")
    (profile,) = speed.profiles
    assert np.isnan(profile.speed_at(6.5)) and np.isfinite(profile.speed_at([4.0, 9.0])).all()
    assert np.isnan(speed.angle_of("motor").turns_at(6.5))
    assert "the channel holds no numbers" in profile.faults[0]


def test_two_tachos_a_part_of_a_tooth_apart_tell_the_direction(tmp_path):
    """Forwards, to rest, and backwards; the second tacho stands a quarter of a tooth beside."""
    turns = 9.6 * T - 0.4 * T**2  # turns round at 12 s; forwards is what most edges show
    speed = both(tmp_path, of_angle(turns), of_angle(turns, shift=0.25))
    first = speed.profiles[0]
    assert first.speed_at([2.0, 19.0]) == pytest.approx([8.0, -5.6], rel=0.01)
    assert any("turns backwards from 12." in note for note in first.notes)
    assert any(start < 12.0 < stop for start, stop in speed.angles[0].breaks)


@pytest.mark.parametrize("shift", [0.0, 0.02])
def test_two_tachos_on_one_flank_tell_no_direction(tmp_path, shift):
    turns = 8.0 * T - 0.4 * T**2
    speed = both(tmp_path, of_angle(turns), of_angle(turns, shift=shift))
    assert np.all(speed.profiles[0].speed >= 0.0)


def test_pulses_as_fast_as_the_samples_are_a_problem(tmp_path):
    speed = speed_of(tmp_path, of_angle(40.0 * T, per_rev=100), pulses_per_rev=100.0)
    assert speed.profiles == () and "samples a pulse at" in speed.problems[0][1]


def test_a_result_goes_through_the_store(tmp_path):
    from tdacoustic.steps.codec import decode, encode

    x = pulses(17.3)
    x[(T > 8.0) & (T < 11.0)] = 0.0
    speed = speed_of(tmp_path, x)
    arrays = []
    again = decode(encode(speed, arrays), arrays)
    t = np.linspace(0.0, 20.0, 77)
    assert np.array_equal(again.angles[0].turns_at(t), speed.angles[0].turns_at(t), equal_nan=True)
    assert again.profiles[0].unknown == speed.profiles[0].unknown and again.profiles[0].faults
