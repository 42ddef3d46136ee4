"""Cuts along orders: level and phase over sweep rates, floor, error, and the reasons beside doubtful values."""

import numpy as np
import pytest
from made_up_run_ups import RunUp, db

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import AngleResampler, CutMeter, EachFrame, Frames, Neighbour, SpeedRows, plan_line_frames
from tdacoustic.speed import ShaftAngle

PUT_IN = "known input: orders of known level and phase over a made-up run-up"

RUN = RunUp(10.0, 40.0, 30.0)


def cut(run, samples, orders, rows=None, highest=40.0, resolution=0.1, **options):
    samples = np.atleast_2d(samples)
    resampler = AngleResampler(ShaftAngle(*run.nodes()), run.rate_hz, highest)
    plan = plan_line_frames(resampler.samples_per_turn, resolution)
    rows = rows or SpeedRows.even(run.first_hz, run.last_hz, 6)
    meter = CutMeter(plan, orders, rows, len(samples), run.rate_hz, **options)
    frames = Frames(plan, [meter])
    for start in range(0, samples.shape[1], 50000):
        frames.take(resampler.take(samples[:, start : start + 50000]))
    return meter.result()


@pytest.mark.parametrize("duration_s", [100.0, 30.0, 10.0])
def test_level_and_phase_of_orders_on_and_between_lines(duration_s, conformance):
    run = RunUp(10.0, 40.0, duration_s)
    samples = run.order(6.0, 1.0, 0.5) + run.order(13.37, 0.2, -1.2) + run.order(31.0, 0.05, 2.0) + run.noise(1e-8)
    for order, rms, phase, found in zip(
        (6.0, 13.37, 31.0), (1.0, 0.2, 0.05), (0.5, -1.2, 2.0), cut(run, samples, [6.0, 13.37, 31.0]), strict=True
    ):
        level = db(np.sqrt(found.line_mean_square) / rms)
        angle = np.degrees(np.angle(found.amplitude * np.exp(-1j * phase)))
        worst = float(level[np.argmax(np.abs(level))])
        # A Hann window's main lobe holds 99.95 % of a line on a line and 99.9 % half beside: -0.005 dB.
        conformance(f"cut of order {order:g}, sweep {run.sweep:g} Hz/s, level", 0.0, worst, 0.05, "dB", PUT_IN)
        conformance(f"cut of order {order:g}, sweep {run.sweep:g} Hz/s, phase", 0.0,
                    float(angle[np.argmax(np.abs(angle))]), 0.5, "degree", PUT_IN)  # fmt: skip
        assert all(reason == "" for reason in found.reasons) and found.stands_out.all()
        assert np.all(found.steadiness > 0.999)


def test_the_floor_is_what_the_noise_has_in_the_band_and_comes_off():
    density = 2e-5
    (found,) = cut(RUN, RUN.order(10.0, 0.1) + RUN.noise(density), [10.0], bandwidth=1.0)
    in_band = density * found.speeds_hz * 1.0
    # 20 lines beside, some 10 independent frames: the median knows it by 10 %.
    assert np.allclose(found.floor, in_band, rtol=0.3)
    assert np.allclose(found.line_mean_square, 0.01, rtol=0.1)
    assert found.bandwidth == found.requested_bandwidth == 1.0


def test_ten_db_below_the_floor_an_order_does_not_stand_out_but_its_phase_average_does(conformance):
    # 0.4 orders wide: the order lies 10 dB below the floor in its band at 25 Hz.
    run = RunUp(20.0, 30.0, 240.0, 2048.0)
    density = 1e-3
    rms = np.sqrt(0.1 * density * 25.0 * 0.4)
    (found,) = cut(run, run.order(8.0, rms, 0.7) + run.noise(density), [8.0], SpeedRows((20.0, 30.0)), 20.0)
    assert not found.stands_out[0] and found.reasons == ("less than 6 dB above the floor",)
    # 600 frames of 10 turns: 27 dB less scatter, so 17 dB above; 1.2 dB and 8 degrees are one sigma.
    note = "two and a half times the scatter of one record"
    level = float(db(abs(found.amplitude[0]) / rms))
    conformance("order 10 dB below the floor of its band, mean amplitude", 0.0, level, 3.0, "dB", PUT_IN, note)
    apart = np.degrees(np.angle(found.amplitude[0] * np.exp(-0.7j)))
    assert abs(apart) < 3.0 * np.degrees(found.phase_error_rad[0]) and np.degrees(found.phase_error_rad[0]) < 15.0


def test_stated_errors_cover_the_truth_over_many_seeds():
    ratios, phases = [], []
    run = RunUp(20.0, 24.0, 12.0, 2048.0)
    for seed in range(40):
        samples = run.order(8.0, 0.1, 0.3) + run.noise(1e-4, seed)
        (found,) = cut(run, samples, [8.0], SpeedRows((20.0, 24.0)), 20.0)
        ratios.append((found.line_mean_square[0] - 0.01) / found.error[0])
        phases.append(np.angle(found.amplitude[0] * np.exp(-0.3j)) / found.phase_error_rad[0])
    assert 0.6 < np.std(ratios) < 1.5 and 0.6 < np.std(phases) < 1.5
    assert abs(np.mean(phases)) < 0.5


