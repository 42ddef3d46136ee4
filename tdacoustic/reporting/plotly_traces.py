"""The elements of a figure as plotly's traces.

Traces are reduced by `tdacoustic.reporting.decimate`, numbers are rounded to what a screen can show, and every word is
escaped: plotly reads a subset of HTML in its texts.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from tdacoustic.reporting.decimate import FloatArray, block_max, drawn, envelope, minmax_indices
from tdacoustic.reporting.figure import Band, Bars, Figure, Heatmap, Line, Markers

__all__ = ["MAX_COLUMNS", "MAX_ROWS", "escape_text", "reads_out_together", "rounded", "traces"]

MAX_COLUMNS: Final = 400
MAX_ROWS: Final = 250
"""Cells of a map in the page."""
MOST_READ_OUT: Final = 14
"""Lines and markers of which all are read out at once: as many rows as stand beside each other in a usual figure."""

_DASH: Final = {"solid": "solid", "dashed": "dash", "dotted": "dot", "steps": "solid"}
_SYMBOL: Final = {
    "circle": "circle",
    "square": "square",
    "diamond": "diamond",
    "triangle": "triangle-up",
    "cross": "cross-thin-open",
    "x": "x-thin-open",
}


def escape_text(text: str) -> str:
    """Escape a word for plotly, which reads HTML and ``%{...}`` in its texts.

    Examples
    --------
    >>> escape_text("<b>100 %{x}</b>")
    '&lt;b&gt;100 %&#123;x}&lt;/b&gt;'
    """
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return text.replace("%{", "%&#123;").replace("$", "&#36;")


def rounded(values: FloatArray, digits: int) -> list[float | int | None]:
    """Round to significant digits; NaN becomes None, whole numbers lose their ``.0``."""
    numbers = (float(f"{value:.{digits}g}") if value == value else None for value in np.ravel(values).tolist())
    return [int(n) if n is not None and n.is_integer() and abs(n) < 1e15 else n for n in numbers]


def _rounded_map(z: FloatArray) -> list[list[float | int | None]]:
    """Round a map to a two-hundredth of its range or finer, which is 0.1 dB of 20 dB."""
    finite = z[np.isfinite(z)]
    span = float(np.ptp(finite)) if finite.size else 0.0
    decimals = math.ceil(-math.log10(span / 200 * 1.0001)) if span > 0 else 6
    rows = np.round(z, decimals)
    if decimals <= 0:
        return [[int(v) if v == v else None for v in row] for row in rows.tolist()]
    return [[v if v == v else None for v in row] for row in rows.tolist()]


def reads_out_together(figure: Figure) -> bool:
    """Whether all lines are read out at the pointer's place on the x axis: few enough lines, each once over x."""
    lines = [element for element in figure.elements if isinstance(element, Line)]
    held = [element for element in figure.elements if isinstance(element, Line | Markers)]
    if not lines or len(held) > MOST_READ_OUT or figure.categories or figure.y_axis.names or figure.equal:
        return False
    if any(isinstance(element, Heatmap | Bars) for element in figure.elements):
        return False
    return all(bool(np.all(np.diff(line.x[np.isfinite(line.x)]) >= 0.0)) for line in lines)


def _is_of_strokes(line: Line) -> bool:
    """Whether a line is upright strokes with gaps between them: stems, ranges."""
    steps = np.diff(line.x)
    steps = steps[np.isfinite(steps) & np.isfinite(line.y[1:] - line.y[:-1])]
    return bool(steps.size and np.all(steps == 0.0))


def _read_out(figure: Figure, name: str, detail: bool, own_place: bool) -> str:
    """A row of the box that reads out all lines; what is not drawn at each x says its own."""
    place = f"%{{x:.6~r}} {escape_text(figure.x_axis.unit_text)}".rstrip() + ", " if own_place else ""
    value = f"{place}%{{y:.4~r}} {escape_text(figure.y_axis.unit)}".rstrip()  # its reference stands at the axis
    row = f"{escape_text(name)}: {value}" if name else value
    return row + ("<br>%{hovertext}" if detail else "") + "<extra></extra>"


