"""Cross spectra by blocks: against SciPy's, whatever the blocks' lengths; what is refused."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from array_recording import recording_of
from scipy import signal

from tdacoustic.contributions import CrossSpectrumMeter, measure_cross_spectra, plan_cross_spectra
from tdacoustic.errors import AnalysisError
from tdacoustic.recording import Recording
from tdacoustic.spectra import FramePowerMeter

RATE = 2048.0


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(3)
    sources = rng.standard_normal((3, 40000)) + 0.3
    return np.vstack((sources[0] + 0.3 * sources[1], sources[1], np.roll(sources[0], 7) + sources[2]))


def measured(data, sizes, **options):
    plan = plan_cross_spectra(RATE, data.shape[1], 2, 1, **options)
    meter = CrossSpectrumMeter(plan, ("a", "b"), ("mic",))
    start = 0
    while start < data.shape[1]:
        size = sizes[start % len(sizes)]
        meter.take(data[:, start : start + size])
        start += size
    return meter.result()


def test_they_are_scipys(data, conformance):
    found = measured(data, [8192]).mean()
    length = round(RATE / 4.0)
    rows = [0, 0, 1, 0, 1]
    columns = [0, 1, 1, 2, 2]
    # SciPy's csd is conj(X) Y, ours X conj(Y). It removes no mean from lines 0 and 1 exactly as here ("constant").
    worst = 0.0
    for i, j in zip(rows, columns, strict=True):
        _, theirs = signal.csd(data[j], data[i], RATE, "hann", length, detrend="constant")
        ours = found.s_xx[:, i, j] if j < 2 else found.s_xy[:, i, 0]
        worst = max(worst, float(np.max(np.abs(ours - theirs)) / np.max(np.abs(theirs))))
    # complex64 keeps seven digits
    conformance("cross spectral densities, worst line", 0.0, worst, 1e-6, "of the largest", "program: scipy.signal.csd")
    _, theirs = signal.welch(data[2], RATE, "hann", length, detrend="constant")
    np.testing.assert_allclose(found.s_yy[:, 0], theirs, rtol=1e-6)


def test_blocks_of_any_length_give_the_same(data):
    once, pieces = measured(data, [40000]), measured(data, [1, 17, 600, 3000])
    np.testing.assert_array_equal(once.frames, pieces.frames)
    np.testing.assert_allclose(once.density, pieces.density, rtol=1e-5, atol=1e-9)


def test_own_densities_are_those_of_the_power_meter(data):
    found = measured(data, [8192])
    meter = FramePowerMeter(found.plan.frames, 3)
    meter.take(data)
    powers = meter.result()
    np.testing.assert_allclose(np.moveaxis(found.density[:, 0, 0].real, 0, 0), powers.density[0], rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(found.receiver_density[:, 0], powers.density[2], rtol=1e-5, atol=1e-12)


def test_lines_above_the_limit_are_dropped_and_segments_can_be_chosen(data):
    found = measured(data, [8192], max_frequency_hz=500.0)
    assert found.frequencies_hz[-1] == 500.0
    whole = measured(data, [8192])
    np.testing.assert_allclose(found.density, whole.density[..., : found.density.shape[-1]])
    first = found.select(np.arange(found.plan.frames.n_segments) < 4)
    assert first.frames.sum() == found.frames[:4].sum()
    assert first.averages < found.averages
    with pytest.raises(AnalysisError, match="none of the chosen segments"):
        found.select(np.zeros(found.plan.frames.n_segments, dtype=bool))


def test_missing_values_take_their_frames_from_all_channels(data):
    holed = data.copy()
    holed[1, 5000:5003] = np.nan
    found = measured(holed, [8192])
    assert dict(found.frames_lost) == {"b": 2}  # frames overlap by half
    assert found.frames.sum() == found.plan.frames.n_frames - 2
    assert np.isfinite(found.mean().s_xx).all()
    holed[2] = np.nan
    with pytest.raises(AnalysisError, match=r"without missing values: 'b' \(2 frames\), 'mic'"):
        measured(holed, [8192])


def test_a_constant_channel_is_named(data):
    still = data.copy()
    still[0] = 4.2
    assert measured(still, [8192]).dead == ("a",)


def test_memory_does_not_grow_with_the_record():
    def peak(seconds):
        plan = plan_cross_spectra(RATE, int(seconds * RATE), 4, 1, max_segments=16)
        block = np.random.default_rng(0).standard_normal((5, 4096))
        tracemalloc.start()
        meter = CrossSpectrumMeter(plan, tuple("abcd"), ("mic",))
        for _ in range(int(seconds * RATE) // 4096):
            meter.take(block)
        meter.result()
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    assert peak(200.0) < 1.1 * peak(20.0)


def test_memory_bounds_the_segments():
    plan = plan_cross_spectra(51200.0, 51200 * 600, 12, 4, resolution_hz=1.0, max_frequency_hz=10000.0)
    assert 8 <= plan.frames.n_segments < 64
    assert plan.segment_bytes * plan.frames.n_segments <= 256 * 2**20
    with pytest.raises(AnalysisError, match="take a lower max_frequency_hz"):
        plan_cross_spectra(51200.0, 51200 * 600, 30, 10, resolution_hz=0.5)


def test_other_rasters_are_refused_with_the_reason(data):
    recording = recording_of(data, RATE)
    found = measure_cross_spectra(recording, ["c0", "c1"], ["c2"])
    np.testing.assert_allclose(found.density, measured(data, [8192]).density, rtol=1e-5, atol=1e-9)
    slow = replace(recording["c2"], sample_rate_hz=1024.0)
    mixed = Recording("run 3", recording.logs, (recording["c0"], recording["c1"], slow))
    with pytest.raises(AnalysisError, match=r"'c0' and 'c2' of run 3 differ \(sampling rate 2048 and 1024\)"):
        measure_cross_spectra(mixed, ["c0", "c1"], ["c2"])
    short = Recording("run 3", recording.logs, (recording["c0"], replace(recording["c2"], n_samples=30000)))
    with pytest.raises(AnalysisError, match="number of samples 40000 and 30000"):
        measure_cross_spectra(short, ["c0"], ["c2"])
    elsewhere = Recording("run 3", recording.logs * 2, (recording["c0"], replace(recording["c2"], log_index=1)))
    with pytest.raises(AnalysisError, match=r"log 1 and 2.*one clock"):
        measure_cross_spectra(elsewhere, ["c0"], ["c2"])


def test_what_cannot_be_is_refused(data):
    with pytest.raises(AnalysisError, match=r"takes? a reference and a receiver"):
        plan_cross_spectra(RATE, 40000, 0, 1)
    plan = plan_cross_spectra(RATE, 40000, 2, 1)
    with pytest.raises(AnalysisError, match="'a' is named twice"):
        CrossSpectrumMeter(plan, ("a", "b"), ("a",))
    with pytest.raises(AnalysisError, match="a block of 3 channels is due"):
        CrossSpectrumMeter(plan, ("a", "b"), ("mic",)).take(data[:2])
    with pytest.raises(AnalysisError, match="fewer samples than one frame"):
        CrossSpectrumMeter(plan, ("a", "b"), ("mic",)).result()
