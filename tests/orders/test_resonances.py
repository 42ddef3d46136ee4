"""What is fixed in Hz, told from what follows the speed."""

import numpy as np
import pytest
from made_up_run_ups import RunUp
from scipy import signal

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import (
    AngleResampler,
    CutMeter,
    EvenTime,
    Frames,
    MapMeter,
    SpeedRows,
    find_fixed_frequencies,
    plan_line_frames,
)
from tdacoustic.speed import ShaftAngle

RUN = RunUp(8.0, 60.0, 100.0)
ORDERS = (4.0, 7.3, 12.0, 19.0, 31.0)


def resonator(samples, frequency_hz, loss, gain):
    """A mass on a spring, sampled exactly: poles of the continuous one, no warping of the frequency."""
    pole = np.exp((-0.5 * loss + 1j * np.sqrt(1.0 - 0.25 * loss**2)) * 2.0 * np.pi * frequency_hz / RUN.rate_hz)
    response = signal.dlti([1.0, -1.0, 0.0], [1.0, -2.0 * pole.real, abs(pole) ** 2])
    peak = np.abs(signal.dfreqresp(response, [2.0 * np.pi * frequency_hz / RUN.rate_hz])[1][0])
    return gain / peak * signal.lfilter([1.0, -1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], samples)


def excitation(seed):
    rng = np.random.default_rng(seed)
    result = RUN.noise(1e-7, seed)
    for order in ORDERS:
        rms = 10.0 ** rng.uniform(-0.3, 0.3) * (1.0 + 0.4 * np.cos(0.02 * np.pi * rng.uniform(0.3, 1.0) * RUN.times))
        result += RUN.order(order, rms, rng.uniform(0.0, 6.0))
    return result


def found_in(samples):
    angle = ShaftAngle(*RUN.nodes())
    resampler = AngleResampler(angle, RUN.rate_hz, 40.0)
    plan = plan_line_frames(resampler.samples_per_turn, 0.2)
    cuts = CutMeter(plan, ORDERS, SpeedRows.even(8.0, 60.0, 150), 1, RUN.rate_hz)
    Frames(plan, [cuts]).take(resampler.take(samples[None]))
    frames = plan_line_frames(RUN.rate_hz, 2.0)
    meter = MapMeter(frames, SpeedRows.even(8.0, 60.0, 40), 1, "frequency", 3000.0, RUN.rate_hz)
    Frames(frames, [meter]).take(EvenTime(angle, RUN.rate_hz).take(samples[None]))
    return find_fixed_frequencies(cuts.result(), meter.result())


@pytest.mark.parametrize(("frequency_hz", "loss"), [(300.0, 0.03), (410.0, 0.05), (700.0, 0.04)])
def test_a_resonance_is_found_with_its_loss_factor(frequency_hz, loss, conformance):
    driven = excitation(1)
    (found,) = found_in(driven + resonator(driven, frequency_hz, loss, 5.0))
    assert found.kind == "resonance" and found.orders_raised >= 2 and found.confidence > 0.9
    conformance(
        f"resonance at {frequency_hz:g} Hz",
        frequency_hz,
        found.frequency_hz,
        0.02 * frequency_hz,
        "Hz",
        "known input: a resonator of known frequency driven by orders",
    )
    # Classes of 0.35 turns/s and frames of 5 turns broaden it: an upper bound, within a factor of two.
    assert 0.8 * loss < found.loss_factor < 2.0 * loss


def test_none_is_found_where_there_is_none():
    assert [found_in(excitation(seed)) for seed in range(6)] == [()] * 6


def test_what_one_order_does_alone_is_no_resonance():
    at_hz = 12.0 * RUN.speed(RUN.times)  # order 12 alone is 8 times as strong around 400 Hz
    alone = RUN.order(12.0, 7.0 * np.exp(-(((at_hz - 400.0) / 15.0) ** 2)))
    assert found_in(sum(RUN.order(order) for order in ORDERS) + alone + RUN.noise(1e-7)) == ()


def test_two_resonances_and_a_line_fixed_in_hz_are_told_apart():
    driven = excitation(2)
    samples = driven + resonator(driven, 300.0, 0.03, 6.0) + resonator(driven, 800.0, 0.05, 5.0)
    samples += 0.05 * np.sqrt(2.0) * np.cos(2.0 * np.pi * 550.0 * RUN.times)
    found = found_in(samples)
    assert [item.kind for item in found] == ["resonance", "line", "resonance"]
    assert [round(item.frequency_hz / 10.0) for item in found] == pytest.approx([30, 55, 80], abs=1)
    assert np.isnan(found[1].loss_factor) and "no loss factor" in found[1].evidence


def tone(frequency_hz, rms):
    return rms * np.sqrt(2.0) * np.cos(2.0 * np.pi * frequency_hz * RUN.times)


def fixed(samples):
    return [(item.kind, item.frequency_hz) for item in found_in(samples)]


@pytest.mark.parametrize(("frequency_hz", "rms", "seed"), [(550.0, 2.0, 1), (333.3, 1.0, 3), (761.9, 4.0, 2)])
def test_a_line_as_strong_as_the_orders_is_no_resonance(frequency_hz, rms, seed):
    """Each order that meets it is raised there, by what the line has and not by a part of its own."""
    assert fixed(excitation(seed) + tone(frequency_hz, rms)) == [("line", pytest.approx(frequency_hz, abs=0.3))]


def test_a_line_whose_level_follows_the_torque_is_no_resonance():
    course = 10.0 ** (0.15 * np.cos(2.0 * np.pi * RUN.times / RUN.duration_s))  # 6 dB up and down
    assert fixed(excitation(1) + course * tone(550.0, 2.0)) == [("line", pytest.approx(550.0, abs=0.3))]


@pytest.mark.parametrize("resonance_hz", [450.0, 500.0, 620.0, 700.0])
def test_a_resonance_beside_a_strong_line_is_the_only_one(resonance_hz):
    driven = excitation(2)
    found = fixed(driven + resonator(driven, resonance_hz, 0.04, 5.0) + tone(550.0, 2.0))
    assert sorted(found) == [
        ("line", pytest.approx(550.0, abs=0.3)),
        ("resonance", pytest.approx(resonance_hz, rel=0.015)),
    ]


def test_a_resonance_that_lifts_orders_above_a_line_at_its_frequency_is_found():
    driven = excitation(1)
    line, found = found_in(driven + resonator(driven, 550.0, 0.04, 5.0) + tone(550.0, 0.5))
    assert (line.kind, found.kind) == ("line", "resonance") and found.orders_raised == 3
    assert (line.frequency_hz, found.frequency_hz) == (pytest.approx(550.0, abs=0.3), pytest.approx(550.0, rel=0.015))
    assert "hides some of them" in found.evidence


@pytest.mark.parametrize("seed", [1, 2])
def test_a_resonance_of_noise_alone_is_no_line(seed):
    """The orders do not pass through it; where they meet its noise they are raised."""
    noise = RUN.noise(1e-4, seed + 50)
    assert fixed(excitation(seed) + resonator(noise, 700.0, 0.04, 30.0)) == [
        ("resonance", pytest.approx(700.0, rel=0.02))
    ]


def test_too_little_is_refused():
    with pytest.raises(AnalysisError, match="got 'order'"):
        find_fixed_frequencies((), type("Map", (), {"domain": "order"})())
    with pytest.raises(AnalysisError, match="channel 0: 0 orders are too few"):
        find_fixed_frequencies((), type("Map", (), {"domain": "frequency"})())
