"""The description of figures refuses what cannot be drawn."""

import numpy as np
import pytest
from report_figures import spectrum

from tdacoustic.errors import TdacousticError
from tdacoustic.reporting import Axis, Band, Bars, Figure, Heatmap, Line, Markers, ReportError, Rule
from tdacoustic.reporting.layout import Label, axis_ranges, log_ticks, place_labels, wrapped

X, Y = Axis("Time", "s"), Axis("Level", "dB")


def test_axis_caption_names_unit_reference_and_note() -> None:
    axis = Axis("Sound pressure level", "dB", reference="20 uPa", note="density, per Hz")
    assert axis.caption == "Sound pressure level / dB re 20 uPa (density, per Hz)"
    assert Axis("Order").caption == "Order"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Line([0, 1], [0, 1, 2], "a"), r"y of line 'a' must have shape \(2,\), got \(3,\)"),
        (lambda: Line([0, 1], [0, -np.inf], "a"), "finite or NaN"),
        (lambda: Line([0], [0], "a", style="wavy"), "style of line 'a'"),
        (lambda: Line([0], [0], "a", color=8), "slot from 0 to 7"),
        (lambda: Band([0], [2], [1], "b"), "lower edge above"),
        (lambda: Markers([0, 1], [0, 1], "m", labels=["one"]), "labels of markers 'm' must be 2 or none, got 1"),
        (lambda: Bars(["1"], [1, 2], "bars"), "values of bars"),
        (lambda: Heatmap([0, 1], [1, 0], np.zeros((2, 2)), "z", Y), "rising"),
        (lambda: Heatmap([0, 1], [0, 1], np.zeros((2, 3)), "z", Y), "shape"),
        (lambda: Rule(np.nan), "finite x"),
        (lambda: Axis("f", "Hz", "log", limits=(0, 10)), "positive"),
        (lambda: Axis("f", "Hz", limits=(10, 1)), "rising"),
        (lambda: Figure("Not a slug", "", "", X, Y, [Line([0], [0], "a")]), "lower-case"),
        (lambda: Figure("f", "", "", X, Y, [Rule(1.0)]), "draws nothing"),
        (lambda: Figure("f", "", "", X, Y, [Bars(["1"], [1], "a"), Bars(["2"], [1], "b")]), "different categories"),
    ],
)
def test_wrong_figures_are_refused(make, message) -> None:
    with pytest.raises(ReportError, match=message) as caught:
        make()
    assert isinstance(caught.value, TdacousticError)


def test_arrays_are_copies_and_read_only() -> None:
    y = np.zeros(3)
    line = Line([0, 1, 2], y, "a")
    y[0] = 1.0
    assert line.y[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        line.y[0] = 1.0


def test_colours_of_a_group_are_one_and_given_ones_are_not_reused() -> None:
    lines = [Line([0], [0], n, group=g, color=c) for n, g, c in [("a", "g", None), ("b", "g", None), ("c", None, 0)]]
    slots = Figure("f", "", "", X, Y, [*lines, Line([0], [0], "d"), Rule(0.0)]).slots()
    assert slots == (1, 1, 0, 2, None)


def test_ranges_follow_limits_and_what_is_shown() -> None:
    (x_low, x_high), (y_low, y_high) = axis_ranges(spectrum())
    assert (x_low, x_high) == pytest.approx((np.log10(20), np.log10(8000)))
    assert y_low < 31.0 and y_high > 95.5  # band and error bar are inside


def test_logarithmic_ticks_include_the_ends() -> None:
    assert log_ticks(np.log10(20), 3.0) == [20, 50, 100, 200, 500, 1000]
    assert log_ticks(0, 6) == [1, 10, 100, 1000, 10_000, 100_000, 1_000_000]


def test_labels_do_not_cover_each_other() -> None:
    rng = np.random.default_rng(3)
    labels = [Label(x, y, "mesh 12×", rule=i < 4) for i, (x, y) in enumerate(rng.uniform(0, 400, (40, 2)))]
    placed = place_labels(labels, 400, 400)
    assert 4 < len(placed) <= 40
    size = len("mesh 12×") * 6.2 + 6
    for i, a in enumerate(placed):
        assert size / 2 - 1 <= a.x <= 401 - size / 2
        for b in placed[:i]:
            assert abs(a.x - b.x) >= size - 1e-9 or abs(a.y - b.y) >= 15 - 1e-9


def test_axis_titles_break_before_the_note() -> None:
    assert wrapped("Level / dB (density, per Hz)", 1000, 6) == ["Level / dB (density, per Hz)"]
    assert wrapped("Level / dB (density, per Hz)", 130, 6) == ["Level / dB", "(density, per Hz)"]
