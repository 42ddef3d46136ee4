"""Spans of states: tones and what is left of the sound without them, third octaves, orders of a run-up."""

import numpy as np
import pytest

from tdacoustic.attribution.contribution_spans import Stretch, orders_between, spans, third_octaves
from tdacoustic.contributions import Span
from tdacoustic.fleet import Kinematics
from tdacoustic.fleet.kinematics import GearStage

LINES = np.arange(0.0, 1001.0, 4.0)


def tone(name, hz, mean_square=1.0, known=False):
    return Stretch(name, hz - 10.0, hz + 10.0, None, known, mean_square)


def test_tones_and_broadband_share_the_band_between_them():
    found = {item.span.name: item for item in spans({"0": [tone("a", 200.0), tone("b", 405.0)]}, {}, 20.0, 900.0, 4.0)}
    whole = found["total"].span.width_hz(LINES, 4.0)
    parts = found["tones"].span.width_hz(LINES, 4.0) + found["broadband"].span.width_hz(LINES, 4.0)
    np.testing.assert_allclose(parts, whole)
    assert found["tones"].span.width_hz(LINES, 4.0).sum() == pytest.approx(40.0)
    assert (found["a"].kind, found["a"].span.states) == ("tone", ("0",))


def test_what_the_engineer_left_out_is_not_broadband():
    found = spans({"0": []}, {"0": [(100.0, 150.0)]}, 20.0, 900.0, 4.0)
    (broadband,) = [item.span for item in found if item.kind == "broadband"]
    assert broadband.width_hz(LINES, 4.0).sum() == pytest.approx(880.0 - 50.0)
    assert not any(item.kind == "tones" for item in found)


def test_an_order_without_a_line_is_told_but_is_no_tone():
    found = spans({"0": [tone("mesh x1", 300.0, mean_square=0.0, known=True)]}, {}, 20.0, 900.0, 4.0)
    assert [item.kind for item in found if item.span.states] == ["order"]


def test_third_octaves_have_nominal_names_and_lines_enough(conformance):
    bands = third_octaves(20.0, 3000.0, 4.0)
    assert [band.name for band in bands][:3] == ["63 Hz", "80 Hz", "100 Hz"]  # 50 Hz is 11.6 Hz wide
    kilo = next(band for band in bands if band.name == "1000 Hz")
    conformance(
        "lower edge of the third octave at 1 kHz",
        891.251,
        kilo.low_hz,
        0.001,
        "Hz",
        "standard: IEC 61260-1:2014, band edges, base ten",
    )
    assert bands[-1].high_hz <= 3000.0


def test_orders_of_a_run_up_reach_from_its_lowest_to_its_highest_speed():
    drive = Kinematics(1.0, (GearStage("1", (20, 60)),))
    found = {item.name: item for item in orders_between(drive, 10.0, 11.0, 2000.0, 4.0)}
    assert (found["mesh x2"].low_hz, found["mesh x2"].high_hz) == pytest.approx((400.0 - 10.0, 440.0 + 10.0))
    assert found["mesh x2"].order == 40.0
    assert not any("shaft" in name or "wheelset" in name for name in found)


def test_stretches_that_overlap_are_one_with_both_names():
    """Two stages whose meshes lie 12 Hz apart: lobes of 10 Hz to each side cannot tell them."""
    drive = Kinematics(1.0, (GearStage("a", (20, 20)), GearStage("b", (22, 60))))
    names = [item.name for item in orders_between(drive, 6.0, 6.0, 140.0, 4.0)]
    assert names == ["mesh a x1 + mesh b x1"]
    (found,) = orders_between(drive, 6.0, 6.0, 140.0, 4.0)
    assert (found.low_hz, found.high_hz, found.order) == (110.0, 142.0, None)


def test_a_stretch_left_out_of_a_span_takes_its_part_of_each_line():
    span = Span("x", 100.0, 120.0, left_out_hz=((101.0, 107.0),))
    width = dict(zip(LINES, span.width_hz(LINES, 4.0), strict=True))
    assert width[100.0] == pytest.approx(1.0)  # 98 to 102: 100 to 101 are left
    assert width[104.0] == 0.0
    assert width[108.0] == pytest.approx(3.0)
