"""Frames, powers and spectra: exact for sines and in expectation for noise, equal to other programs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal, stats

from tdacoustic.errors import AnalysisError
from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames
from tdacoustic.spectra.frames import MAX_SEGMENTS, SEGMENT_BYTES

STORED = 2.0**-24
"""Relative rounding of a segment's density, which is kept as float32."""


def powers_of(x, rate, resolution=1.0, overlap=0.5, cuts=()):
    data = np.atleast_2d(x)
    meter = FramePowerMeter(plan_frames(rate, data.shape[1], resolution, overlap, len(data)), len(data))
    for piece in np.split(data, cuts, axis=1):
        meter.take(piece)
    return meter.result()


def spectrum_of(x, rate, resolution=1.0, overlap=0.5, quantity="sound_pressure"):
    return average_spectrum(powers_of(x, rate, resolution, overlap), 0, quantity, "Pa", "mic")


@pytest.mark.parametrize("rate", [51200.0, 44100.0, 65536.0])
def test_a_sine_on_a_line_has_its_rms_and_level(rate, conformance):
    t = np.arange(int(4 * rate)) / rate
    spectrum = spectrum_of(math.sqrt(2.0) * np.sin(2 * np.pi * 1000.0 * t + 0.7), rate)
    rms, at = spectrum.values("rms"), round(1000.0 / spectrum.resolution_hz)
    conformance(f"rms of a 1 Pa sine on a line at {rate:g} Hz", 1.0, rms[at], STORED, "Pa", "known input: sine of 1 Pa")
    conformance(
        f"level of a 1 Pa sine at {rate:g} Hz",
        93.9794,
        spectrum.levels_db("rms")[at],
        1e-4,
        "dB",
        "analytic: 20 lg(1 Pa / 20 uPa)",
    )
    assert np.max(np.delete(rms, [at - 1, at, at + 1])) < 1e-9
    assert rms[at - 1] == pytest.approx(0.5, rel=STORED)  # Hann: half of the amplitude one line beside


def test_doubling_a_pressure_adds_six_decibels():
    x = np.random.default_rng(1).standard_normal(20000)
    once, twice = (spectrum_of(k * x, 8192.0).levels_db("density") for k in (1.0, 2.0))
    assert np.allclose(twice - once, 20.0 * math.log10(2.0), atol=1e-9, rtol=0)


def test_the_density_of_white_noise_is_exact_in_expectation(conformance):
    rate, sigma = 8192.0, 3.0
    x = sigma * np.random.default_rng(2).standard_normal(int(60 * rate))
    spectrum = spectrum_of(x, rate)
    density = spectrum.density[2:-1]
    # The mean of n lines of a chi-squared estimate scatters by 1/sqrt(n averages); Hann correlates
    # neighbours, which is worth a factor 2 in n at most. Four standard deviations.
    tolerance = 4.0 * math.sqrt(2.0 / (density.size * spectrum.averages))
    expected = 2.0 * sigma**2 / rate
    conformance(
        "density of white noise over 2 sigma²/fs",
        1.0,
        density.mean() / expected,
        tolerance,
        "1",
        "analytic: white noise, 2 sigma² / fs",
    )
    freedom = 2.0 * spectrum.averages
    scaled = freedom * density / expected
    for tail in (0.05, 0.5, 0.95):  # the distribution of the lines is the chi-squared that the interval uses
        assert np.mean(scaled < stats.chi2.ppf(tail, freedom)) == pytest.approx(tail, abs=0.03)


def test_parseval(conformance):
    rate = 51200.0
    # One frame that is the whole record, so that Parseval holds without scatter: the window's own energy.
    x = np.random.default_rng(3).standard_normal(51200)
    x -= x.mean()
    spectrum = spectrum_of(x, rate, overlap=0.0)
    window = signal.windows.hann(51200, sym=False)
    expected = np.mean((window * x) ** 2) / np.mean(window**2)
    conformance(
        "mean square over all lines, one frame",
        expected,
        spectrum.mean_square(),
        STORED * expected,
        "Pa²",
        "law: Parseval's theorem",
    )
    long = np.random.default_rng(4).standard_normal(int(40 * rate))
    # 40 s of white noise: variance of a variance is 2/n; the frames' ends are weighted, hence the factor 5.
    conformance(
        "mean square of 40 s of noise over its variance",
        1.0,
        spectrum_of(long, rate).mean_square() / long.var(),
        5.0 * math.sqrt(2.0 / long.size),
        "1",
        "law: Parseval's theorem",
    )


