"""Sideband families: amplitude and phase modulation told apart by phase."""

import numpy as np
import pytest
from made_up_run_ups import RunUp

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import (
    AngleResampler,
    CutMeter,
    Frames,
    SpeedRows,
    plan_line_frames,
    sideband_families,
    sideband_orders,
)
from tdacoustic.speed import ShaftAngle

RUN = RunUp(15.0, 35.0, 30.0)
RATIO = 31.0 / 104.0


def families(samples, spacings=(1.0,), rows=4):
    resampler = AngleResampler(ShaftAngle(*RUN.nodes()), RUN.rate_hz, 45.0)
    plan = plan_line_frames(resampler.samples_per_turn, 0.05)
    meter = CutMeter(plan, sideband_orders([31.0], spacings), SpeedRows.even(15.0, 35.0, rows), 1, RUN.rate_hz)
    Frames(plan, [meter]).take(resampler.take(samples[None]))
    return sideband_families(meter.result(), [31.0], spacings)


def modulated(amplitude_depth=0.0, phase_depth=0.0, spacing=1.0):
    turns = 2.0 * np.pi * spacing * RUN.turns(RUN.times)
    return RUN.order(
        31.0, lambda t: 1.0 + amplitude_depth * np.cos(turns + 0.3), lambda t: phase_depth * np.cos(turns - 0.9)
    )


@pytest.mark.parametrize(("amplitude", "phase"), [(0.2, 0.0), (0.0, 0.1), (0.15, 0.08)])
def test_depths_of_amplitude_and_phase_modulation(amplitude, phase, conformance):
    (found,) = families(modulated(amplitude, phase) + RUN.noise(1e-8))
    for name, expected, depths in (
        ("amplitude", amplitude, found.amplitude_depth),
        ("phase", phase, found.phase_depth_rad),
    ):
        worst = depths[np.argmax(np.abs(depths - expected))]
        # The first pair of a phase modulation is J1/J0: 0.1 % beyond β at 0.1; cross terms of both: their product.
        conformance(
            f"{name} modulation beside ({amplitude:g}, {phase:g})",
            expected,
            float(worst),
            0.003,
            "1",
            "known input: modulation of known depth",
        )
    assert np.all(found.pairs >= 1) and all(reason == "" for reason in found.reasons)
    assert found.power_ratio[0] == pytest.approx(0.5 * (amplitude**2 + phase**2), rel=0.05)


def test_families_of_two_shafts_around_one_mesh():
    both = modulated(0.2) + modulated(0.3, spacing=RATIO) - RUN.order(31.0)
    pinion, wheel = families(both + RUN.noise(1e-8), (1.0, RATIO))
    assert np.allclose(pinion.amplitude_depth, 0.2, atol=0.02) and np.allclose(wheel.amplitude_depth, 0.3, atol=0.02)


def test_no_sidebands_no_pairs_and_a_reason():
    (found,) = families(RUN.order(31.0) + RUN.noise(1e-5))
    assert np.all(found.pairs == 0) and all("upper bound" in reason for reason in found.reasons)
    (silent,) = families(RUN.noise(1e-5))
    assert np.isnan(silent.amplitude_depth).all()
    assert all(reason == "no value: the carrier does not stand out" for reason in silent.reasons)


def test_a_carrier_that_was_not_cut_is_refused():
    with pytest.raises(AnalysisError, match="carrier 12 is not among the orders that were cut"):
        sideband_families((), [12.0], [1.0]) or sideband_families(
            [type("Cut", (), {"channel": 0, "order": 31.0})()], [12.0], [1.0]
        )
