"""Lines that stay in Hz: found in a map over frequency, told from noise, and where they hide an order."""

import numpy as np
import pytest
from made_up_run_ups import RunUp, db
from scipy import signal

from tdacoustic.orders import EvenTime, Frames, MapMeter, OrderCut, SpeedRows, plan_line_frames
from tdacoustic.orders.fixed_lines import find_fixed_lines
from tdacoustic.speed import ShaftAngle

RUN = RunUp(10.0, 40.0, 60.0, 4096.0)
B_RMS = 0.5


def lines_of(samples, cuts=(), resolution_hz=4.0):
    plan = plan_line_frames(RUN.rate_hz, resolution_hz, overlap=0.5)
    meter = MapMeter(plan, SpeedRows.even(10.0, 40.0, 60), 1, "frequency", 2000.0, RUN.rate_hz, errors=False)
    Frames(plan, [meter]).take(EvenTime(ShaftAngle(*RUN.nodes()), RUN.rate_hz).take(samples[None]))
    return find_fixed_lines(meter.result(), 0, cuts)


def tone(frequency_hz, rms=B_RMS):
    return rms * np.sqrt(2.0) * np.cos(2.0 * np.pi * frequency_hz * RUN.times + 0.4)


def narrow_noise(frequency_hz, width_hz, seed):
    """Noise through one pair of poles, of rms `B_RMS`."""
    pole = np.exp((-np.pi * width_hz + 2j * np.pi * frequency_hz) / RUN.rate_hz)
    rung = signal.lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], RUN.noise(1.0, seed))
    return B_RMS * rung / np.sqrt(np.mean(rung**2))


def cut_of(order, rms, bandwidth=0.8):
    """A cut of 301 classes with the same level in all."""
    speeds = np.linspace(10.0, 40.0, 301)
    flat, zero = np.full(301, rms**2), np.zeros(301)
    return OrderCut(
        order, 0, bandwidth, bandwidth, 0.25 * bandwidth, (speeds - 10.0) / RUN.sweep, speeds, np.ones(301, int), flat,
        zero, zero, zero + 0j, zero + 1.0, zero, ("",) * 301,
    )  # fmt: skip


@pytest.mark.parametrize("frequency_hz", [600.0, 601.0, 602.0, 603.3])  # on a line of the map, and between two
def test_frequency_and_level_of_a_tone(frequency_hz, conformance):
    (line,) = lines_of(tone(frequency_hz) + RUN.noise(1e-5))
    assert line.steady and line.rows_out == line.rows == 60
    conformance(
        f"line at {frequency_hz:g} Hz",
        frequency_hz,
        line.frequency_hz,
        0.25,
        "Hz",
        "known input: a tone beside a run-up",
    )
    worst = np.abs(db(np.sqrt(line.mean_square) / B_RMS)).max()
    conformance(f"level of a line at {frequency_hz:g} Hz", 0.0, worst, 0.3, "dB", "known input: a tone beside a run-up")


def test_an_order_that_nobody_cut_changes_the_level_of_a_line_nowhere():
    (line,) = lines_of(tone(600.0) + RUN.order(25.0, 10.0 * B_RMS) + RUN.noise(1e-5))
    assert np.abs(db(np.sqrt(line.mean_square) / B_RMS)).max() < 0.5


@pytest.mark.parametrize("width_hz", [0.3, 1.0, 2.0, 3.0])
def test_noise_through_a_narrow_resonance_is_not_steady(width_hz):
    """Narrower than the window, it looks like a line; one of 0.3 Hz rings for a second, over several rows."""
    found = [line for seed in range(8) for line in lines_of(narrow_noise(600.0, width_hz, seed) + RUN.noise(1e-6))]
    assert len(found) >= 6 and not any(line.steady for line in found)


def test_a_tone_in_noise_is_steady_from_13_db_on():
    density = 10.0**-1.3 * B_RMS**2 / 6.0  # a Hann window of 4 Hz lets 6 Hz of noise through
    found = [lines_of(tone(600.0) + RUN.noise(density, seed)) for seed in range(8)]
    assert [line.steady for lines in found for line in lines] == [True] * 8


def test_a_tone_that_wanders_by_half_a_line_is_steady():
    knots = np.random.default_rng(5).normal(0.0, 2.0, 121)
    frequency = 600.0 + np.interp(RUN.times, 0.5 * np.arange(121), knots)
    wandering = B_RMS * np.sqrt(2.0) * np.cos(2.0 * np.pi * np.cumsum(frequency) / RUN.rate_hz)
    (line,) = lines_of(wandering + RUN.noise(1e-6))
    assert line.steady and line.frequency_hz == pytest.approx(600.0, abs=1.0)


def test_a_line_hides_weak_orders_where_it_lies_in_their_band_and_strong_ones_nowhere():
    (line,) = lines_of(tone(600.0) + RUN.noise(1e-6))
    hidden = line.hides(cut_of(30.0, 2.0 * B_RMS))
    at = 30.0 * np.linspace(10.0, 40.0, 301)[hidden]
    # 0.8 orders at 20 turns/s, and half a frame of 5 turns more at 0.5 turns/s²: 16 Hz and 2 Hz.
    assert [at.min(), at.max()] == pytest.approx([582.0, 619.0], abs=4.0)
    # In phase, a tone raises an order 3.86 times as strong by 2 dB, to 4.86 times the tone.
    assert line.hides(cut_of(30.0, 4.7 * B_RMS)).any() and not line.hides(cut_of(30.0, 5.0 * B_RMS)).any()
    assert not line.hides(cut_of(10.0, 0.1 * B_RMS)).any()  # it turns up to 400 Hz


def test_a_speed_met_at_one_time_in_the_mean_hides_no_more_than_it_must():
    """Up and down: each class has its mean time in the middle of the run."""
    (line,) = lines_of(tone(600.0) + RUN.noise(1e-6))
    cut = cut_of(30.0, B_RMS)
    cut = OrderCut(**{**vars(cut), "times_s": np.full(301, 30.0)})
    at = 30.0 * cut.speeds_hz[line.hides(cut)]
    assert [at.min(), at.max()] == pytest.approx([600.0 * 30.0 / 32.4, 600.0 * 30.0 / 27.6], abs=4.0)
