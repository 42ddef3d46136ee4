"""An order cut out of a run-up: known amplitudes over the speed come back, with the floor off."""

import math

import numpy as np
import pytest
from array_recording import recording_of

from tdacoustic.measured import survey_recording
from tdacoustic.measured.order_cut import OrderCut, cut_order, level_at, segment_spans_s, speeds_of

RATE, SECONDS, ORDER = 8192.0, 20.0, 31.0
T = np.arange(round(SECONDS * RATE)) / RATE
SPEED = 10.0 + T  # turns per second, 10 to 30: the order runs from 310 to 930 Hz
PHASE = 2.0 * np.pi * np.cumsum(SPEED) / RATE


def order_signal(rms, order=ORDER):
    return np.sqrt(2.0) * rms * np.sin(order * PHASE)


def cut_of(x, order=ORDER, resolution_hz=8.0, seconds_shift=0.0):
    powers = survey_recording(recording_of(x, RATE), resolution_hz, bands=False, max_segments=256).rasters[0].powers
    start, end = segment_spans_s(powers.plan)
    instants = np.linspace(start, end, 17, axis=1) + seconds_shift
    turns = np.interp(instants, T, SPEED)
    return cut_order(powers.density[0], powers.frames[0], powers.plan.resolution_hz, order, turns)


def test_spans_of_segments_cover_their_frames():
    powers = survey_recording(recording_of(T[:50000] + np.sin(T[:50000]), RATE), 8.0, bands=False).rasters[0].powers
    start, end = segment_spans_s(powers.plan)
    assert start[0] == 0.0
    assert end[-1] == pytest.approx(50000 / RATE, abs=powers.plan.hop / RATE)
    # Neighbours share half a frame, at 50 % overlap.
    shared = end[:-1] - start[1:]
    assert shared == pytest.approx(0.5 * powers.plan.frame_length / RATE)
    assert powers.segment_times_s == pytest.approx(0.5 * (start + end))


@pytest.mark.parametrize("resolution_hz", [4.0, 8.0, 16.0])
def test_a_known_order_over_speed_comes_back(resolution_hz, conformance):
    """Level falls and rises by 10 dB over the speeds; white noise 14 to 34 dB below it in the band."""
    rms = 10.0 ** (0.05 * 10.0 * np.cos(2.0 * np.pi * (SPEED - 10.0) / 20.0))
    noise = 0.3 * np.random.default_rng(4).standard_normal(T.size)
    cut = cut_of(order_signal(rms) + noise, resolution_hz=resolution_hz)
    worst = 0.0
    for speed, reach in zip(*speeds_of(10.5, 29.5), strict=True):
        found = level_at(cut, speed, reach)
        inside = np.abs(SPEED - speed) <= reach
        true = float(np.mean(rms[inside] ** 2))
        assert found.stands_out and found.segments >= 3
        worst = max(worst, abs(10.0 * math.log10(found.mean_square / true)))
        assert found.speed_hz == pytest.approx(speed, abs=reach)
    # 1 dB per turn and second, segments of some 0.1 s that need not lie evenly in the reach.
    conformance(
        f"mesh order over a run-up, lines of {resolution_hz:g} Hz",
        0.0,
        worst,
        0.25,
        "dB",
        "known input: an order of known level in noise",
    )


def test_the_floor_is_taken_off():
    """A tone 8 dB over the floor of its band: without taking the floor off it would be 0.64 dB too high."""
    noise = np.random.default_rng(5).standard_normal(T.size)
    band_hz = 4.0 * 8.0 + 31.0 * 0.2  # guard, and some travel within a segment
    rms = math.sqrt(10.0**0.8 * 2.0 / RATE * band_hz)
    cut = cut_of(order_signal(rms) + noise)
    errors = []
    for speed, reach in zip(*speeds_of(10.5, 29.5), strict=True):
        found = level_at(cut, speed, reach)
        errors.append(10.0 * math.log10(found.mean_square / rms**2))
        assert found.stands_out
    assert abs(np.mean(errors)) < 0.25  # about 90 segments, each of some 8 degrees of freedom of noise beside the tone
    assert max(map(abs, errors)) < 1.5


def test_standard_errors_are_of_the_size_of_the_errors():
    """Over 20 seeds: the mean square of error over standard error is near one (few segments: up to 2)."""
    ratios = []
    for seed in range(20):
        noise = np.random.default_rng(seed).standard_normal(T.size)
        cut = cut_of(order_signal(0.35) + noise)
        for speed, reach in zip(*speeds_of(12.0, 28.0), strict=True):
            found = level_at(cut, speed, reach)
            ratios.append((found.mean_square - 0.35**2) / found.error)
    assert 0.8 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_noise_alone_does_not_stand_out():
    cut = cut_of(np.random.default_rng(6).standard_normal(T.size))
    found = [level_at(cut, speed, reach) for speed, reach in zip(*speeds_of(10.5, 29.5), strict=True)]
    assert not any(level.stands_out for level in found)


def test_another_order_is_not_taken_for_it():
    cut = cut_of(order_signal(1.0, order=20.0) + 0.01 * np.random.default_rng(7).standard_normal(T.size))
    found = [level_at(cut, speed, reach) for speed, reach in zip(*speeds_of(10.5, 29.5), strict=True)]
    assert not any(level.stands_out for level in found)


def test_a_speed_that_is_late_loses_the_order():
    """Two seconds off is 62 Hz off: the cut follows the speed that it is given, so this must fail."""
    cut = cut_of(order_signal(1.0) + 0.05 * np.random.default_rng(8).standard_normal(T.size), seconds_shift=2.0)
    found = [level_at(cut, speed, reach) for speed, reach in zip(*speeds_of(13.0, 29.5), strict=True)]
    assert not any(level is not None and level.mean_square > 0.5 for level in found)


def test_segments_out_of_reach_are_left_out():
    density, frames = np.ones((3, 65)), np.array([4, 0, 4])
    speeds = np.array([[10.0, 10.0], [10.0, 10.0], [70.0, 70.0]])  # 0.3 kHz, no frame, beyond the last line
    cut = cut_order(density, frames, 8.0, 31.0, speeds)
    assert np.isfinite(cut.mean_square).tolist() == [True, False, False]
    assert cut.mean_square[0] == pytest.approx(32.0)  # four lines of 8 Hz
    assert level_at(cut, 20.0, 0.5) is None
    unknown = cut_order(density, frames, 8.0, 31.0, np.full((3, 2), np.nan))
    assert not np.isfinite(unknown.mean_square).any()


def test_six_decibels_decide():
    def cut(mean_square):
        one = np.ones(1)
        return OrderCut(10.0 * one, 300.0 * one, 320.0 * one, mean_square * one, one)

    assert level_at(cut(4.0), 10.0, 0.1).stands_out
    assert not level_at(cut(3.9), 10.0, 0.1).stands_out
    assert level_at(cut(4.0), 10.0, 0.1).mean_square == pytest.approx(3.0)


def test_speeds_are_evenly_spread_and_never_shared():
    speeds, reach = speeds_of(5.0, 35.0)
    assert speeds.size == 10
    assert np.diff(speeds) == pytest.approx(3.0)
    assert np.all(reach <= 0.5 * np.diff(speeds)[0] + 1e-12)
    assert np.all(reach <= 0.03 * speeds + 1e-12)
    near, _ = speeds_of(30.0, 31.5)  # 5 %: two speeds, not ten that are one
    assert near.size == 2
    assert speeds_of(30.0, 30.1)[0].size == 1
