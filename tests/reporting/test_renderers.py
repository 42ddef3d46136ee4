"""Both renderers draw every element, twice the same."""

import json
import os
import struct
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from report_figures import EVIL, every_figure, heatmap, spectrum

from tdacoustic.reporting import Axis, Figure, Heatmap, Line, Markers, ReportError, plot
from tdacoustic.reporting.document import Document, FigureBlock, Section
from tdacoustic.reporting.figure import Bars
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.layout import COLUMN_WIDTH, figure_width
from tdacoustic.reporting.matplotlib_renderer import render_png, render_svg
from tdacoustic.reporting.palette import DARK, LIGHT
from tdacoustic.reporting.plotly_renderer import MAX_POINTS, render_plotly
from tdacoustic.reporting.plotly_traces import MAX_COLUMNS, MAX_ROWS

FIGURES = pytest.mark.parametrize("figure", every_figure(), ids=lambda figure: figure.name)


@FIGURES
def test_plotly_json_is_strict_and_the_same_twice(figure: Figure) -> None:
    drawn = render_plotly(figure)
    assert json.dumps(drawn, allow_nan=False) == json.dumps(render_plotly(figure), allow_nan=False)
    assert json.loads(json.dumps(drawn)) == drawn


@FIGURES
def test_plotly_accepts_the_json(figure: Figure) -> None:
    graph_objects = pytest.importorskip("plotly.graph_objects")
    graph_objects.Figure(render_plotly(figure))  # plotly's own check of every key and value


@FIGURES
def test_pictures_are_the_same_twice(figure: Figure) -> None:
    png = render_png(figure, dpi=60)
    assert png == render_png(figure, dpi=60)
    assert png.startswith(b"\x89PNG") and b"Software" not in png
    svg = render_svg(figure)
    assert svg == render_svg(figure)
    assert "<dc:date>" not in svg


def test_hatched_bars_have_their_strokes_in_both_renderers() -> None:
    plain, hatched = (Bars(["1", "2"], [3.0, 4.0], "gearbox", hatch=hatch) for hatch in (None, "/"))
    one, other = (Figure("b", "B", "", Axis("Run"), Axis("Share", "%"), [bars]) for bars in (plain, hatched))
    assert "pattern" not in render_plotly(one)["data"][0]["marker"]
    pattern = render_plotly(other, "light")["data"][0]["marker"]["pattern"]
    assert pattern["shape"] == "/" and pattern["fgcolor"] == LIGHT["paper"] != pattern["bgcolor"]
    assert "<pattern" not in render_svg(one) and "<pattern" in render_svg(other)
    with pytest.raises(ReportError, match="hatch of bars 'gearbox'"):
        Bars(["1"], [1.0], "gearbox", hatch="~")  # type: ignore[arg-type]


def test_every_colour_of_the_page_is_a_role() -> None:
    text = json.dumps([render_plotly(figure, "css") for figure in every_figure()])
    roles = {part.split(")")[0] for part in text.split("var(--")[1:]}
    assert roles <= set(LIGHT) == set(DARK)
    assert {"ink", "paper", "series-0"} <= roles


def test_traces_keep_their_peak_and_their_gap() -> None:
    trace = render_plotly(spectrum())["data"][0]
    assert len(trace["x"]) <= MAX_POINTS
    assert max(y for y in trace["y"] if y is not None) == 93.5
    assert trace["x"][trace["y"].index(93.5)] == 500
    assert None in trace["y"]


def test_maps_are_reduced() -> None:
    trace = render_plotly(heatmap(rows=900, columns=1700))["data"][0]
    assert len(trace["z"]) == len(trace["y"]) <= MAX_ROWS
    assert len(trace["z"][0]) == len(trace["x"]) <= MAX_COLUMNS


def test_a_map_on_a_logarithmic_axis_is_drawn_in_both() -> None:
    y = np.geomspace(20, 8000, 40)
    heat = Heatmap(np.arange(5.0), y, np.ones((40, 5)), "m", Axis("Level", "dB"))
    figure = Figure("f", "F", "", Axis("Time", "s"), Axis("Frequency", "Hz", "log"), [heat])
    assert render_plotly(figure)["layout"]["yaxis"]["type"] == "log"
    assert render_png(figure, dpi=40)


def test_names_are_escaped_for_plotly() -> None:
    text = json.dumps(render_plotly(spectrum(word=EVIL + "%{x}$")))
    assert "<img" not in text and "</script" not in text
    assert "&lt;img" in text and EVIL + "%{" not in text


def test_labels_are_placed_on_the_picture() -> None:
    layout = render_plotly(spectrum())["layout"]
    assert [label["text"] for label in layout["meta"]["labels"]] == ["mic_1", "2×", "mic_1"]
    assert {note["text"] for note in layout["annotations"]} == {"mic_1", "2×"}


