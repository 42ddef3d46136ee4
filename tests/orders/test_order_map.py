"""Maps over order and frequency: levels, resolution, floors, rows, and memory."""

import numpy as np
import pytest
import scipy.signal
from made_up_run_ups import RunUp, db

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import (
    AngleResampler,
    EachFrame,
    EvenTime,
    Frames,
    MapMeter,
    SpeedRows,
    TimeRows,
    plan_line_frames,
)
from tdacoustic.speed import ShaftAngle

PUT_IN = "known input: orders of known level and phase over a made-up run-up"

RUN = RunUp(10.0, 50.0, 20.0)


def order_map(run, samples, rows, highest=40.0, resolution=0.1, window="hann", block=4001, angle=None):
    samples = np.atleast_2d(samples)
    resampler = AngleResampler(angle or ShaftAngle(*run.nodes()), run.rate_hz, highest)
    plan = plan_line_frames(resampler.samples_per_turn, resolution, window)
    meter = MapMeter(plan, rows, len(samples), "order", highest, run.rate_hz)
    frames = Frames(plan, [meter])
    for start in range(0, samples.shape[1], block):
        frames.take(resampler.take(samples[:, start : start + block]))
    return meter.result()


def frequency_map(run, samples, rows, resolution=4.0):
    samples = np.atleast_2d(samples)
    plan = plan_line_frames(run.rate_hz, resolution)
    meter = MapMeter(plan, rows, len(samples), "frequency", 3000.0, run.rate_hz)
    Frames(plan, [meter]).take(EvenTime(ShaftAngle(*run.nodes()), run.rate_hz).take(samples))
    return meter.result()


@pytest.mark.parametrize("rows", [EachFrame(), SpeedRows.even(10.0, 50.0, 20), TimeRows(0.0, 1.0, 20)])
def test_a_line_reads_its_rms_at_each_speed(rows, conformance):
    found = order_map(RUN, RUN.order(12.0, rms=0.3), rows)
    assert found.resolution == 0.1 and found.frames.requested_resolution == 0.1
    level = np.sqrt(found.mean_square[0, :, 120])
    conformance(f"rms of an order on a line, {type(rows).__name__}", 0.3, float(level[np.argmax(np.abs(level - 0.3))]),
                0.0003, "1", PUT_IN)  # fmt: skip
    assert np.allclose(found.band(11.8, 12.2)[0], 0.09, rtol=2e-3)


def test_between_two_lines_hann_falls_by_its_scalloping_and_flat_top_does_not(conformance):
    samples = RUN.order(12.05)
    hann = order_map(RUN, samples, EachFrame())
    flat = order_map(RUN, samples, EachFrame(), window="flattop")
    # Hann half a line beside its middle: sinc(1/2) / (1 - 1/4) = 8 / (3 pi).
    expected, level = db(8.0 / (3.0 * np.pi)), float(db(np.sqrt(hann.mean_square[0, :, 120].mean())))
    conformance(
        "Hann between two lines", expected, level, 0.01, "dB", "analytic: Hann window half a line beside, 8 / (3 pi)"
    )
    conformance("flat-top between two lines", 0.0, float(db(np.sqrt(flat.mean_square[0, :, 120].mean()))), 0.02, "dB",
                PUT_IN)  # fmt: skip
    assert np.allclose(hann.band(11.8, 12.3), 1.0, rtol=0.01)
    for name, frames in (("hann", hann.frames), ("flattop", flat.frames)):
        window = scipy.signal.get_window(name, 4096)
        lines = 4096 * float(np.sum(window**2) / np.sum(window) ** 2)
        what = f"noise bandwidth of the window {name}"
        conformance(what, lines, frames.noise_lines, 1e-6, "lines", "program: scipy.signal.get_window")


def test_white_noise_has_its_density_over_orders():
    density = 1e-4
    found = order_map(RUN, RUN.noise(density), SpeedRows.even(10.0, 50.0, 5))
    for row, speed in enumerate(found.speeds_hz):
        per_order = found.band(10.0, 30.0)[0, row] / 20.0
        # 200 lines of about 10 independent frames: 2 %; three times that.
        assert per_order == pytest.approx(density * speed, rel=0.06)
    lines = found.mean_square[0, :, 50:350]
    stated, seen = found.error[0, :, 50:350].mean(axis=1), lines.std(axis=1)
    assert np.allclose(stated, seen, rtol=0.25)


def test_the_same_noise_over_frequency_is_flat():
    found = frequency_map(RUN, RUN.noise(1e-4), SpeedRows.even(10.0, 50.0, 5))
    assert np.allclose(found.band(500.0, 2500.0)[0] / 2000.0, 1e-4, rtol=0.05)
    assert np.all(found.highest == 3000.0)  # as asked for, below 0.4 of the sampling rate


