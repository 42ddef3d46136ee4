"""Orders that nobody named are found in a map, and what is fixed in Hz is not taken for one."""

import numpy as np
import pytest
from made_up_run_ups import RunUp

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import (
    AngleResampler,
    EvenTime,
    Frames,
    FrequencyCurve,
    MapMeter,
    NamedOrder,
    SpeedRows,
    find_orders,
    order_strengths,
    plan_line_frames,
)
from tdacoustic.orders.baseline import beside
from tdacoustic.speed import ShaftAngle

RUN = RunUp(10.0, 30.0, 30.0)


def map_of(samples, domain="order"):
    angle = ShaftAngle(*RUN.nodes())
    rows = SpeedRows.even(10.0, 30.0, 40)
    if domain == "order":
        resampler = AngleResampler(angle, RUN.rate_hz, 60.0)
        plan = plan_line_frames(resampler.samples_per_turn, 0.125)
        meter = MapMeter(plan, rows, len(samples), "order", 60.0, RUN.rate_hz)
        Frames(plan, [meter]).take(resampler.take(samples))
    else:
        plan = plan_line_frames(RUN.rate_hz, 8.0)
        meter = MapMeter(plan, rows, len(samples), "frequency", 4096.0, RUN.rate_hz)
        Frames(plan, [meter]).take(EvenTime(angle, RUN.rate_hz).take(samples))
    return meter.result()


@pytest.fixture(scope="module")
def order_map():
    """Two channels: orders 31 and 17.4 in the first, 31 in both, and a line at 300 Hz, order 30 to 10, in both."""
    hum = 0.5 * np.sin(2.0 * np.pi * 300.0 * RUN.times)
    first = RUN.order(31.0, 0.5) + RUN.order(17.4, 0.1) + hum + RUN.noise(1e-4)
    second = RUN.order(31.0, 0.2) + hum + RUN.noise(1e-4, seed=2)
    return map_of(np.array([first, second]))


def test_orders_are_found_and_a_line_fixed_in_hz_is_none(order_map, conformance):
    found = find_orders(order_map, (), 0.5)
    assert len(found) == 2
    conformance(
        "order found in a map, lines 0.125 apart",
        17.4,
        found[0],
        0.02,
        "orders",
        "known input: orders of known level and phase over a made-up run-up",
    )
    assert found[1] == 31.0  # a whole number is taken for it


def test_what_is_known_is_not_found_again(order_map):
    assert find_orders(order_map, (31.1,), 0.5) == pytest.approx((17.4,), abs=0.02)
    assert find_orders(order_map, (), 0.5, most=1) == (31.0,)


def test_noise_alone_has_no_orders():
    assert find_orders(map_of(RUN.noise(1e-4)[None]), (), 0.5) == ()


def test_strengths_are_shares_of_the_energy(order_map):
    strengths = order_strengths(order_map, [17.4, 31.0, 45.0, 0.3], 0.5)
    # 0.01 and 0.25 in the first channel, 0 and 0.04 in the second: shares 0.038 and 0.962, 0 and 1. The line at 300 Hz
    # passes order 17.4 at one speed and adds to it there.
    assert strengths == pytest.approx([0.5 * 0.01 / 0.26, 0.5 * (1.0 + 0.25 / 0.26), 0.0, 0.0], abs=0.05)
    assert strengths[2:].tolist() == [0.0, 0.0]


def test_a_map_over_hz_is_refused():
    held = map_of(RUN.noise(1e-4)[None], "frequency")
    with pytest.raises(AnalysisError, match="in a map over orders, got 'frequency'"):
        find_orders(held, (), 0.5)


def test_the_baseline_passes_below_lines_and_along_slopes():
    level = np.tile(np.linspace(60.0, 20.0, 400), (3, 1))
    level[:, 100] += 30.0
    assert np.abs(beside(level) - np.linspace(60.0, 20.0, 400)).max() < 2.1  # half a window's slope at the ends


def test_named_orders_and_curves():
    order = NamedOrder("wheelset x2", "wheelset", 0.6, "wheelset", 0.3)
    assert order.of_shaft == pytest.approx(2.0)
    for bad in ({"order": 0.0}, {"ratio": -1.0}):
        with pytest.raises(AnalysisError, match=r"must be > 0, got .* \(x\)"):
            NamedOrder(**{"name": "x", "kind": "asked", "order": 1.0, "shaft": "motor", "ratio": 1.0, **bad})
    curve = FrequencyCurve("carrier", "inverter", np.array([10.0, 20.0, 30.0]), np.array([400.0, 500.0, np.nan]))
    found = curve.frequency_hz_at([5.0, 15.0, 25.0])
    assert found[1] == 450.0 and np.isnan(found[[0, 2]]).all()
