"""Figures on paper against matplotlib's own picture of the same figure."""

import io

import numpy as np
import pytest
from PIL import Image
from read_pdf import ReadPdf
from report_figures import bars, heatmap, spectrum

from tdacoustic.reporting import Axis, Bars, Document, Figure, FigureBlock, Line, Markers, Section
from tdacoustic.reporting.matplotlib_renderer import render_png
from tdacoustic.reporting.pdf import render_pdf
from tdacoustic.reporting.pdf.figures import MOST_LINE_BYTES

DPI = 144


def curves() -> Figure:
    x = np.linspace(1.0, 100.0, 400)
    elements = (
        Line(x, 50.0 + 20.0 * np.sin(x / 5.0), "a"),
        Line(x, 60.0 + 0.1 * x, "b", style="dashed", opacity=0.4),
        Markers([20.0, 70.0], [45.0, 55.0], "points", labels=["first", "second"], errors=[2.0, 3.0]),
    )
    return Figure("curves", "Curves", "", Axis("Frequency", "Hz", "log"), Axis("Level", "dB"), elements)


def read(figure: Figure) -> ReadPdf:
    return ReadPdf(render_pdf(Document("R", "", "measured", sections=[Section("one", "One", [FigureBlock(figure)])])))


def place(small: np.ndarray, page: np.ndarray) -> tuple[int, int, float]:
    """Row and column at which a picture correlates best with a page, and how well, by fast Fourier transform."""
    a, b = small - small.mean(), page - page.mean()
    shape = (page.shape[0] + small.shape[0], page.shape[1] + small.shape[1])
    found = np.fft.irfft2(np.fft.rfft2(b, shape) * np.conj(np.fft.rfft2(a, shape)), shape)
    found = found[: page.shape[0] - small.shape[0] + 1, : page.shape[1] - small.shape[1] + 1]
    row, column = np.unravel_index(int(found.argmax()), found.shape)
    part = page[row : row + small.shape[0], column : column + small.shape[1]]
    return int(row), int(column), float(np.corrcoef(small.ravel(), part.ravel())[0, 1])


@pytest.mark.parametrize("figure", [curves(), bars(), bars("stack", "stack"), heatmap()], ids=lambda one: one.name)
def test_a_figure_looks_as_matplotlib_draws_it(figure: Figure) -> None:
    with Image.open(io.BytesIO(render_png(figure, DPI))) as opened:
        drawn = np.asarray(opened.convert("L"), dtype=np.float64)
    page = read(figure).ink(1, DPI).astype(np.float64)
    _, column, alike = place(drawn, page)
    assert alike > (0.97 if figure.name == "map" else 0.85)  # thin lines and letters differ by their grey edges
    assert column == pytest.approx(38.4 * DPI / 72.0, abs=2)  # at the left margin, in full size


@pytest.mark.parametrize("hatch", ["/", "x", "."])
def test_hatches_are_those_that_matplotlib_draws(hatch: str) -> None:
    figure = Figure("b", "B", "", Axis("Condition"), Axis("Share", "%"), [Bars(["1"], [100.0], "a", hatch=hatch)])
    with Image.open(io.BytesIO(render_png(figure, DPI))) as opened:
        drawn = np.asarray(opened.convert("L"), dtype=np.float64)
    row, column = drawn.shape[0] // 2, drawn.shape[1] // 2
    inside = drawn[row - 60 : row + 60, column - 60 : column + 60]
    assert inside.std() > 10.0  # nothing but the hatched bar
    _, _, alike = place(inside, read(figure).ink(1, DPI).astype(np.float64))
    assert alike > 0.8


def test_lines_are_lines_and_letters_are_letters() -> None:
    file = read(curves())
    assert not list(file.file.pages[0].images)
    for word in ("Frequency / Hz", "Level / dB", "first", "points"):
        assert word in file.texts[0]


def test_the_title_of_the_upright_axis_reads_upwards() -> None:
    found: dict[str, tuple[float, float]] = {}

    def hear(text: str, of_page: list[float], of_text: list[float], *_: object) -> None:
        turn = np.array([[*of_text[:2]], [*of_text[2:4]]]) @ np.array([[*of_page[:2]], [*of_page[2:4]]])
        found[text.strip()] = (float(turn[0, 0]), float(turn[0, 1]))

    read(curves()).file.pages[0].extract_text(visitor_text=hear)
    assert found["Level / dB"] == pytest.approx((0.0, 1.0), abs=1e-3)
    assert found["Frequency / Hz"] == pytest.approx((1.0, 0.0), abs=1e-3)


def test_a_figure_higher_than_a_page_is_made_smaller() -> None:
    line = Line([0.0, 1.0], [0.0, 1.0], "a")
    file = read(Figure("high", "High", "Caption", Axis("Time", "s"), Axis("Level", "dB"), [line], height=1600))
    page = next(text for text in file.texts if "Time / s" in text)
    assert "Level / dB" in page and "Figure 1. High." in page


def test_a_figure_of_very_many_lines_is_a_picture_with_letters() -> None:
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 1.0, 6000)
    lines = [Line(x, rng.standard_normal(x.size), f"trace {i}") for i in range(12)]
    file = read(Figure("many", "Many", "", Axis("Time", "s"), Axis("Level", "dB"), lines))
    assert list(file.file.pages[0].images)
    assert "trace 11" in file.texts[0] and "Time / s" in file.texts[0]
    assert len(file.raw) < 3 * MOST_LINE_BYTES


def test_a_map_is_a_picture_in_its_axes() -> None:
    file = read(heatmap())
    assert len(list(file.file.pages[0].images)) >= 1
    assert "Frequency / Hz" in file.texts[0] and "coast" in file.texts[0]


def test_a_legend_longer_than_the_figure_is_cut_with_a_mark() -> None:
    file = read(spectrum("long", "name " * 80))
    assert "…" in file.texts[0]
    assert file.ink(1)[:, -36:].min() > 200
