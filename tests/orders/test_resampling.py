"""Resampling over the angle: flat where orders are wanted, silent where they would alias, whatever the speed does."""

from itertools import pairwise

import numpy as np
import pytest
from made_up_run_ups import RunUp, db

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import AngleResampler
from tdacoustic.speed import ShaftAngle

PUT_IN = "known input: orders of known level and phase over a made-up run-up"

TENFOLD = RunUp(6.0, 60.0, 8.0, 51200.0)
"""The speed changes by 10:1; order 100 reaches 6 kHz."""


def resampled(run, samples, highest, **options):
    resampler = AngleResampler(ShaftAngle(*run.nodes()), run.rate_hz, highest, **options)
    return resampler, resampler.signal(np.atleast_2d(samples))


@pytest.mark.parametrize("order", [0.5, 10.0, 50.3, 99.9])
def test_wanted_orders_pass_flat_while_the_speed_rises_tenfold(order, conformance):
    resampler, signal = resampled(TENFOLD, TENFOLD.order(order), 100.0)
    assert resampler.samples_per_turn == 250
    envelope = signal.values[0] * np.exp(-2j * np.pi * order * signal.turns)
    # A moving mean over whole turns leaves the amplitude; at most 0.01 dB is promised.
    turns = 10 if order != int(order) else 1
    mean = np.convolve(envelope, np.ones(250 * turns) / (250 * turns), "valid") * np.sqrt(2.0)
    worst = db(mean)[np.argmax(np.abs(db(mean)))]
    conformance(f"resampled order {order:g} of 100, worst level in a 10:1 run-up", 0.0, worst, 0.01, "dB", PUT_IN)
    truth = np.sqrt(2.0) * np.cos(2.0 * np.pi * order * signal.turns)
    assert db(np.max(np.abs(signal.values[0] - truth))) < -75.0


@pytest.mark.parametrize("order", [150.5, 180.0, 249.0, 251.0, 333.0, 400.0])
def test_orders_beyond_are_removed_at_each_speed(order, conformance):
    run = TENFOLD
    _, signal = resampled(run, run.order(order), 100.0)  # order 400 reaches 24 kHz
    frames = np.lib.stride_tricks.sliding_window_view(signal.values[0], 2500)[::1250]
    window = np.blackman(2500)
    lines = np.abs(np.fft.rfft(frames * window)) * np.sqrt(2.0) / window.sum()
    wanted = lines[:, np.fft.rfftfreq(2500, 1.0 / 250.0) <= 100.0]
    conformance(
        f"alias of order {order:g} onto orders up to 100, 10:1 run-up", 0.0, wanted.max(), 1e-4, "of the order's rms",
        PUT_IN,
    )  # fmt: skip


def test_a_fixed_filter_would_alias_here():
    # The same signal taken at the same angles without a low-pass: what the test above must be able to see.
    run = TENFOLD
    angle = ShaftAngle(*run.nodes())
    turns = np.arange(100, 2000 * 100) / 250.0
    turns = turns[turns < angle.turns[-1]]
    bare = np.interp(angle.times_at(turns), run.times, run.order(249.0))
    lines = np.abs(np.fft.rfft(bare * np.hanning(bare.size))) / bare.size * 4.0
    assert lines[np.fft.rfftfreq(bare.size, 1.0 / 250.0) <= 100.0].max() > 0.3


def test_what_the_sampling_rate_does_not_hold_is_said():
    resampler, _ = resampled(TENFOLD, TENFOLD.order(10.0), 600.0)
    assert resampler.highest_order_at(np.array([10.0, 60.0])).tolist() == pytest.approx([600.0, 0.4 * 51200.0 / 60.0])


def test_blocks_of_any_size_give_what_the_whole_gives():
    run = RunUp(2.0, 40.0, 6.0, 8192.0)
    samples = np.vstack((run.order(7.0), run.noise(1e-3)))
    _, whole = resampled(run, samples, 40.0)
    resampler = AngleResampler(ShaftAngle(*run.nodes()), run.rate_hz, 40.0)
    rng, start, blocks = np.random.default_rng(2), 0, []
    while start < samples.shape[1]:
        size = int(rng.integers(1, 3000))
        blocks.append(resampler.take(samples[:, start : start + size]))
        start += size
    joined = np.concatenate([block.values for block in blocks], axis=1)
    assert np.array_equal(joined, whole.values)
    assert all(later.first == earlier.first + earlier.times_s.size for earlier, later in pairwise(blocks))


