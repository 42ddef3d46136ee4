"""Draw a `Figure` with matplotlib: pictures for print, for files and for notebooks.

Only matplotlib's object interface is used, so nothing is left behind in its global state but the name of the font for
Chinese, which no other program asks for. The same figure gives the same bytes.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from tdacoustic.reporting.decimate import FloatArray, block_max, drawn, minmax_indices
from tdacoustic.reporting.figure import Axis, Band, Bars, Figure, Heatmap, Line, Markers, ReportError, Rule
from tdacoustic.reporting.layout import (
    COLUMN_WIDTH,
    Label,
    axis_ranges,
    cell_edges,
    cut_text,
    figure_width,
    label_heights,
    log_ticks,
    place_labels,
    tick_text,
    wrapped,
)
from tdacoustic.reporting.matplotlib_names import LONGEST_NAME, legend_height, set_categories, set_legend
from tdacoustic.reporting.matplotlib_style import drawing_style
from tdacoustic.reporting.palette import colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase
    from matplotlib.figure import Figure as MatplotlibFigure

__all__ = ["draw_with", "is_thinned", "plot", "printed_size", "render_png", "render_svg"]

WIDTH_IN: Final = 7.2
"""Width of a printed figure: the text width of a page of A4."""
POINTS_PER_PIXEL: Final = 72.0 * (WIDTH_IN / COLUMN_WIDTH)
"""A figure as wide as the page's column is printed `WIDTH_IN` wide."""
MAX_POINTS: Final = 6000
MAX_CELLS: Final = (800, 500)
"""Cells of a map along x and y; each shows the maximum of those it stands for."""

_DASH: Final[dict[str, Any]] = {"solid": "-", "dashed": (0, (5, 2.5)), "dotted": (0, (1.2, 1.8)), "steps": "-"}
_SYMBOL: Final = {"circle": "o", "square": "s", "diamond": "D", "triangle": "^", "cross": "+", "x": "x"}


def _steps(x: FloatArray, y: FloatArray, log: bool) -> tuple[FloatArray, FloatArray]:
    """Corners of a trace that is level around each x, as drawn."""
    edges = cell_edges(x, log)
    if edges.size != x.size + 1:
        return x, y
    return np.repeat(edges, 2)[1:-1], np.repeat(y, 2)


def _draw_line(axes: Axes, figure: Figure, line: Line, ink: str, label: str) -> None:
    kept = minmax_indices(line.x, line.y, MAX_POINTS, figure.x_axis.log, figure.x_axis.limits)
    x, y = line.x[kept], line.y[kept]
    if line.style == "steps":
        x, y = _steps(x, y, figure.x_axis.log)
    marker = "o" if kept.size == 1 or line.points else None
    axes.plot(
        x,
        y,
        color=ink,
        linewidth=line.stroke * 0.72,
        linestyle=_DASH[line.style],
        alpha=line.opacity,
        label=label,
        marker=marker,
        markersize=3,
    )


def _draw_markers(axes: Axes, markers: Markers, ink: str) -> None:
    thin = markers.symbol in ("cross", "x")
    axes.errorbar(
        markers.x,
        markers.y,
        yerr=markers.errors,
        linestyle="none",
        marker=_SYMBOL[markers.symbol],
        markersize=4.5,
        color=ink,
        markeredgecolor=ink if thin else colour("paper"),
        markeredgewidth=1.0 if thin else 0.5,
        elinewidth=0.8,
        capsize=2,
        label=markers.name,
        zorder=4,
    )


def _draw_bars(axes: Axes, figure: Figure, inks: dict[int, str]) -> None:
    bars = [(i, element) for i, element in enumerate(figure.elements) if isinstance(element, Bars)]
    if not bars:
        return
    places = np.arange(len(figure.categories), dtype=np.float64)
    error = {"elinewidth": 0.8, "capsize": 2, "ecolor": colour("ink")}
    whole = 0.68
    above, below = np.zeros(places.size), np.zeros(places.size)
    for number, (index, bar) in enumerate(bars):
        heights = np.nan_to_num(bar.values)
        if figure.bar_mode == "stack":
            bottom = np.where(heights >= 0, above, below)
            axes.bar(places, heights, whole, bottom, yerr=bar.errors, error_kw=error, **_look(bar, inks[index]))
            above, below = above + np.maximum(heights, 0), below + np.minimum(heights, 0)
            continue
        wide = whole / len(bars)
        at = places - whole / 2 + (number + 0.5) * wide
        axes.bar(at, heights, wide * 0.94, yerr=bar.errors, error_kw=error, **_look(bar, inks[index]))