def _hover(figure: Figure, name: str, detail: bool = False, own_place: bool = False) -> str:
    """Text under the pointer: name, then x and y with their units."""
    if reads_out_together(figure):
        return _read_out(figure, name, detail, own_place)
    lines = [f"<b>{escape_text(name)}</b>"] if name else []
    if figure.categories:
        lines.append(
            f"{escape_text(figure.x_axis.label)}: %{{customdata}} {escape_text(figure.x_axis.unit_text)}".rstrip()
        )
    else:
        lines.append(f"{escape_text(figure.x_axis.label)}: %{{x:.6~r}} {escape_text(figure.x_axis.unit_text)}".rstrip())
    place = "%{y}" if figure.y_axis.names else "%{y:.4~r}"
    lines.append(f"{escape_text(figure.y_axis.label)}: {place} {escape_text(figure.y_axis.unit_text)}".rstrip())
    if detail:
        lines.append("%{hovertext}")
    return "<br>".join(lines) + "<extra></extra>"


def _legend(figure: Figure, element: Line, seen: set[str]) -> dict[str, Any]:
    if element.group is None:
        return {"name": escape_text(element.name)}
    first = element.group not in seen
    seen.add(element.group)
    return {"name": escape_text(element.group), "legendgroup": escape_text(element.group), "showlegend": first}


def _line(figure: Figure, element: Line, ink: str, seen: set[str], max_points: int) -> dict[str, Any]:
    log, limits = figure.x_axis.log, figure.x_axis.limits
    kept = minmax_indices(element.x, element.y, max_points, log, limits)
    y = np.where(element.y[kept] > 0, element.y[kept], np.nan) if figure.y_axis.log else element.y[kept]
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers" if kept.size <= 1 else "lines+markers" if element.points else "lines",
        "x": rounded(element.x[kept], 7),
        "y": rounded(y, 6),
        "line": {
            "color": ink,
            "width": element.stroke,
            "dash": _DASH[element.style],
            "shape": "hvh" if element.style == "steps" else "linear",
        },
        "opacity": element.opacity,
        "connectgaps": False,
        "hovertemplate": _hover(figure, element.name),
        **_legend(figure, element, seen),
    }
    if element.points:
        trace["marker"] = {"color": ink, "size": 7, "line": {"width": 1, "color": "paper"}}
    if figure.categories:
        trace["customdata"] = _category_names(figure, element.x[kept])
    over_a_map = any(isinstance(one, Heatmap) for one in figure.elements)
    if over_a_map or (reads_out_together(figure) and _is_of_strokes(element)):
        # asked for is the level of the map, or the points at the strokes' ends; legend and labels name the line
        del trace["hovertemplate"]
        trace["hoverinfo"] = "skip"
    return trace


def _category_names(figure: Figure, x: FloatArray) -> list[str]:
    names = figure.categories
    nearest = np.rint(np.nan_to_num(x)).astype(int).tolist()
    return [escape_text(names[i]) if 0 <= i < len(names) else "" for i in nearest]


def _band(figure: Figure, element: Band, ink: str, max_points: int) -> dict[str, Any]:
    """One closed outline for each stretch without a gap."""
    x, lower, upper = envelope(
        element.x, element.lower, element.upper, max_points // 2, figure.x_axis.log, figure.x_axis.limits
    )
    if figure.y_axis.log:
        lower, upper = (np.where(edge > 0, edge, np.nan) for edge in (lower, upper))
    good = np.isfinite(x) & np.isfinite(lower) & np.isfinite(upper)
    edge = np.flatnonzero(np.diff(np.r_[False, good, False].astype(np.int8)))
    xs, ys = [], []
    for start, stop in zip(edge[::2], edge[1::2], strict=True):
        xs += [x[start:stop], x[start:stop][::-1], np.array([np.nan])]
        ys += [upper[start:stop], lower[start:stop][::-1], np.array([np.nan])]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": rounded(np.concatenate(xs or [np.zeros(0)]), 7),
        "y": rounded(np.concatenate(ys or [np.zeros(0)]), 6),
        "fill": "toself",
        "fillcolor": ink,
        "line": {"width": 0, "color": ink},
        "opacity": 0.22,
        "hoverinfo": "skip",
        "name": escape_text(element.name),
    }


