"""Faults put into clean channels are found; their clean twins stay without a warning."""

import math

import numpy as np
import pytest
from array_recording import recording_of

from tdacoustic.measured import MeasurementSettings, RunSpeed, survey_recording
from tdacoustic.measured.measurement_step import measure_run
from tdacoustic.quality import Verdict, worst
from tdacoustic.speed import SpeedProfile

RATE, SECONDS = 8192.0, 8
N = int(RATE * SECONDS)
T = np.arange(N) / RATE
SEEDS = 20


def clean(rng, rms=1.0):
    """Sloping noise with a mesh line and its harmonics, as a drive sounds."""
    spectrum = np.fft.rfft(rng.standard_normal(N))
    spectrum *= np.maximum(np.fft.rfftfreq(N, 1.0 / RATE), 30.0) ** -0.5
    x = np.fft.irfft(spectrum, N)
    x /= x.std()
    mesh = rng.uniform(600.0, 700.0)
    x += sum(0.8**k * np.sin(2.0 * np.pi * k * mesh * T + rng.uniform(0.0, 6.28)) for k in (1, 2, 3))
    return rms * x / x.std()


def verdicts_of(data, quantity="sound_pressure", profiles=(), stated=(), **options):
    recording = recording_of(data, RATE, quantity, **options)
    settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, tuple(stated))
    return measure_run(settings, RunSpeed(tuple(profiles)), survey_recording(recording, bands=False)).verdicts


def constant_speed(rng):
    speed = 25.0 + 0.02 * rng.standard_normal(160)
    return SpeedProfile("tacho", "motor", "1/s", np.arange(160) * 0.05, speed)


def clipped(rng, x):
    step = 4.0 / 2**15
    return np.clip(np.round(x / step), -(2**14), 2**14 - 1) * step  # 2 Pa, twice the rms


def softly_clipped(rng, x):
    top = np.quantile(x, 0.995)
    return np.minimum(x, top)


def dropouts(rng, x):
    x = x.copy()
    for start in rng.integers(0, N - 400, 3):
        x[start : start + 200] = 0.0  # 24 ms
    return x