def _look(bar: Bars, ink: str) -> dict[str, Any]:
    """Name, colour and strokes of bars; an edge without width gives the strokes their colour."""
    look: dict[str, Any] = {"label": bar.name, "color": ink}
    if bar.hatch is not None:
        look |= {"hatch": 2 * bar.hatch, "edgecolor": colour("paper"), "linewidth": 0.0}
    return look


def _draw_heatmap(axes: Axes, figure: Figure, heat: Heatmap, coarse: bool) -> None:
    log_x, log_y = figure.x_axis.log, figure.y_axis.log
    columns, rows = (300, 200) if coarse else MAX_CELLS
    x, y, z = block_max(heat.x, heat.y, heat.z, columns, rows, log_x, log_y)
    z = drawn(z, heat.z_axis.log)
    limits = drawn(np.array(heat.z_axis.limits), heat.z_axis.log) if heat.z_axis.limits else (None, None)
    mesh = axes.pcolormesh(
        cell_edges(x, log_x), cell_edges(y, log_y), z, cmap="viridis", vmin=limits[0], vmax=limits[1], rasterized=True
    )
    bar = axes.figure.colorbar(mesh, ax=axes, pad=0.015, aspect=28)
    bar.outline.set_visible(False)
    bar.set_label(("lg " if heat.z_axis.log else "") + heat.z_axis.caption)


def _draw_elements(axes: Axes, figure: Figure, coarse: bool) -> None:
    slots = figure.slots()
    inks = {index: colour(f"series-{slot}") for index, slot in enumerate(slots) if slot is not None}
    heat = any(isinstance(element, Heatmap) for element in figure.elements)
    seen: set[str] = set()
    _draw_bars(axes, figure, inks)
    for index, element in enumerate(figure.elements):
        if isinstance(element, Line):
            label = element.group or element.name
            _draw_line(axes, figure, element, inks[index], "_again" if element.group in seen else label)
            seen |= {element.group} if element.group else set()
        elif isinstance(element, Band):
            axes.fill_between(
                element.x, element.lower, element.upper, color=inks[index], alpha=0.22, linewidth=0, label=element.name
            )
        elif isinstance(element, Markers):
            _draw_markers(axes, element, inks[index])
        elif isinstance(element, Heatmap):
            _draw_heatmap(axes, figure, element, coarse)
        elif isinstance(element, Rule):
            axes.axvline(
                element.x,
                color=colour("paper") if heat else colour("rule"),
                linewidth=0.7,
                linestyle=(0, (4, 3)),
                zorder=1.5,
            )


