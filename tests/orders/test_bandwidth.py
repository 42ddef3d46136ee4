"""The advised bandwidth: what bounds it, and that a filter of that width does what the advice says."""

import math

import numpy as np
import pytest
from made_up_run_ups import RunUp, db

from tdacoustic.errors import AnalysisError
from tdacoustic.orders import TrackedOrder, VoldKalman, advise_bandwidth
from tdacoustic.speed import ShaftAngle

PUT_IN = "known input: an order through a resonance of known loss factor"

RUN = RunUp(10.0, 40.0, 60.0, 4096.0)


def angle_of(run):
    return ShaftAngle(*run.nodes())


def test_the_three_bounds_are_the_documented_ones():
    advice = advise_bandwidth(angle_of(RUN), 20.0, [(angle_of(RUN), 21.0)], loss_factor=0.05)
    # 95th percentile of (dn/dt)/n: at 5 % of the record after its start, 11.5 turns/s.
    assert advice.following_hz == pytest.approx(1.5 * 0.5 / 11.5 / 0.05, rel=0.01)
    assert advice.separating_hz == pytest.approx(13.0 / 2.0, rel=0.01)  # 10th percentile of the spacing: 13 Hz
    assert advice.shortest_hz == pytest.approx(4.0 / 60.0)
    assert advice.bandwidth_hz == advice.following_hz and advice.notes == ()


def test_steady_speed_asks_for_what_the_record_is_long_for():
    advice = advise_bandwidth(angle_of(RunUp(20.0, 20.0, 30.0)), 5.0)
    assert advice.bandwidth_hz == pytest.approx(4.0 / 30.0) and math.isinf(advice.separating_hz)


def test_what_cannot_be_had_is_said():
    near = advise_bandwidth(angle_of(RUN), 20.0, [(angle_of(RUN), 20.1)])
    assert near.bandwidth_hz == near.separating_hz and "peaks are rounded" in near.notes[0]
    crossing = advise_bandwidth(angle_of(RUN), 8.0, [(angle_of(RunUp(40.0, 10.0, 60.0)), 8.0)])
    assert any("crosses order 8" in note for note in crossing.notes)
    with pytest.raises(AnalysisError, match="loss_factor must be > 0, got 0"):
        advise_bandwidth(angle_of(RUN), 1.0, loss_factor=0.0)


@pytest.mark.parametrize("poles", [1, 2, 3])
def test_an_order_not_tracked_is_kept_out_by_40_db(poles):
    run = RunUp(20.0, 20.0, 30.0, 4096.0)
    advice = advise_bandwidth(angle_of(run), 10.0, [(angle_of(run), 11.0)], poles=poles, joint=False)
    samples = run.order(11.0)
    (found,) = VoldKalman([TrackedOrder(angle_of(run), 10.0, advice.separating_hz)], 4096.0, 1, poles).whole(
        samples[None]
    )
    good = found.reason[0] == 0
    level = float(db(np.median(np.abs(found.amplitude[0, good]))))
    if poles == 1:  # 15 bandwidths away is beyond what the splines of 16 nodes a 1 / B follow: they keep it out too
        assert level < -39.0
        return
    assert level == pytest.approx(-40.0, abs=1.0)


def test_a_resonance_passed_with_the_advised_bandwidth_keeps_its_peak(conformance):
    run, loss, order = RUN, 0.03, 20.0
    frequency = order * run.speed(run.times)
    quasi_static = lambda f: 1.0 / (1.0 - (f / 500.0) ** 2 + 1j * loss * f / 500.0)  # noqa: E731
    gain = quasi_static(frequency)
    samples = run.order(order, np.abs(gain), np.angle(gain))
    advice = advise_bandwidth(angle_of(run), order, loss_factor=loss)
    (found,) = VoldKalman([TrackedOrder(angle_of(run), order, advice.bandwidth_hz)], run.rate_hz).whole(samples[None])
    peak = float(db(np.nanmax(np.abs(found.amplitude[0])) * loss))
    conformance("peak of a resonance passed in a run-up, advised bandwidth", 0.0, peak, 0.25, "dB", PUT_IN)
