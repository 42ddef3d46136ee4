"""Bands beside far stronger lines: steady ones, and ones that travel."""

import math
from dataclasses import replace

import numpy as np
import pytest
from array_recording import recording_of

from tdacoustic.measured import MeasurementSettings, RunSpeed, survey_recording
from tdacoustic.measured.measurement_step import measure_run
from tdacoustic.measured.survey_step import RUN_UP_SEGMENTS
from tdacoustic.speed import SpeedProfile

RATE = 8192.0
T = np.arange(int(16 * RATE)) / RATE
RUN_UP = RunSpeed((SpeedProfile("tacho", "motor", "1/s", T[::400], 10.0 + 5.0 * T[::400]),))


def flagged(x, speed, resolution_hz):
    recording = recording_of(x, RATE)
    survey = survey_recording(recording, resolution_hz, max_segments=RUN_UP_SEGMENTS)
    settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, ())
    (result,) = measure_run(settings, speed, survey).channels
    return {band.nominal_hz for band in result.bands if band.filter_dependent}


def noise(rms, seed=1):
    return rms * np.random.default_rng(seed).standard_normal(T.size)


def line(phase_turns, rms=1.0):
    return math.sqrt(2.0) * rms * np.sin(2.0 * np.pi * phase_turns)


@pytest.mark.parametrize("frequency", [250.0, 1000.0])
def test_a_line_that_stands_still_in_a_run_up_flags_as_in_a_steady_run(frequency):
    x = line(frequency * T) + noise(1e-4)
    steady = flagged(x, RunSpeed(()), 1.0)
    assert len(steady) == 6
    assert flagged(x, RUN_UP, 8.0) == steady


def test_a_line_that_travels_flags_the_bands_it_never_reaches():
    # 500 to 884 Hz in 16 s: bands 500, 630 and 800 hold it in turn, three on each side never.
    x = line(500.0 * T + 12.0 * T**2) + noise(1e-4)
    assert flagged(x, RUN_UP, 8.0) == {250.0, 315.0, 400.0, 1000.0, 1250.0, 1600.0}


def test_a_band_that_the_line_crosses_for_a_moment_is_not_flagged():
    # A sweep over all bands: each holds the line for its share of the time, none is 15 dB below its neighbours.
    x = line(100.0 * T + 100.0 * T**2) + noise(1e-4)
    assert flagged(x, RUN_UP, 8.0) & {200.0, 250.0, 315.0, 400.0, 500.0, 630.0, 800.0, 1000.0, 1250.0, 1600.0} == set()


def test_a_passing_line_weighs_by_the_time_that_it_lasts():
    # 1 s of 16 with a line 20 dB over a band's noise: 8 dB over it in the mean, below the 15 dB asked for.
    band = 1000.0 * (10.0**0.05 - 10.0**-0.05)
    rms = math.sqrt(2.0 * band / RATE)
    short = np.where(T < 1.0, line(2000.0 * T, 10.0 * rms), 0.0) + noise(1.0)
    assert flagged(short, RUN_UP, 8.0) == set()
    long = line(2000.0 * T, 10.0 * rms) + noise(1.0)
    assert 1600.0 in flagged(long, RUN_UP, 8.0)


def test_noise_flags_nothing_however_steep():
    """Broadband noise that falls by 18 dB an octave has no line, whatever its neighbours' levels."""
    spectrum = np.fft.rfft(noise(1.0))
    frequency = np.fft.rfftfreq(T.size, 1.0 / RATE)
    steep = np.fft.irfft(spectrum * np.maximum(frequency, 20.0) ** -3.0)
    assert flagged(steep / np.std(steep), RUN_UP, 8.0) == set()
    assert flagged(noise(1.0), RUN_UP, 8.0) == set()


def test_a_channel_without_a_single_frame_flags_nothing():
    x = np.full(T.size, np.nan)
    recording = recording_of(np.stack([x, noise(1.0)]), RATE)
    survey = survey_recording(recording, 8.0)
    settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, ())
    bad, good = measure_run(replace(settings), RUN_UP, survey).channels
    assert bad.bands == () and len(good.bands) > 10