def flat(rng, x):
    x = x.copy()
    start = rng.integers(0, N // 4)
    x[start : start + int(0.6 * N)] = x[start]
    return x


def offset(rng, x):
    return x + rng.choice([-1.0, 1.0]) * rng.uniform(3.0, 10.0)


def drift(rng, x):
    return x + rng.choice([-1.0, 1.0]) * 8.0 * T / SECONDS


def few_missing(rng, x):
    x = x.copy()
    x[rng.integers(0, N) :][:5] = np.nan
    return x


def many_missing(rng, x):
    x = x.copy()
    start = rng.integers(0, N - N // 20)
    x[start : start + N // 20] = np.nan
    return x


def spread_missing(rng, x):
    x = x.copy()
    x[rng.integers(0, 1000) :: 4000] = np.nan  # 0.025 %, but in every frame
    return x


def hum(rng, x):
    mains = rng.uniform(49.9, 50.1)
    return x + sum(a * np.sin(2.0 * np.pi * k * mains * T) for k, a in ((1, 0.5), (3, 0.3)))


def too_loud(rng, x):
    return 1e4 * x


def too_quiet(rng, x):
    return 1e-5 * x


def silent(rng, x):
    return np.zeros_like(x)


FAULTS = {  # the fault: (check that finds it, its word)
    clipped: ("clipping", "bad"),
    softly_clipped: ("clipping", "warning"),
    dropouts: ("dropouts", "warning"),
    flat: ("dropouts", "bad"),
    offset: ("offset", "warning"),
    drift: ("drift", "warning"),
    few_missing: ("missing values", "warning"),
    many_missing: ("missing values", "bad"),
    spread_missing: ("missing values", "bad"),
    hum: ("mains hum", "warning"),
    too_loud: ("level", "warning"),
    too_quiet: ("level", "warning"),
    silent: ("level", "bad"),
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_a_fault_is_found_beside_its_clean_twin(fault):
    check, word = FAULTS[fault]
    found, blamed = 0, 0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        x, other = clean(rng), clean(rng)
        limits = (-2.0, 2.0 - 4.0 / 2**15) if fault is clipped else None
        verdicts = verdicts_of(
            np.array([fault(rng, x), 0.1 * other if limits else other]), limits=limits, profiles=[constant_speed(rng)]
        )
        found += any((v.channel, v.check, v.verdict) == ("c0", check, word) for v in verdicts)
        blamed += worst(v for v in verdicts if v.channel != "c0") != "ok"
    assert (found, blamed) == (SEEDS, 0)


@pytest.mark.parametrize("quantity", ["sound_pressure", "acceleration"])
@pytest.mark.parametrize("bits", [None, 16])
def test_clean_channels_have_no_warning(quantity, bits):
    for seed in range(SEEDS):
        rng = np.random.default_rng(100 + seed)
        data = np.array([clean(rng), clean(rng, 3.0)])
        if bits:
            data = np.round(data * 2**11) / 2**11  # full scale of 16 V
        verdicts = verdicts_of(data, quantity, [constant_speed(rng)])
        assert [v for v in verdicts if v.verdict != "ok"] == [], f"seed {seed}"


@pytest.mark.parametrize("rate", [8192.0, 51200.0])
def test_a_slow_tone_in_whole_numbers_is_not_clipped(rate):
    # The top of a 50 Hz tone stands on one whole number for several samples: no clipping.
    t = np.arange(int(4 * rate)) / rate
    for amplitude in (300.0, 3000.0, 12000.0):
        x = np.round(
            amplitude * np.sin(2.0 * np.pi * 53.7 * t) + 0.5 * np.random.default_rng(1).standard_normal(t.size)
        )
        recording = recording_of(x * 1e-3, rate)
        settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, ())
        verdicts = measure_run(settings, RunSpeed(()), survey_recording(recording, bands=False)).verdicts
        assert [v.detail for v in verdicts if v.check == "clipping" and v.verdict != "ok"] == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("gain", [1.0, 0.3])
def test_a_channel_recorded_twice_is_found(sign, gain):
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        x = clean(rng)
        verdicts = verdicts_of(np.array([x, clean(rng), sign * gain * x]), profiles=[constant_speed(rng)])
        (found,) = [v for v in verdicts if v.verdict != "ok"]
        assert (found.channel, found.check, found.verdict) == ("c2", "duplicate", "warning")
        assert "the same signal as channel 'c0'" in found.detail
        assert ("sign turned" in found.detail) == (sign < 0.0)


def test_two_close_channels_are_not_taken_for_one():
    rng = np.random.default_rng(1)
    x = clean(rng)
    verdicts = verdicts_of(np.array([x, x + 0.01 * rng.standard_normal(N)]), profiles=[constant_speed(rng)])
    assert worst(verdicts) == "ok"  # correlation 0.99995: the same place, another sensor


def test_a_factor_of_ten_between_siblings_is_found():
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        wrong = int(rng.integers(0, 3))
        data = np.array([clean(rng, rng.uniform(0.85, 1.18)) for _ in range(3)])
        data[wrong] *= rng.choice([0.1, 10.0])
        verdicts = verdicts_of(data, "acceleration", [constant_speed(rng)], component="gearbox")
        found = [(v.channel, v.check) for v in verdicts if v.verdict != "ok"]
        assert found == [(f"c{wrong}", "sensitivity")], f"seed {seed}"


def test_siblings_of_no_stated_component_are_not_compared():
    rng = np.random.default_rng(1)
    verdicts = verdicts_of(np.array([clean(rng), clean(rng, 10.0)]), "acceleration", [constant_speed(rng)])
    assert worst(verdicts) == "ok"


@pytest.mark.parametrize(
    ("samples", "word", "words"),
    [(15, "bad", "too short"), (4000, "warning", "shorter than one frame"), (20000, "warning", "few for a spectrum")],
)
def test_a_record_too_short_is_said(samples, word, words):
    for seed in range(SEEDS):
        x = clean(np.random.default_rng(seed))[:samples]
        (found,) = [v for v in verdicts_of(x, stated=[("motor", 25.0)]) if v.check == "length"]
        assert found.verdict == word and words in found.detail


def test_a_speed_that_is_not_constant_is_said_and_not_averaged():
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        times = np.arange(160) * 0.05
        profile = SpeedProfile("tacho", "motor", "1/s", times, 10.0 + rng.uniform(0.2, 2.0) * times)
        recording = recording_of(clean(rng), RATE)
        settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, ())
        measured = measure_run(settings, RunSpeed((profile,)), survey_recording(recording, bands=False))
        assert not measured.steady
        (found,) = [v for v in measured.verdicts if v.verdict != "ok"]
        assert (found.channel, found.check) == ("tacho", "speed") and "not constant (limit 3 %)" in found.detail
        result = measured.channels[0]
        assert result.spectrum is None and result.lines == () and result.map is not None and result.usable
        assert not any(v.check == "mains hum" for v in measured.verdicts)  # no lines, so nothing was looked at


def test_a_standstill_is_averaged_and_named():
    rng = np.random.default_rng(1)
    profile = SpeedProfile("speed", "motor", "1/s", np.arange(160) * 0.05, 0.01 * rng.standard_normal(160))
    verdicts = verdicts_of(clean(rng), profiles=[profile])
    assert worst(verdicts) == "ok"
    assert any("stands still" in v.detail for v in verdicts)


def test_the_speed_is_held_against_the_stated_one():
    rng = np.random.default_rng(2)
    x, profile = clean(rng), constant_speed(rng)
    assert worst(verdicts_of(x, profiles=[profile], stated=[("motor", 25.5)])) == "ok"
    (found,) = [v for v in verdicts_of(x, profiles=[profile], stated=[("motor", 30.0)]) if v.verdict != "ok"]
    assert found.check == "speed" and "stated 1800 rpm" in found.detail
    (found,) = [v for v in verdicts_of(x) if v.verdict != "ok"]
    assert "not known" in found.detail
    assert worst(verdicts_of(x, stated=[("train", 20.0)])) == "ok"


def test_what_is_odd_about_a_log_is_a_warning_and_the_worst_word_wins():
    verdicts = verdicts_of(clean(np.random.default_rng(3)), stated=[("motor", 25.0)], flags=("no scale",))
    assert [(v.check, v.detail) for v in verdicts if v.verdict == "warning"] == [("log", "no scale")]
    assert worst([]) == "ok"
    assert worst(Verdict("", "", word, "") for word in ("warning", "bad", "ok")) == "bad"


def test_infinite_values_are_missing_values():
    x = clean(np.random.default_rng(4))
    x[1000], x[1001] = math.inf, -math.inf
    found = [v for v in verdicts_of(x, stated=[("motor", 25.0)]) if v.check == "missing values"]
    assert found[0].detail.startswith("2 of 65536 samples are no numbers")