def test_mean_square_between_two_frequencies_adds_up():
    spectrum = spectrum_of(np.random.default_rng(5).standard_normal(30000), 8192.0)
    total = spectrum.mean_square()
    parts = [spectrum.mean_square(a, b) for a, b in [(0.0, 17.3), (17.3, 1000.5), (1000.5, np.inf)]]
    assert sum(parts) == pytest.approx(total, rel=1e-12)  # rounding
    assert spectrum.mean_square(100.25, 100.75) == pytest.approx(
        0.25 * (spectrum.density[100] + spectrum.density[101]), rel=1e-12
    )


@pytest.mark.parametrize(("rate", "overlap"), [(51200.0, 0.5), (44100.0, 0.75), (8192.0, 0.0)])
def test_equal_to_welch_of_scipy(rate, overlap, conformance):
    x = np.random.default_rng(6).standard_normal(int(7.3 * rate)) + 5.0
    spectrum = spectrum_of(x, rate, overlap=overlap)
    plan = plan_frames(rate, x.size, 1.0, overlap)
    f, density = signal.welch(
        x, rate, "hann", plan.frame_length, plan.frame_length - plan.hop, detrend="constant", scaling="density"
    )
    assert np.allclose(spectrum.frequencies_hz, f, rtol=1e-12)
    largest = float(np.max(np.abs(spectrum.density[2:] / density[2:] - 1.0)))
    conformance(
        f"density against scipy.signal.welch at {rate:g} Hz, overlap {overlap:g}, largest relative distance",
        0.0,
        largest,
        1.1 * STORED,  # and double rounding of the smallest of 2e4 lines
        "1",
        "program: scipy.signal.welch",
    )
    assert np.allclose(spectrum.density[:2], density[:2], atol=1e-12 * density.max(), rtol=2 * STORED)


def test_equal_to_librosa(conformance):
    librosa = pytest.importorskip("librosa")
    rate = 8192.0
    x = np.random.default_rng(7).standard_normal(int(5 * rate))
    transform = librosa.stft(x, n_fft=8192, hop_length=4096, window="hann", center=False)
    window = signal.windows.hann(8192, sym=False)
    density = 2.0 * np.mean(np.abs(transform) ** 2, axis=1) / (rate * np.sum(window**2))
    ours = spectrum_of(x, rate).density
    # librosa does not take the mean off, which touches lines 0 and 1 alone.
    largest = float(np.max(np.abs(ours[2:-1] / density[2:-1] - 1.0)))
    conformance(
        "density against librosa.stft, largest relative distance",
        0.0,
        largest,
        1.1 * STORED,
        "1",
        "program: librosa.stft",
    )


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 5000), max_size=8).map(sorted), st.sampled_from([0.0, 0.3, 0.5, 0.9]))
def test_any_cut_into_blocks_gives_the_same_powers(cuts, overlap):
    x = np.random.default_rng(8).standard_normal((2, 5000)) + np.array([[0.0], [3.0]])
    whole, pieces = powers_of(x, 1000.0, overlap=overlap), powers_of(x, 1000.0, overlap=overlap, cuts=cuts)
    assert np.array_equal(whole.density, pieces.density)
    assert np.array_equal(whole.frames, pieces.frames)
    assert np.array_equal(whole.means, pieces.means)


def test_a_direct_component_does_no_harm():
    x = np.random.default_rng(9).standard_normal(40000)
    plain, shifted = spectrum_of(x, 8192.0).density, spectrum_of(x + 1e4, 8192.0).density
    # An offset of 1e4 times the rms costs four of the sixteen digits; the rest is the storing.
    assert np.allclose(shifted[2:], plain[2:], rtol=4 * STORED)
    assert np.allclose(shifted[:2], plain[:2], rtol=1e-5, atol=1e-7 * plain.mean())
    assert np.allclose(powers_of(x + 1e4, 8192.0).means, 1e4, atol=0.1)


@pytest.mark.parametrize("overlap", [0.0, 0.5, 0.67, 0.75])
@pytest.mark.parametrize("seconds", [5, 30])
def test_the_interval_covers_what_it_says(overlap, seconds, conformance):
    rate = 8192.0
    held = []
    for seed in range(4):
        spectrum = spectrum_of(np.random.default_rng(seed).standard_normal(int(seconds * rate)), rate, overlap=overlap)
        low, high = spectrum.interval(0.95)
        truth = 2.0 / rate / spectrum.density[2:-1]
        held.append(np.mean((truth >= low) & (truth <= high)))
    # 16 000 lines, of which some 5000 independent: scatter 0.3 %; chi-squared is an approximation where frames overlap.
    conformance(
        f"coverage of the 95 % interval, overlap {overlap:g}, {seconds} s",
        0.95,
        float(np.mean(held)),
        0.015,
        "1",
        "known input: white noise of known density",
    )


