"""The reading of a calibrator's tone against signals whose level is known by their formula."""

import math

import numpy as np
import pytest

from tdacoustic.sensors.plateaus import find_stretches
from tdacoustic.sensors.reading import read_plateau
from tdacoustic.sensors.tone_track import ToneTrackMeter

RATE = 48000.0
WANTED = (1000.0, 250.0)


def times(seconds, rate=RATE):
    return np.arange(round(seconds * rate)) / rate


def tone(seconds=20.0, hz=1000.0, rms=1.0, on=((3.0, 15.0),), noise=1e-4, thump=3.0, rate=RATE, seed=0):
    """A tone put on and taken off, a thump of the hand at both, and noise."""
    t = times(seconds, rate)
    signal = noise * np.random.default_rng(seed).standard_normal(t.size)
    for first, last in on:
        signal += math.sqrt(2) * rms * np.sin(2 * np.pi * hz * t + 0.7) * ((t >= first) & (t < last))
        for instant in (first, last):
            signal += thump * rms * np.exp(-(((t - instant) / 0.1) ** 2)) * np.sin(2 * np.pi * 17.0 * t)
    return signal


def read(signal, wanted=WANTED, rate=RATE, limits=None, block=70_001):
    meter = ToneTrackMeter(rate, wanted)
    for first in range(0, signal.size, block):
        meter.take(signal[first : first + block])
    stretches, stood_out_s = find_stretches(meter.result())
    plateaus = []
    for item in stretches:
        part = signal[round(item.start_s * rate) : round(item.end_s * rate)]
        span_s = (item.start_s, item.end_s)
        plateaus.append(read_plateau(part, rate, item.frequency_hz, span_s, item.wander_db, limits))
    return plateaus, stood_out_s


def level_error_db(plateau, rms=1.0):
    return 20.0 * math.log10(plateau.rms / rms)


@pytest.mark.parametrize(
    ("hz", "noise", "rate", "tolerance_db"),
    [
        (1000.0, 1e-4, 48000.0, 0.001),
        (1003.37, 1e-4, 51200.0, 0.001),  # between the lines of any frame
        (250.12, 1e-4, 25600.0, 0.001),
        (159.155, 1e-4, 8192.0, 0.001),
        (79.577, 1e-4, 4096.0, 0.002),
        (15.9155, 1e-4, 4096.0, 0.01),  # four periods in a frame: its image at negative frequencies reaches in
        (1000.0, 0.3, 48000.0, 0.02),  # noise 10 dB below the tone, which a wide band would read 0.4 dB too high
    ],
)
def test_level_and_frequency_of_a_sine(hz, noise, rate, tolerance_db, conformance):
    (plateau,), _ = read(tone(hz=hz, noise=noise, rate=rate, thump=0.0), (hz,), rate)
    what, source = f"calibrator's tone of {hz:g} Hz in noise of {noise:g} of it", "known input: a sine in white noise"
    conformance(f"level of a {what}", 0.0, level_error_db(plateau), tolerance_db, "dB", source)
    conformance(f"frequency of a {what}", hz, plateau.frequency_hz, 2e-5 * hz, "Hz", source)
    assert plateau.residue_db == pytest.approx(20 * math.log10(noise), abs=1.5) or noise < 1e-3


def test_it_is_found_where_it_was_on_and_the_thumps_are_left_out():
    (plateau,), _ = read(tone(on=((3.0, 15.0),), thump=10.0))
    assert 3.0 <= plateau.start_s <= 3.6 and 14.4 <= plateau.end_s <= 15.0
    assert abs(level_error_db(plateau)) < 0.005
    assert plateau.steadiness_db < 0.02


def test_whatever_the_blocks_the_reading_is_the_same():
    signal = tone()
    assert read(signal, block=1000) == read(signal, block=10**9)


def test_too_short_is_not_read_but_heard():
    plateaus, stood_out_s = read(tone(on=((3.0, 4.6),)))
    assert plateaus == [] and 1.0 < stood_out_s < 2.0


def test_no_tone_at_all():
    assert read(np.random.default_rng(1).standard_normal(480_000)) == ([], pytest.approx(0.0, abs=0.3))
    assert read(np.zeros(480_000)) == ([], 0.0)
    assert read(np.zeros(10)) == ([], 0.0)


def test_missing_samples_end_a_stretch():
    signal = tone(on=((3.0, 15.0),), thump=0.0)
    signal[round(9.0 * RATE)] = np.nan
    first, second = read(signal)[0]
    assert first.end_s <= 9.0 <= second.start_s
    assert max(abs(level_error_db(item)) for item in (first, second)) < 0.001


def test_put_on_twice_and_two_settings():
    twice = tone(on=((2.0, 6.0), (10.0, 16.0)))
    assert [round(item.duration_s) for item in read(twice)[0]] == [4, 6]
    t = times(20.0)
    switched = tone(on=((3.0, 15.0),), thump=0.0) * np.where(t > 9.0, 10.0, 1.0)  # 94 then 114 dB, in one go
    low, high = read(switched)[0]
    assert level_error_db(high) - level_error_db(low) == pytest.approx(20.0, abs=0.002)


def test_a_loose_calibrator_wanders():
    t = times(20.0)
    signal = tone(on=((1.0, 19.0),), thump=0.0) * 10 ** (0.03 * np.clip(t - 12.0, 0.0, None) / 20)  # 0.2 dB at the end
    assert read(signal)[0][0].wander_db == 0.0
    signal = tone(on=((1.0, 19.0),), thump=0.0) * np.where(t > 12.0, 10 ** (0.4 / 20), 1.0)
    (plateau,) = read(signal)[0]
    assert plateau.wander_db == pytest.approx(0.4, abs=0.02)


def test_a_calibrator_whose_frequency_drifts_loses_no_level():
    t = times(20.0)
    signal = np.sqrt(2) * np.sin(2 * np.pi * (1000.0 * t + 0.1 * np.sin(2 * np.pi * 0.1 * t)))
    (plateau,) = read(signal)[0]
    assert abs(level_error_db(plateau)) < 0.001


def test_a_tone_elsewhere_counts_only_where_no_wanted_one_is():
    t = times(20.0)
    hum = 0.01 * np.sin(2 * np.pi * 50.0 * t)
    (plateau,) = read(hum)[0]
    assert plateau.frequency_hz == pytest.approx(50.0, abs=0.01)
    (plateau,) = read(hum + tone(thump=0.0))[0]
    assert plateau.frequency_hz == pytest.approx(1000.0, abs=0.01)


def test_clipping_is_seen_with_and_without_limits():
    signal = tone(noise=0.0, thump=0.0)
    assert not read(signal)[0][0].clipped
    clipped = np.clip(signal, -1.2, 1.2)  # of 1.41
    assert read(clipped)[0][0].clipped
    assert read(signal, limits=(-1.40, 1.40))[0][0].clipped
    coarse = np.round(200 * signal)  # crests of whole numbers are flat too
    assert not read(coarse)[0][0].clipped


def test_distortion_is_that_of_the_harmonics(conformance):
    t = times(20.0)
    signal = np.sin(2 * np.pi * 1000.0 * t) + 0.05 * np.sin(2 * np.pi * 3000.0 * t)
    (plateau,) = read(signal)[0]
    conformance(
        "distortion of a calibrator's tone",
        0.05,
        plateau.distortion,
        0.0005,
        "1",
        "known input: a sine and 5 % of its third harmonic",
    )
    assert abs(level_error_db(plateau, math.sqrt(0.5))) < 0.001