def test_phase_against_a_reference_channel_and_against_the_angle():
    wander = lambda times: 2.0 * np.sin(0.9 * times)  # noqa: E731 - common to both channels
    near, far = RUN.order(8.0, 1.0, wander), RUN.order(8.0, 0.5, lambda times: wander(times) - 0.8)
    samples = np.vstack((near, far))
    by_reference = cut(RUN, samples, [8.0], SpeedRows((10.0, 40.0)), reference=0)[1]
    assert np.angle(by_reference.amplitude[0]) == pytest.approx(-0.8, abs=0.02)
    assert abs(by_reference.amplitude[0]) == pytest.approx(0.5, rel=0.01) and by_reference.steadiness[0] > 0.99
    by_angle = cut(RUN, samples, [8.0], SpeedRows((10.0, 40.0)))[1]
    assert by_angle.reasons == ("unsteady phase",) and by_angle.steadiness[0] < 0.5


def test_beyond_what_the_rate_holds_there_is_no_value_but_a_reason():
    run = RunUp(10.0, 60.0, 20.0)  # order 100 passes 0.4 of 8192 Hz at 32.8 Hz
    (found,) = cut(run, run.order(30.0), [100.0], SpeedRows.even(10.0, 60.0, 5), highest=120.0)
    missing = np.isnan(found.mean_square)
    assert missing.tolist() == [False, False, True, True, True]
    for row, reason in enumerate(found.reasons):
        assert ("no value: beyond order" in reason) == missing[row]
        assert np.isnan(found.amplitude[row]) == missing[row]


def test_narrower_than_the_resolution_is_widened_and_said():
    (found,) = cut(RUN, RUN.order(8.0), [8.0], bandwidth=0.1)
    assert (found.requested_bandwidth, found.bandwidth) == (0.1, pytest.approx(0.4))
    assert all(reason == "bandwidth 0.1 is below the resolution: 0.4 orders taken" for reason in found.reasons)
    assert np.allclose(found.mean_square, 1.0, rtol=0.01)


def test_a_crossing_order_of_another_shaft_is_named_where_it_crosses():
    other = RunUp(40.0, 10.0, 30.0)  # slows down; its order 8 meets ours in the middle
    samples = RUN.order(8.0) + other.order(8.0)
    neighbour = Neighbour(ShaftAngle(*other.nodes()), 8.0, "fan order 8")
    (found,) = cut(RUN, samples, [8.0], SpeedRows.even(10.0, 40.0, 15), neighbours=[neighbour])
    crossed = [("fan order 8" in reason) for reason in found.reasons]
    assert 1 <= sum(crossed) <= 3 and crossed[7]
    wrong = np.abs(db(np.sqrt(found.mean_square))) > 0.5
    assert all(crossed[row] for row in np.flatnonzero(wrong)) and wrong.any()


def test_an_order_too_near_its_neighbour_or_zero_is_said():
    near = cut(RUN, RUN.order(8.0) + RUN.order(8.3), [8.0, 8.3])
    assert all("order 8.3 within the band" in reason for reason in near[0].reasons)
    (low,) = cut(RUN, RUN.order(8.0), [0.2])
    assert np.isnan(low.mean_square).all()
    assert all("no value: the band leaves the lines" in reason for reason in low.reasons)


def test_a_channel_of_gaps_has_reasons():
    samples = np.vstack((RUN.order(8.0), np.full(RUN.times.size, np.nan)))
    good, bad = cut(RUN, samples, [8.0])
    assert all(reason == "" for reason in good.reasons)
    assert np.isnan(bad.mean_square).all() and all("no frame without gaps" in reason for reason in bad.reasons)


def test_each_frame_alone_has_an_error_too():
    (found,) = cut(RUN, RUN.order(8.0) + RUN.noise(1e-4), [8.0], EachFrame())
    assert np.isfinite(found.error).all() and np.all(found.n_frames == 1)
    ratio = (found.mean_square - found.floor - 1.0) / found.error
    assert 0.4 < np.std(ratio) < 2.0


def test_wrong_settings_are_refused():
    plan = plan_line_frames(100.0, 0.1)
    with pytest.raises(AnalysisError, match=r"orders must be > 0, got \[0.0\]"):
        CutMeter(plan, [0.0], EachFrame(), 1, 1000.0)
    with pytest.raises(AnalysisError, match="the reference must be one of 2 channels, got 2"):
        CutMeter(plan, [1.0], EachFrame(), 2, 1000.0, reference=2)
    with pytest.raises(AnalysisError, match="bandwidth of a cut must be > 0"):
        CutMeter(plan, [1.0], EachFrame(), 2, 1000.0, bandwidth=0.0)