@pytest.mark.parametrize(("rate", "length"), [(51200.0, 51200), (44100.0, 44100), (65536.0, 65536), (48000.0, 48000)])
def test_usual_rates_give_the_line_spacing_asked_for(rate, length):
    plan = plan_frames(rate, int(10 * rate))
    assert (plan.frame_length, plan.resolution_hz) == (length, 1.0)
    assert plan.n_frames == 19


@pytest.mark.parametrize("rate", [51203.7, 10007.0, 12345.678, 999.983, 262144.1])
def test_odd_rates_give_a_quick_length_near_it(rate):
    plan = plan_frames(rate, int(20 * rate))
    assert plan.resolution_hz == pytest.approx(1.0, rel=0.02)
    rest = plan.frame_length
    assert rest % 2 == 0
    for prime in (2, 3, 5, 7):
        while rest % prime == 0:
            rest //= prime
    assert rest == 1


@given(st.integers(16, 5000), st.floats(0.0, 0.95), st.floats(0.1, 50.0))
def test_frames_lie_inside_the_record_and_segments_hold_them_all(n_samples, overlap, resolution):
    plan = plan_frames(1000.0, n_samples, resolution, overlap)
    assert 1 <= plan.n_segments <= min(plan.n_frames, MAX_SEGMENTS)
    assert (plan.n_frames - 1) * plan.hop + plan.frame_length <= n_samples
    assert plan.n_frames * plan.hop + plan.frame_length > n_samples  # no frame is forgone
    assert {plan.segment_of(frame) for frame in range(plan.n_frames)} == set(range(plan.n_segments))


def test_a_short_record_is_one_frame_and_says_so():
    plan = plan_frames(51200.0, 10001)
    assert (plan.n_frames, plan.frame_length) == (1, 10000)
    assert plan.resolution_hz == pytest.approx(5.12)
    with pytest.raises(AnalysisError, match="15 samples is too short"):
        plan_frames(51200.0, 15)
    with pytest.raises(AnalysisError, match=r"overlap must be in \[0, 1\), got 1"):
        plan_frames(51200.0, 1000, overlap=1.0)
    with pytest.raises(AnalysisError, match="resolution_hz must be > 0, got 0"):
        plan_frames(51200.0, 1000, resolution_hz=0.0)


def test_memory_does_not_grow_with_the_length_of_the_record():
    hour, day = (plan_frames(51200.0, int(seconds * 51200), n_channels=4) for seconds in (3600, 86400))
    assert hour.n_segments == day.n_segments
    for channels in (1, 16, 64):
        plan = plan_frames(51200.0, 10**10, n_channels=channels)
        size = 8 * channels * plan.n_segments * plan.n_frequencies
        assert size <= SEGMENT_BYTES or plan.n_segments == 8


def test_frames_with_missing_values_are_left_out_and_counted():
    rate = 1000.0
    x = np.random.default_rng(10).standard_normal((2, 10000))
    x[0, 4200], x[0, 9990] = np.nan, np.inf
    powers = powers_of(x, rate)
    # Frames start each 500 samples; 4200 lies in those from 3500 and 4000, 9990 in the one from 9000.
    assert powers.frames.sum(axis=1).tolist() == [16, 19]
    kept = [k for k in range(19) if k not in (7, 8, 18)]
    expected = np.mean([powers_of(x[:1, 500 * k : 500 * k + 1000], rate).density[0, 0] for k in kept], axis=0)
    assert np.allclose(average_spectrum(powers, 0, "sound_pressure", "Pa").density, expected, rtol=4 * STORED)
    assert average_spectrum(powers, 1, "sound_pressure", "Pa").averages > 9.0
    x[0, ::900] = np.nan
    with pytest.raises(AnalysisError, match="channel 'm': no frame without missing values"):
        average_spectrum(powers_of(x, rate), 0, "sound_pressure", "Pa", "m")


def test_segments_lie_in_order_over_the_record():
    powers = powers_of(np.zeros(200000), 1000.0)
    times = powers.segment_times_s
    assert times.size == powers.plan.n_segments == MAX_SEGMENTS
    assert np.all(np.diff(times) > 0) and 0.0 < times[0] < times[-1] < 200.0


def test_a_wrong_scaling_or_a_quantity_without_level_is_refused():
    spectrum = spectrum_of(np.ones(100), 100.0, quantity="torque")
    with pytest.raises(AnalysisError, match="scaling must be 'density' or 'rms', got 'peak'"):
        spectrum.values("peak")
    with pytest.raises(AnalysisError, match="torque has no level"):
        spectrum.levels_db()