def test_from_standstill_and_from_before_the_angle_is_known():
    run = RunUp(0.0, 30.0, 10.0)
    edges = np.sqrt(2.0 * np.arange(1, 2900) / 20.0 / run.sweep)  # the first pulse 1/20 of a turn after the start
    angle = ShaftAngle.from_edges(edges, 20)
    signal = AngleResampler(angle, run.rate_hz, 20.0).signal(run.order(8.0)[None])
    truth = np.sqrt(2.0) * np.cos(2.0 * np.pi * 8.0 * (signal.turns + 1 / 20))
    assert signal.times_s[0] > edges[0] and signal.times_s[-1] <= edges[-1]
    # In the very first turns the speed doubles within a kernel, which is neglected: some 1e-3 there.
    assert np.max(np.abs(signal.values[0] - truth)[signal.turns > 3.0]) < 1e-4
    assert np.max(np.abs(signal.values[0] - truth)) < 0.02


def test_memory_does_not_grow_while_waiting_for_the_angle():
    angle = ShaftAngle([1000.0, 1001.0, 1002.0], [0.0, 20.0, 40.0])
    resampler = AngleResampler(angle, 8192.0, 10.0)
    for _ in range(200):
        assert resampler.take(np.zeros((1, 16384))).times_s.size == 0
    assert resampler._data.shape[1] < 20000


@pytest.mark.parametrize("size", [500, 3000, 8192, 20000])
def test_a_shaft_that_all_but_stops_gives_the_same_whatever_the_blocks_or_nothing(size):
    """Its kernels grow from one block to the next by more than is held: such a value is none, never a wrong one."""
    rate = 8192.0
    nodes = np.concatenate((np.arange(0.0, 5.0, 0.05), np.arange(5.0, 12.0, 0.05)))
    speed = np.where(nodes < 5.0, 20.0, np.maximum(20.0 * np.exp(-(nodes - 5.0) / 0.3), 0.02))
    turns = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(nodes))))
    samples = np.random.default_rng(4).standard_normal((1, int(12.0 * rate)))

    def read(block):
        return AngleResampler(ShaftAngle(nodes, turns), rate, 10.0).signal(samples, block)

    whole, cut = read(samples.shape[1]), read(size)
    known = np.isfinite(cut.values[0])
    assert np.max(np.abs(cut.values[0][known] - whole.values[0][known])) < 1e-6  # places are rounded in each block anew
    assert known[cut.times_s < 5.0].all()


def test_a_record_without_common_time_is_refused():
    angle = ShaftAngle([100.0, 101.0, 102.0], [0.0, 20.0, 40.0], "motor")
    with pytest.raises(
        AnalysisError, match=r"angle of motor is known from 100.000 s to 102.000 s.*nothing to resample"
    ):
        AngleResampler(angle, 1000.0, 5.0).signal(np.zeros((1, 5000)))


def test_the_recordings_own_time_axis_counts():
    run = RunUp(10.0, 20.0, 4.0)
    nodes, turns = run.nodes()
    angle = ShaftAngle(nodes + 7.0, turns)
    signal = AngleResampler(angle, run.rate_hz, 10.0, start_s=7.0).signal(run.order(3.0)[None])
    assert np.max(np.abs(signal.values[0] - np.sqrt(2.0) * np.cos(6.0 * np.pi * signal.turns))) < 1e-4
    assert signal.times_s[0] > 7.0


def test_samples_that_are_no_numbers_stay_where_they_are():
    run = RunUp(10.0, 20.0, 4.0)
    samples = run.order(3.0)
    samples[10000] = np.nan
    _, signal = resampled(run, samples, 10.0)
    lost = np.isnan(signal.values[0])
    assert lost.any() and np.all(np.abs(signal.times_s[lost] - 10000 / run.rate_hz) < 0.12)


def test_breaks_and_too_coarse_steps_are_refused():
    broken = ShaftAngle.from_edges(np.concatenate((np.arange(50) * 0.1, 20.0 + np.arange(50) * 0.1)), 1)
    with pytest.raises(AnalysisError, match=r"not known from 4.900 s to 20.000 s; resample its stretches"):
        AngleResampler(broken, 1000.0, 5.0)
    with pytest.raises(AnalysisError, match="20 samples per turn are too few for order 10; it takes 26"):
        AngleResampler(ShaftAngle([0, 1, 2], [0, 1, 2]), 1000.0, 10.0, samples_per_turn=20)
    with pytest.raises(AnalysisError, match="highest_order must be > 0, got -1"):
        AngleResampler(ShaftAngle([0, 1, 2], [0, 1, 2]), 1000.0, -1.0)