def test_empty_and_single_points_are_drawn() -> None:
    elements = [Line([], [], "nothing"), Line([1.0], [2.0], "point"), Markers([1.0], [np.nan], "gap", labels=["x"])]
    figure = Figure("f", "F", "", Axis("Time", "s"), Axis("Level", "dB"), elements)
    assert render_plotly(figure)["data"][1]["mode"] == "markers"
    assert render_png(figure, dpi=40)


def test_plot_writes_files_and_refuses_other_kinds(tmp_path) -> None:
    for suffix in ("png", "svg", "pdf"):
        plot(spectrum(), tmp_path / f"figure.{suffix}")
        assert (tmp_path / f"figure.{suffix}").stat().st_size > 1000
    assert plot(spectrum())._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ReportError, match=r"\.png, \.svg or \.pdf"):
        plot(spectrum(), tmp_path / "figure.bmp")


def test_drawing_leaves_no_global_state_and_imports_are_light() -> None:
    code = (
        "import sys, tdacoustic.reporting\n"
        "heavy = {'matplotlib', 'plotly', 'jinja2', 'scipy', 'pandas'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "from report_figures import spectrum\n"
        "from tdacoustic.reporting.matplotlib_renderer import render_png\n"
        "from matplotlib import rcParams as rc\n"
        "state = lambda: {key: rc[key] for key in rc if key != 'backend'}\n"
        "before = state()\n"
        "render_png(spectrum(), dpi=40)\n"
        "assert state() == before\n"
        "assert 'matplotlib.pyplot' not in sys.modules and 'plotly' not in sys.modules\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120, env=environment)


def test_a_map_with_equal_axes_is_as_wide_as_it_needs() -> None:
    """A square map of 460 pixels in height: the plot is 370 wide, with axis and scale some 550; not the whole 900."""
    edges = np.linspace(-1.5, 1.5, 31)
    x, y = Axis("x", "m", limits=(-1.5, 1.5)), Axis("y", "m", limits=(-1.5, 1.5))
    heat = Heatmap(edges, edges, np.add.outer(edges, edges), "level", Axis("Level", "dB"))
    square = Figure("map", "Map", "", x, y, [heat], height=460, equal=True)
    assert 500 <= figure_width(square) <= 600
    wide, high = struct.unpack(">II", render_png(square, dpi=100)[16:24])
    assert wide / high == pytest.approx(figure_width(square) / 460, rel=0.01)
    assert f"max-width: {figure_width(square)}px" in page_of(square)
    free = Figure("map", "Map", "", x, y, [heat], height=460)
    assert figure_width(free) == COLUMN_WIDTH
    assert "max-width: " not in page_of(free).split("<main")[1].split("<script")[0]


def page_of(figure: Figure) -> str:
    return render_html(Document("Report", "", "measured", sections=[Section("one", "One", [FigureBlock(figure)])]))


def test_many_long_categories_are_broken_into_lines() -> None:
    names = [f"a long name of a parameter {number}" for number in range(8)]
    bars = Figure("b", "B", "", Axis("Parameter"), Axis("Change", "dB"), [Bars(names, np.ones(8), "one")])
    axis = render_plotly(bars)["layout"]["xaxis"]
    assert axis["tickangle"] == 0
    assert axis["ticktext"][3].replace("<br>", " ") == names[3] and "<br>" in axis["ticktext"][3]
    few = Figure("b", "B", "", Axis("Parameter"), Axis("Change", "dB"), [Bars(names[:2], np.ones(2), "one")])
    assert "tickangle" not in render_plotly(few)["layout"]["xaxis"]


def test_lines_over_x_are_read_out_together_and_closed_ones_are_not() -> None:
    x = np.linspace(0.0, 10.0, 50)
    angle = np.linspace(0.0, 2.0 * np.pi, 50)

    def drawn(*lines: Line) -> dict[str, Any]:
        return render_plotly(Figure("f", "F", "", Axis("Frequency", "Hz"), Axis("Level", "dB"), lines))

    together = drawn(
        *(Line(x, x + n, f"c{n}") for n in range(11)), Line([2, 2, np.nan, 4, 4], [0, 1, np.nan, 0, 1], "s")
    )
    assert together["layout"]["hovermode"] == "x unified"
    assert [trace.get("hoverinfo") for trace in together["data"]] == [None] * 11 + ["skip"]
    assert drawn(Line(np.cos(angle), np.sin(angle), "c"))["layout"]["hovermode"] == "closest"
    assert drawn(*(Line(x, x + n, f"c{n}") for n in range(40)))["layout"]["hovermode"] == "closest"
    level = render_plotly(heatmap())
    assert level["layout"]["hovermode"] == "closest" and level["layout"]["hoverdistance"] == 24
