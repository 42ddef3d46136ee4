"""What sentences and figures of orders say of made-up levels: who leads, what is not told, what is drawn how."""

import numpy as np
import pytest

from tdacoustic.measured.order_results import ChannelOrders, OrderLevels, RunOrders
from tdacoustic.orders import NamedOrder
from tdacoustic.recording import Channel
from tdacoustic.reporting.figure import Line, Markers
from tdacoustic.reporting.sections.order_figures import cut_figure
from tdacoustic.reporting.sections.order_sentences import leader_sentences
from tdacoustic.reporting.sections.orders import _sideband_words

SPEEDS_HZ = np.arange(10.0, 16.0)
MIC = Channel("mic", "sound_pressure", "Pa", 0, 0, 1000.0, 0, 10000)


def levels(order, level_db, method="cut", reasons=None, bandwidth=0.5):
    power = (20e-6) ** 2 * 10.0 ** (np.asarray(level_db, dtype=np.float64) / 10.0)
    same = np.full(SPEEDS_HZ.size, 1.0)
    return OrderLevels(
        NamedOrder(f"mesh x{order:g}", "mesh", order, "motor"), method, 0.5, bandwidth * same, SPEEDS_HZ, power,
        0.05 * power, 1e-3 * power, 0.0 * same, 0.1 * same, same, reasons or ("",) * SPEEDS_HZ.size,
    )  # fmt: skip


def run(*held, bandwidth=0.5):
    channel = ChannelOrders("mic", held)
    named = tuple(item.order for item in held)
    return RunOrders("motor", "tacho", False, 10.0, 15.0, 0.5, bandwidth, 100.0, named, (), (channel,)), channel


def test_an_order_leads_on_until_another_is_a_decibel_stronger():
    _, channel = run(levels(1.0, [80, 80, 80, 80, 70, 70]), levels(2.0, [79, 80.5, 79, 80.8, 80, 80]))
    first, second = leader_sentences(MIC, channel)
    assert "mesh x1 (order 1) is the strongest order from 600 to 780 rpm, with up to 80.0 dB" in first
    assert "mesh x2 (order 2) is the strongest order from 840 to 900 rpm, with up to 80.0 dB" in second


def test_where_another_line_is_in_the_band_of_the_strongest_nobody_leads():
    crossed = ("", "", "carrier x2 within the band", "carrier x2 within the band", "", "")
    _, channel = run(levels(1.0, [80] * 6, reasons=crossed), levels(2.0, [70] * 6))
    (only,) = leader_sentences(MIC, channel)
    assert "mesh x1 (order 1) is the strongest order from 600 to 900 rpm" in only


def test_the_filter_joins_the_dots_of_its_order_alone():
    cuts = levels(1.0, [80] * 6), levels(2.0, [70] * 6)
    found, channel = run(*cuts, levels(1.0, [80] * 6, "vold_kalman"))
    figure = cut_figure("up", found, MIC, channel)
    dots = [element.name for element in figure.elements if isinstance(element, Markers)]
    lines = {element.name: element for element in figure.elements if isinstance(element, Line)}
    assert dots == ["mesh x1 (order 1)"] and lines["mesh x2 (order 2)"].points
    assert lines["mesh x1 by Vold-Kalman"].style == "dashed"


@pytest.mark.parametrize(("had", "words"), [(0.5, "0.5 orders, as asked for"), (0.8, "0.8 orders (0.5 asked for;")])
def test_the_bandwidth_is_that_of_the_cuts(had, words):
    """Orders that are found in the map alone leave that of the run at none."""
    found, channel = run(levels(1.0, [80] * 6, bandwidth=had), bandwidth=0.0)
    assert words in cut_figure("up", found, MIC, channel).caption


def test_faint_sidebands_are_said_to_be_faint():
    import pandas as pd

    rows = {"carrier": "mesh x1", "spacing": "motor shaft", "channel": "mic", "speed_rpm": [600.0, 900.0]}
    faint = pd.DataFrame({**rows, "sidebands_db": [-33.4, -35.0], "reason": ["unsteady phases", None]})
    words = _sideband_words(faint)
    assert "up to \N{MINUS SIGN}33.4 dB against the carrier (mic, 600 rpm), with steady phases in 1 of 2" in words
    assert "too faint to matter" in words
    assert "too faint" not in _sideband_words(faint.assign(sidebands_db=[-6.0, -7.0]))


def test_a_tie_is_no_reason_to_change_the_subject():
    _, channel = run(levels(1.0, [80, 80, 80, 80, 80, 80]), levels(2.0, [80.2, 79.8, 80.2, 79.8, 80.2, 79.8]))
    assert len(leader_sentences(MIC, channel)) == 1