def _set_axis(axes: Axes, axis: Axis, which: str, limits: tuple[float, float], room: float) -> None:
    """Scale, ticks, limits and title of an axis; `room` in points for the title."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    one = axes.xaxis if which == "x" else axes.yaxis
    if axis.log:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
        values = log_ticks(*limits)
        if len(values) >= 3:
            one.set_major_locator(FixedLocator(values))
            one.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value)))
            one.set_minor_locator(NullLocator())
    if axis.names:
        one.set_ticks(range(len(axis.names)), [cut_text(name, LONGEST_NAME) for name in axis.names])
    ends = tuple(10.0**end for end in limits) if axis.log else limits
    (axes.set_xlim if which == "x" else axes.set_ylim)(*ends)
    (axes.set_xlabel if which == "x" else axes.set_ylabel)("\n".join(wrapped(axis.caption, room, 4.3)))


def _draw_labels(canvas: MatplotlibFigure, axes: Axes, figure: Figure) -> None:
    """Place the labels once the size of the axes is settled."""
    found: list[tuple[float, float, str, str, bool]] = []
    for element, slot in zip(figure.elements, figure.slots(), strict=True):
        if isinstance(element, Rule) and element.label:
            found.append((element.x, 0.0, element.label, colour("muted"), True))
        elif isinstance(element, Markers) and any(element.labels):
            ink = colour(f"series-{slot}")
            found += [
                (x, y, text, ink, False)
                for x, y, text in zip(element.x.tolist(), label_heights(element).tolist(), element.labels, strict=True)
                if text and math.isfinite(x) and math.isfinite(y) and (y > 0 or not figure.y_axis.log)
            ]
    if not found:
        return
    canvas.get_layout_engine().execute(canvas)  # type: ignore[union-attr]
    axes.apply_aspect()
    canvas.set_layout_engine("none")
    box = axes.get_window_extent()
    points = canvas.dpi / 72
    labels = []
    for x, y, text, _, rule in found:
        across, up = axes.transData.transform((x, y if not rule else axes.get_ylim()[1]))
        labels.append(Label((across - box.x0) / points, 0.0 if rule else (box.y1 - up) / points, text, rule))
    placed = place_labels(labels, box.width / points, box.height / points, char=4.1, line=10.0)
    for place in placed:
        x, y, text, ink, rule = found[place.index]
        at = labels[place.index]
        axes.annotate(
            text,
            xy=(x, y) if not rule else (x, 1.0),
            xycoords="data" if not rule else ("data", "axes fraction"),
            xytext=(place.x - at.x, at.y - place.y),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=6.8,
            color=ink,
            bbox={"boxstyle": "square,pad=0.12", "facecolor": "white", "alpha": 0.82, "linewidth": 0},
            arrowprops={"arrowstyle": "-", "linewidth": 0.5, "color": ink, "shrinkA": 0, "shrinkB": 3}
            if place.leader
            else None,
            zorder=5,
            annotation_clip=False,
        )


def printed_size(figure: Figure) -> tuple[float, float]:
    """Return how wide and high a figure is printed, in points (1/72 inch): `WIDTH_IN` and what its height makes of it.

    It is higher where its legend has many rows.

    Parameters
    ----------
    figure : Figure
    """
    width, height = (POINTS_PER_PIXEL * pixels for pixels in (figure_width(figure), figure.height))
    return width, height + legend_height(figure, width)


def _draw(figure: Figure, title: bool, coarse: bool = False) -> MatplotlibFigure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as MatplotlibFigure

    class NotebookFigure(MatplotlibFigure):
        """A figure that a notebook shows by itself."""

        def _repr_png_(self) -> bytes:
            with drawing_style():
                return _png(self, 150)

    width, height = printed_size(figure)
    canvas = NotebookFigure(figsize=(width / 72.0, height / 72.0), layout="constrained")
    FigureCanvasAgg(canvas)
    canvas.get_layout_engine().set(w_pad=0.05, h_pad=0.04)  # type: ignore[union-attr, call-arg]
    axes = canvas.add_subplot()
    _draw_elements(axes, figure, coarse)
    x_range, y_range = axis_ranges(figure)
    _set_axis(axes, figure.x_axis, "x", x_range, width - 60)
    _set_axis(axes, figure.y_axis, "y", y_range, POINTS_PER_PIXEL * figure.height - 44)
    if figure.equal:
        axes.set_aspect("equal", adjustable="box")
    heat = any(isinstance(element, Heatmap) for element in figure.elements)
    axes.grid(not heat, axis="y" if figure.categories else "both")
    if figure.categories:
        set_categories(axes, figure.categories, width, height)
    if title:
        axes.set_title(figure.title, loc="left", fontsize=8.5, fontweight="bold")
    set_legend(canvas, axes, width)
    _draw_labels(canvas, axes, figure)
    return canvas


def _png(canvas: MatplotlibFigure, dpi: int, colours: int | None = None) -> bytes:
    packed = io.BytesIO()
    if colours is None:
        canvas.savefig(packed, format="png", dpi=dpi, metadata={"Software": None}, facecolor="white")
        return packed.getvalue()
    from PIL import Image  # comes with matplotlib

    canvas.set_dpi(dpi)
    canvas.set_facecolor("white")
    canvas.canvas.draw()  # `savefig` draws twice, and packs a picture that would only be unpacked again
    with Image.fromarray(np.asarray(canvas.canvas.buffer_rgba())) as image:  # type: ignore[attr-defined]
        small = image.convert("RGB").quantize(colours, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    small.save(packed, format="png", compress_level=6)  # `optimize` takes six times as long for a tenth of the bytes
    return packed.getvalue()


def render_png(figure: Figure, dpi: int = 200, colours: int | None = None) -> bytes:
    """Draw a figure as a PNG, 7.2 inches wide; a map with equal axes as wide as its shape needs.

    Parameters
    ----------
    figure : Figure
        What to draw.
    dpi : int
        Pixels an inch.
    colours : int, optional
        Reduce to a palette of so many colours (at most 256): about a third of the bytes.
        Maps are then drawn with 300 by 200 cells at most.

    Returns
    -------
    bytes
        The same for the same figure, matplotlib and Pillow.
    """
    with drawing_style():
        return _png(_draw(figure, title=False, coarse=colours is not None), dpi, colours)


def render_svg(figure: Figure) -> str:
    """Draw a figure as SVG text, the letters as outlines; maps are embedded as pictures."""
    raw = io.BytesIO()
    with drawing_style():
        canvas = _draw(figure, title=False)
        canvas.savefig(raw, format="svg", dpi=200, metadata={"Date": None, "Creator": None})
    return raw.getvalue().decode("utf-8")


def is_thinned(figure: Figure) -> bool:
    """Whether a figure is drawn with fewer points or cells than its data have; maxima are kept.

    Parameters
    ----------
    figure : Figure
    """
    lines = any(isinstance(one, Line) and one.x.size > MAX_POINTS for one in figure.elements)
    maps = [one for one in figure.elements if isinstance(one, Heatmap)]
    return lines or any(one.x.size > MAX_CELLS[0] or one.y.size > MAX_CELLS[1] for one in maps)


def draw_with(figure: Figure, renderer: RendererBase, dpi: int, lines: bool = True) -> None:
    """Draw a figure with a renderer of matplotlib's whose pixels are points; maps reach it as pictures.

    Parameters
    ----------
    figure : Figure
    renderer : matplotlib.backend_bases.RendererBase
        Of a canvas of `printed_size`.
    dpi : int
        Pixels an inch of these pictures.
    lines : bool
        Whether lines and bands reach it as such; else they are pictures too.
    """
    from matplotlib.backends.backend_mixed import MixedModeRenderer

    with drawing_style():
        canvas = _draw(figure, title=False)
        for artist in () if lines else (*canvas.axes[0].lines, *canvas.axes[0].collections):
            artist.set_rasterized(True)
        canvas.set_dpi(72)
        width, height = canvas.get_size_inches()
        canvas.patch.set_visible(False)
        canvas.draw(cast(Any, MixedModeRenderer(canvas, width, height, dpi, renderer)))


def plot(figure: Figure, path: str | Path | None = None) -> MatplotlibFigure:
    """Draw a figure for a notebook, or into a file.

    Parameters
    ----------
    figure : Figure
        What to draw.
    path : path, optional
        Where to write it as well: ``.png``, ``.svg`` or ``.pdf``.

    Returns
    -------
    matplotlib.figure.Figure
        With its title; a notebook shows it as it stands, and it can be changed before it is saved.

    Raises
    ------
    ReportError
        The path ends in something else.

    Examples
    --------
    >>> from tdacoustic.reporting.figure import Axis, Figure, Line
    >>> figure = Figure("f", "Level", "", Axis("Time", "s"), Axis("Level", "dB"), [Line([0, 1], [60, 61], "mic_1")])
    >>> plot(figure).axes[0].get_title(loc="left")
    'Level'
    """
    suffix = Path(path).suffix.lower() if path is not None else ".png"
    if suffix not in (".png", ".svg", ".pdf"):
        raise ReportError(f"a figure is written as .png, .svg or .pdf, got {path}")
    with drawing_style():
        canvas = _draw(figure, title=True)
        if path is not None:
            stamp = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}[suffix]
            canvas.savefig(path, dpi=200, facecolor="white", metadata=stamp)
    return canvas