def test_a_tone_fixed_in_hz_stands_in_one_map_and_runs_in_the_other():
    tone = np.sqrt(2.0) * np.cos(2.0 * np.pi * 600.0 * RUN.times)
    over_frequency = frequency_map(RUN, tone, SpeedRows.even(10.0, 50.0, 8))
    over_order = order_map(RUN, tone, SpeedRows.even(10.0, 50.0, 8), highest=60.0)
    assert np.all(np.argmax(over_frequency.mean_square[0], axis=1) == 150)
    peaks = over_order.axis[np.argmax(over_order.mean_square[0], axis=1)]
    assert np.allclose(peaks * over_order.speeds_hz, 600.0, rtol=0.12)


def test_the_resolution_is_no_coarser_than_asked_for():
    plan = plan_line_frames(26.0, 0.37)
    assert plan.requested_resolution == 0.37 and plan.resolution <= 0.37 and plan.length % 2 == 0
    with pytest.raises(AnalysisError, match="resolution must be > 0 and at most a 16th of 26"):
        plan_line_frames(26.0, 3.0)
    with pytest.raises(AnalysisError, match=r"overlap must be in \[0, 1\), got 1"):
        plan_line_frames(26.0, 0.1, overlap=1.0)
    with pytest.raises(AnalysisError, match="window must be one of hann, flattop, got 'boxcar'"):
        plan_line_frames(26.0, 0.1, window="boxcar")


def test_several_shafts_share_a_recording():
    ratio = 31.0 / 104.0
    samples = RUN.order(5.0, rms=0.5) + RUN.order(7.0, rms=0.25, ratio=ratio)
    wheel = ShaftAngle(*RUN.nodes()).at_ratio(ratio, "wheelset")
    found = order_map(RUN, samples, SpeedRows.even(3.0, 15.0, 4), highest=20.0, resolution=0.2, angle=wheel)
    assert np.allclose(found.band(6.6, 7.4)[0], 0.0625, rtol=5e-3)
    assert np.allclose(found.band(5.0 / ratio - 0.4, 5.0 / ratio + 0.4)[0], 0.25, rtol=5e-3)


def test_frames_with_gaps_are_left_out_of_their_channel_alone():
    samples = np.vstack((RUN.order(12.0), RUN.order(12.0)))
    samples[1, 60000:60100] = np.nan
    found = order_map(RUN, samples, SpeedRows.even(10.0, 50.0, 10))
    assert np.all(found.n_frames[1] <= found.n_frames[0]) and found.n_frames[1].sum() < found.n_frames[0].sum()
    assert np.isfinite(found.mean_square[0]).all()
    assert np.array_equal(np.isnan(found.mean_square[1]).all(axis=1), found.n_frames[1] == 0)
    assert np.allclose(found.mean_square[1, found.n_frames[1] > 0, 120], 1.0, rtol=2e-3)


def test_memory_is_bounded_and_too_much_is_refused():
    plan = plan_line_frames(250.0, 0.01)
    with pytest.raises(AnalysisError, match=r"a map of 4096 rows, 8 channels and 10001 lines takes more than 512 MiB"):
        MapMeter(plan, EachFrame(), 8, "order", 100.0, 51200.0)


def test_a_record_outside_of_all_classes_is_refused():
    with pytest.raises(AnalysisError, match="no frame of 10 turns lies in the rows of the map"):
        order_map(RUN, RUN.order(3.0), SpeedRows.even(80.0, 90.0, 3))
    with pytest.raises(AnalysisError, match="edges of speed classes must increase"):
        SpeedRows((1.0, 1.0))


def test_the_highest_order_follows_the_speed():
    found = order_map(RUN, RUN.order(3.0), SpeedRows.even(10.0, 50.0, 8), highest=200.0, resolution=0.5)
    assert found.highest[0] == 200.0
    assert found.highest[-1] == pytest.approx(0.4 * 8192.0 / 50.0, rel=0.02)


def test_a_map_without_errors_is_the_same_map():
    plan, rows = plan_line_frames(100.0, 0.25), SpeedRows.even(10.0, 50.0, 5)
    meters = [MapMeter(plan, rows, 1, "order", 40.0, RUN.rate_hz, errors=errors) for errors in (True, False)]
    resampler = AngleResampler(ShaftAngle(*RUN.nodes()), RUN.rate_hz, 40.0, samples_per_turn=100)
    Frames(plan, meters).take(resampler.take(RUN.noise(1e-4)[None]))
    whole, bare = (meter.result() for meter in meters)
    assert np.array_equal(whole.mean_square, bare.mean_square) and np.isnan(bare.error).all()
    assert np.isfinite(whole.error).all() and bare.error.shape == whole.error.shape
