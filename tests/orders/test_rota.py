"""Beside rota-order (GPL; run here as an independent program, never imported by the package)."""

import numpy as np
import pytest
from made_up_run_ups import RunUp

from tdacoustic.orders import AngleResampler, EachFrame, Frames, MapMeter, TrackedOrder, VoldKalman, plan_line_frames
from tdacoustic.speed import ShaftAngle

rota = pytest.importorskip("rota", reason="rota-order is not installed")

RUN = RunUp(10.0, 50.0, 12.0)


def test_the_vold_kalman_filter_is_the_same(conformance):
    from rota.extract import order_waveform

    samples = RUN.order(6.0, 1.0, 0.5) + RUN.order(6.8, 0.4, -1.0) + RUN.order(9.0, 0.3, 0.2, 0.618) + RUN.noise(1e-4)
    angle = ShaftAngle(*RUN.nodes())
    other = angle.at_ratio(0.618)
    orders = [TrackedOrder(angle, 6.0, 2.0), TrackedOrder(angle, 6.8, 2.0), TrackedOrder(other, 9.0, 2.0)]
    ours = VoldKalman(orders, RUN.rate_hz).whole(samples[None])
    rpm = 60.0 * RUN.speed(RUN.times)
    theirs = order_waveform(
        samples, RUN.rate_hz, np.column_stack((rpm, 0.618 * rpm)), [6.0, 6.8, 9.0], bandwidth=2.0, shafts=[0, 0, 1]
    ).envelopes / np.sqrt(2.0)
    for index, found in enumerate(ours):
        good = found.reason[0] == 0
        there = theirs[np.rint(found.times_s * RUN.rate_hz).astype(int), index]
        apart = np.max(np.abs(found.amplitude[0] - there)[good])
        # What differs beside the ends, where the other keeps the mirror image: some 1e-4, and 1e-7 elsewhere.
        conformance(f"Vold-Kalman beside rota-order, order {index + 1}", 0.0, apart, 5e-4, "1",
                    "program: rota-order")  # fmt: skip


def test_the_order_map_is_the_same(conformance):
    from rota.maps import rpm_order_map

    samples = RUN.order(6.0, 1.0, 0.5) + RUN.order(13.37, 0.4) + RUN.noise(1e-4)
    resampler = AngleResampler(ShaftAngle(*RUN.nodes()), RUN.rate_hz, 40.0, samples_per_turn=100)
    plan = plan_line_frames(100.0, 0.1, overlap=0.75)
    meter = MapMeter(plan, EachFrame(), 1, "order", 40.0, RUN.rate_hz)
    Frames(plan, [meter]).take(resampler.take(samples[None]))
    ours = meter.result()
    theirs = rpm_order_map(
        samples, RUN.rate_hz, 60.0 * RUN.speed(RUN.times), order_resolution=0.1, max_order=40.0, samples_per_rev=100
    )
    assert np.allclose(theirs.axis, ours.axis) and theirs.enbw_bins == pytest.approx(ours.frames.noise_lines)
    for order in (6.0, 13.37):
        line = round(order / 0.1)
        own, other = (
            10.0 * np.log10(np.mean(power))
            for power in (ours.mean_square[0, 5:-5, line], np.abs(theirs.values[line, 5:-5]) ** 2)
        )
        conformance(f"order map beside rota-order, order {order:g}", float(other), float(own), 0.05, "dB",
                    "program: rota-order")  # fmt: skip