def _markers(figure: Figure, element: Markers, ink: str) -> dict[str, Any]:
    thin = element.symbol in ("cross", "x")
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers",
        "x": rounded(element.x, 7),
        "y": rounded(element.y, 6),
        "marker": {
            "color": ink,
            "size": 8,
            "symbol": _SYMBOL[element.symbol],
            "line": {"width": 1.6 if thin else 1, "color": ink if thin else "paper"},
        },
        "hovertemplate": _hover(figure, element.name, bool(element.texts), own_place=True),
        "name": escape_text(element.name),
    }
    if element.texts:
        trace["hovertext"] = [escape_text(text).replace("\n", "<br>") for text in element.texts]
    if element.errors is not None:
        trace["error_y"] = _error_bars(element.errors, ink)
    if figure.categories:
        trace["customdata"] = _category_names(figure, element.x)
    return trace


def _error_bars(errors: FloatArray, ink: str) -> dict[str, Any]:
    look = {"color": ink, "thickness": 1.2, "width": 4}
    if errors.ndim == 2:
        below, above = errors
        return {
            "type": "data",
            "symmetric": False,
            "array": rounded(above, 4),
            "arrayminus": rounded(below, 4),
            **look,
        }
    return {"type": "data", "array": rounded(errors, 4), **look}


def _bars(figure: Figure, element: Bars, ink: str) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "type": "bar",
        "x": list(range(len(element.categories))),
        "y": rounded(element.values, 6),
        "marker": {"color": ink},
        "customdata": [escape_text(category) for category in element.categories],
        "hovertemplate": _hover(figure, element.name),
        "name": escape_text(element.name),
    }
    if element.hatch is not None:
        strokes = {"shape": element.hatch, "bgcolor": ink, "fgcolor": "paper", "size": 9, "solidity": 0.18}
        trace["marker"]["pattern"] = strokes
    if element.errors is not None:
        trace["error_y"] = _error_bars(element.errors, "ink")
    return trace


def _heatmap(figure: Figure, element: Heatmap) -> dict[str, Any]:
    log_x, log_y = figure.x_axis.log, figure.y_axis.log
    x, y, z = block_max(element.x, element.y, element.z, MAX_COLUMNS, MAX_ROWS, log_x, log_y)
    axis = element.z_axis
    z = drawn(z, axis.log)
    trace: dict[str, Any] = {
        "type": "heatmap",
        "x": rounded(x, 6),
        "y": rounded(y, 6),
        "z": _rounded_map(z),
        "colorscale": "Viridis",
        "colorbar": {
            "title": {"text": escape_text(("lg " if axis.log else "") + axis.caption), "side": "right"},
            "thickness": 14,
            "outlinewidth": 0,
            "tickcolor": "axis",
            "ticks": "outside",
            "ticklen": 4,
            "len": 1.0,
            "xpad": 8,
            "ypad": 0,
        },
        "hovertemplate": (
            f"<b>{escape_text(element.name)}</b><br>"
            f"{escape_text(figure.x_axis.label)}: %{{x:.6~r}} {escape_text(figure.x_axis.unit_text)}<br>"
            f"{escape_text(figure.y_axis.label)}: %{{y:.6~r}} {escape_text(figure.y_axis.unit_text)}<br>"
            f"{escape_text(axis.label)}: %{{z:.4~r}} {escape_text(axis.unit_text)}<extra></extra>"
        ),
        "hoverongaps": False,
        "name": escape_text(element.name),
        "showscale": True,
    }
    if axis.limits is not None:
        low, high = drawn(np.array(axis.limits), axis.log).tolist()
        trace |= {"zmin": low, "zmax": high}
    return trace


def traces(figure: Figure, max_points: int) -> list[dict[str, Any]]:
    """Return the traces of a figure, colours by their role; rules are no traces.

    Parameters
    ----------
    figure : Figure
    max_points : int
        Points of a trace at most.
    """
    seen: set[str] = set()
    found = []
    for element, slot in zip(figure.elements, figure.slots(), strict=True):
        ink = f"series-{slot}"
        if isinstance(element, Line):
            found.append(_line(figure, element, ink, seen, max_points))
        elif isinstance(element, Band):
            found.append(_band(figure, element, ink, max_points))
        elif isinstance(element, Markers):
            found.append(_markers(figure, element, ink))
        elif isinstance(element, Bars):
            found.append(_bars(figure, element, ink))
        elif isinstance(element, Heatmap):
            found.append(_heatmap(figure, element))
    return found
