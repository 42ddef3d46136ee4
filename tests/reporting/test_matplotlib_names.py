"""Names in still figures: of any script, however long; seen as matplotlib places and draws them."""

import warnings
from itertools import pairwise

import numpy as np
import pytest

from tdacoustic.reporting import Axis, Bars, Figure, Line, plot
from tdacoustic.reporting import matplotlib_style as styles
from tdacoustic.reporting.matplotlib_names import legend_height
from tdacoustic.reporting.matplotlib_renderer import printed_size, render_png, render_svg

LONG = "GetriebegehaeuseAbtriebsseiteObenLinksVornAnDerDrehmomentstuetze"
NAMES = ["麦克风左侧四米处噪声测点一号齿轮箱旁", "Микрофон слева 4 м от оси (правый борт)", "מיקרופון שמאלי", LONG]


def bars(names: list[str]) -> Figure:
    return Figure("b", "B", "", Axis("Run"), Axis("Level", "dB"), [Bars(names, np.full(len(names), 80.0), "one")])


def lines(names: list[str], height: int = 300) -> Figure:
    drawn = [Line([1.0, 2.0], [3.0, 4.0], name) for name in names]
    return Figure("l", "L", "", Axis("Frequency", "Hz"), Axis("Level", "dB"), drawn, height=height)


def without_the_font(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(styles, "_chinese_family", tuple)


def test_chinese_is_drawn_and_not_a_box_for_each_sign() -> None:
    """One box is like another; each of these signs has its own strokes, 噪 more of them than 一."""
    pytest.importorskip("pylopdf_fonts_zh_cn")
    ink = {}
    for sign in "一二噪声":
        picture = plot(bars([sign * 8]))
        picture.set_dpi(300)
        picture.canvas.draw()
        dark = np.asarray(picture.canvas.buffer_rgba())[::-1, :, 0] < 128
        left, low, right, high = (
            int(edge) for edge in picture.axes[0].get_xticklabels()[0].get_window_extent().extents
        )
        ink[sign] = int(dark[low:high, left:right].sum())
    assert ink["噪"] > ink["声"] > ink["二"] > ink["一"]


def test_without_the_font_figures_are_drawn_and_nothing_is_said(monkeypatch) -> None:
    without_the_font(monkeypatch)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        boxes = [render_png(bars([sign]), dpi=60) for sign in "噪声"]
        assert plot(bars(["噪声"]))._repr_png_().startswith(b"\x89PNG")
    assert boxes[0] == boxes[1]


def test_signs_of_no_font_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert render_png(bars(["\ue000\U0001faf7"]), dpi=60) and render_svg(bars(["\ue000"]))


def test_a_figure_without_chinese_is_the_same_whether_the_font_is_there_or_not(monkeypatch) -> None:
    figure = bars(["Motor µm/s²", "Ёлка"])
    there = render_png(figure, dpi=60), render_svg(figure)
    without_the_font(monkeypatch)
    assert (render_png(figure, dpi=60), render_svg(figure)) == there


@pytest.mark.parametrize("names", [NAMES, [f"{LONG}{number}" for number in range(20)]], ids=["scripts", "many"])
def test_names_below_bars_stay_in_the_figure_and_apart(names: list[str]) -> None:
    picture = plot(bars(names))
    picture.canvas.draw()
    axes, whole = picture.axes[0], picture.bbox
    assert axes.get_window_extent().height > 0.3 * whole.height
    boxes = [label.get_window_extent() for label in axes.get_xticklabels()]
    for box in (*boxes, axes.xaxis.label.get_window_extent()):
        assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1
    if axes.get_xticklabels()[0].get_rotation() == 0.0:
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
        assert LONG in [label.get_text().replace("\n", "") for label in axes.get_xticklabels()]


def test_a_long_legend_makes_the_figure_higher_and_leaves_the_plot_its_room() -> None:
    few, many = lines(NAMES[:1]), lines([f"{name}: depends on {part}" for name in NAMES for part in "ab"])
    heights = []
    for figure in (few, many):
        picture = plot(figure)
        picture.canvas.draw()
        axes, width = picture.axes[0], printed_size(figure)[0]
        heights.append(axes.get_window_extent().height)
        assert picture.get_figheight() * 72.0 == pytest.approx(printed_size(figure)[1])
        for one in picture.legends:
            assert one.get_window_extent().y0 >= axes.get_window_extent().y1
            assert one.get_window_extent().x1 <= picture.bbox.x1
    assert heights[1] > 0.6 * heights[0]
    assert legend_height(few, width) == 0.0 < legend_height(many, width)
