"""The synchronous average: what repeats with the turn, the scatter that stays, and what is taken out."""

import numpy as np
import pytest
from made_up_run_ups import RunUp

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import AngleResampler, SynchronousMeter
from tdacoustic.speed import ShaftAngle

PUT_IN = "known input: orders of known level and phase over a made-up run-up"

RUN = RunUp(10.0, 30.0, 40.0)


def averaged(samples, turns=1, block=9999, **options):
    samples = np.atleast_2d(samples)
    resampler = AngleResampler(ShaftAngle(*RUN.nodes()), RUN.rate_hz, 40.0)
    meter = SynchronousMeter(resampler.samples_per_turn, len(samples), turns, **options)
    blocks = []
    for start in range(0, samples.shape[1], block):
        blocks.append(resampler.take(samples[:, start : start + block]))
        meter.take(blocks[-1])
    return meter.result(), blocks


def test_orders_keep_amplitude_and_phase_and_others_go(conformance):
    density = 1e-4
    samples = RUN.order(5.0, 0.5, 0.7) + RUN.order(31.0, 0.1, -1.0) + RUN.order(7.4, 0.3) + RUN.noise(density)
    found, _ = averaged(samples)
    assert found.periods[0] > 780
    amplitude = found.amplitudes[0]
    conformance("synchronous average, order 5, rms", 0.5, float(abs(amplitude[5])), 0.002, "1", PUT_IN)
    conformance("synchronous average, order 5, phase", 0.7, float(np.angle(amplitude[5])), 0.005, "rad", PUT_IN)
    conformance("synchronous average, order 31, rms", 0.1, float(abs(amplitude[31])), 0.002, "1", PUT_IN)
    conformance("synchronous average, order 31, phase", -1.0, float(np.angle(amplitude[31])), 0.02, "rad", PUT_IN)
    left = np.delete(np.abs(amplitude), [5, 31])
    assert left.max() < 0.01  # 0.3 of order 7.4 and the noise, over 800 turns
    stated = found.error.mean()
    truth = np.sqrt(2.0) * (0.5 * np.cos(2 * np.pi * 5 * np.arange(100) / 100 + 0.7) + 0.1 * np.cos(
        2 * np.pi * 31 * np.arange(100) / 100 - 1.0))  # fmt: skip
    assert 0.4 < np.std(found.mean[0] - truth) / stated < 1.6


def test_the_residual_is_what_does_not_repeat():
    samples = RUN.order(5.0, 0.5, 0.7) + RUN.noise(1e-4)
    found, blocks = averaged(samples)
    left = np.concatenate([found.residual(block).values[0] for block in blocks])
    only_noise, other = averaged(RUN.noise(1e-4))
    noise = np.concatenate([block.values[0] for block in other])
    assert np.mean(left**2) == pytest.approx(np.mean(noise**2), rel=0.01)
    assert found.residual_mean_square[0] == pytest.approx(np.mean(noise**2), rel=0.01)
    assert found.speed_hz == pytest.approx(only_noise.speed_hz)


def test_the_count_begins_at_the_angles_zero_whatever_the_blocks():
    samples = RUN.order(3.0, 1.0, 0.4)
    first, _ = averaged(samples, block=333)
    second, _ = averaged(samples, block=200000)
    assert np.allclose(first.mean, second.mean, atol=1e-12) and first.periods[0] == second.periods[0]


def test_two_turns_hold_half_orders():
    found, _ = averaged(RUN.order(5.5, 0.5, 0.7), turns=2)
    assert found.orders[11] == 5.5 and abs(found.amplitudes[0, 11]) == pytest.approx(0.5, rel=1e-3)
    assert np.angle(found.amplitudes[0, 11]) == pytest.approx(0.7, abs=1e-3)


def test_the_difference_signal_is_the_average_less_the_mesh():
    found, _ = averaged(RUN.order(20.0, 1.0) + RUN.order(21.0, 0.2) + RUN.order(3.0, 0.1))
    assert np.std(found.only([20.0])) == pytest.approx(1.0, rel=2e-3)
    assert np.std(found.without([20.0], half_width=1.0)) == pytest.approx(0.1, rel=5e-3)


def test_a_range_of_speeds_can_be_taken():
    found, _ = averaged(RUN.order(5.0, lambda t: np.where(RUN.speed(t) < 20.0, 1.0, 0.2)), speeds_hz=(22.0, 30.0))
    assert abs(found.amplitudes[0, 5]) == pytest.approx(0.2, rel=2e-3)
    assert 22.0 < found.speed_hz < 30.0


def test_too_few_turns_and_wrong_settings_are_refused():
    with pytest.raises(AnalysisError, match="0 whole periods of 100000 turns are too few"):
        averaged(RUN.order(5.0), turns=100000)
    with pytest.raises(AnalysisError, match="turns must be >= 1"):
        SynchronousMeter(100, 1, 0)
