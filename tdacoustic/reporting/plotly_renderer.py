"""Draw a `Figure` as plotly's JSON, without plotly's Python classes.

The result is a plain dictionary of ``data`` and ``layout`` that plotly.js draws as it stands.
Traces are reduced by `tdacoustic.reporting.decimate`, numbers are rounded to what a screen can
show, and every word is escaped: plotly reads a subset of HTML in its texts.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from tdacoustic.reporting.decimate import FloatArray, block_max, drawn, envelope, minmax_indices
from tdacoustic.reporting.figure import Axis, Band, Bars, Element, Figure, Heatmap, Line, Markers, Rule
from tdacoustic.reporting.layout import Label, axis_ranges, label_heights, log_ticks, place_labels, tick_text, wrapped
from tdacoustic.reporting.palette import Scheme, colour

__all__ = ["MAX_COLUMNS", "MAX_POINTS", "MAX_ROWS", "escape_text", "is_reduced", "render_plotly"]

MAX_POINTS: Final = 4000
"""Points of a trace in the page; four a pixel at the usual width."""
MAX_COLUMNS: Final = 400
MAX_ROWS: Final = 250
"""Cells of a map in the page."""

FONT: Final = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif'
NOMINAL_WIDTH: Final = 780
"""Width of the plot, in pixels, for which labels are first placed; the page's script corrects it."""

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


def is_reduced(figure: Figure, max_points: int = MAX_POINTS) -> bool:
    """Whether the page shows fewer points or cells of a figure than it has."""
    for element in figure.elements:
        if isinstance(element, Line | Band) and element.x.size > max_points:
            return True
        if isinstance(element, Heatmap) and (element.x.size > MAX_COLUMNS or element.y.size > MAX_ROWS):
            return True
    return False


def _hover(figure: Figure, name: str, detail: bool = False) -> str:
    """Text under the pointer: name, then x and y with their units."""
    lines = [f"<b>{escape_text(name)}</b>"] if name else []
    if figure.categories:
        lines.append(
            f"{escape_text(figure.x_axis.label)}: %{{customdata}} {escape_text(figure.x_axis.unit_text)}".rstrip()
        )
    else:
        lines.append(f"{escape_text(figure.x_axis.label)}: %{{x:.6~r}} {escape_text(figure.x_axis.unit_text)}".rstrip())
    lines.append(f"{escape_text(figure.y_axis.label)}: %{{y:.4~r}} {escape_text(figure.y_axis.unit_text)}".rstrip())
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
        "hovertemplate": _hover(figure, element.name, bool(element.texts)),
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


def _traces(figure: Figure, max_points: int) -> list[dict[str, Any]]:
    seen: set[str] = set()
    traces = []
    for element, slot in zip(figure.elements, figure.slots(), strict=True):
        ink = f"series-{slot}"
        if isinstance(element, Line):
            traces.append(_line(figure, element, ink, seen, max_points))
        elif isinstance(element, Band):
            traces.append(_band(figure, element, ink, max_points))
        elif isinstance(element, Markers):
            traces.append(_markers(figure, element, ink))
        elif isinstance(element, Bars):
            traces.append(_bars(figure, element, ink))
        elif isinstance(element, Heatmap):
            traces.append(_heatmap(figure, element))
    return traces


def _axis(axis: Axis, limits: tuple[float, float], room: float, grid: bool) -> dict[str, Any]:
    lines = wrapped(axis.caption, room, 6.6)
    layout: dict[str, Any] = {
        "type": axis.scale,
        "range": [float(f"{end:.8g}") for end in limits],
        "title": {"text": "<br>".join(escape_text(text) for text in lines), "standoff": 10, "font": {"size": 13}},
        "showgrid": grid,
        "gridcolor": "grid",
        "gridwidth": 1,
        "zeroline": False,
        "showline": True,
        "linecolor": "axis",
        "linewidth": 1,
        "mirror": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "axis",
        "tickfont": {"size": 12},
        "automargin": True,
        "exponentformat": "none",
        "separatethousands": False,
    }
    if axis.log:
        values = log_ticks(*limits)
        if len(values) >= 3:
            layout |= {"tickmode": "array", "tickvals": values, "ticktext": [tick_text(value) for value in values]}
    return layout


def _labels(figure: Figure) -> list[dict[str, Any]]:
    """Every label that could be drawn, in the coordinates of the axes as drawn."""
    labels: list[dict[str, Any]] = []
    for element, slot in zip(figure.elements, figure.slots(), strict=True):
        if isinstance(element, Rule) and element.label:
            x = float(drawn(np.array([element.x]), figure.x_axis.log)[0])
            labels.append({"x": x, "y": None, "text": escape_text(element.label), "color": "muted"})
        elif isinstance(element, Markers) and any(element.labels):
            xs, ys = drawn(element.x, figure.x_axis.log), drawn(label_heights(element), figure.y_axis.log)
            for x, y, text in zip(xs.tolist(), ys.tolist(), element.labels, strict=True):
                if text and math.isfinite(x) and math.isfinite(y):
                    labels.append({"x": x, "y": y, "text": escape_text(text), "color": f"series-{slot}"})
    return labels


def _annotations(figure: Figure, labels: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Labels as placed for the nominal width; the page's script places them again for the real one."""
    (x_low, x_high), (y_low, y_high) = axis_ranges(figure)
    width, height = float(NOMINAL_WIDTH), figure.height - 90.0
    pixels = [
        Label(
            (one["x"] - x_low) / (x_high - x_low) * width,
            0.0 if one["y"] is None else (y_high - one["y"]) / (y_high - y_low) * height,
            one["text"],
            rule=one["y"] is None,
        )
        for one in labels
    ]
    annotations = []
    for place in place_labels(pixels, width, height):
        one, at = labels[place.index], pixels[place.index]
        free = {"x": one["x"], "text": one["text"], "font": {"size": 11, "color": one["color"]}, "bgcolor": "label"}
        if one["y"] is None:
            shift = {"yref": "paper", "y": 1, "showarrow": False, "xshift": place.x - at.x, "yshift": -place.y}
            annotations.append(free | shift | {"yanchor": "middle"})
        else:
            tail = {"y": one["y"], "showarrow": True, "ax": place.x - at.x, "ay": place.y - at.y, "arrowhead": 0}
            line = {"arrowwidth": 0.8, "arrowcolor": one["color"] if place.leader else "rgba(0,0,0,0)", "standoff": 5}
            annotations.append(free | tail | line | {"borderpad": 1})
    return annotations


def _shapes(figure: Figure) -> list[dict[str, Any]]:
    heat = any(isinstance(element, Heatmap) for element in figure.elements)
    line = {"color": "#ffffff" if heat else "rule", "width": 1, "dash": "4px,3px"}
    return [
        {"type": "line", "xref": "x", "yref": "paper", "x0": one.x, "x1": one.x, "y0": 0, "y1": 1, "line": line}
        for one in figure.elements
        if isinstance(one, Rule)
    ]


def _legend_entries(elements: tuple[Element, ...]) -> int:
    names = {
        (element.group or element.name) if isinstance(element, Line) else element.name
        for element in elements
        if not isinstance(element, Rule | Heatmap)
    }
    return len(names)


def _layout(figure: Figure) -> dict[str, Any]:
    x_range, y_range = axis_ranges(figure)
    labels = _labels(figure)
    heat = any(isinstance(element, Heatmap) for element in figure.elements)
    x_axis = _axis(figure.x_axis, x_range, NOMINAL_WIDTH, grid=not heat and not figure.categories)
    if figure.categories:
        names = [escape_text(name) for name in figure.categories]
        x_axis |= {"tickmode": "array", "tickvals": list(range(len(names))), "ticktext": names, "ticks": ""}
    y_axis = _axis(figure.y_axis, y_range, figure.height - 70.0, grid=not heat)
    if figure.equal:  # to the right, beside the scale of a map
        x_axis |= {"constrain": "domain", "constraintoward": "right"}
        y_axis |= {"scaleanchor": "x", "scaleratio": 1, "constrain": "domain"}
    traces = [element for element in figure.elements if isinstance(element, Line | Markers | Bars)]
    sizes = [element.values.size if isinstance(element, Bars) else element.x.size for element in traces]
    few = 1 < len(traces) <= 8 and max(sizes) <= 200 and bool(figure.categories)
    return {
        "height": figure.height,
        "autosize": True,
        "margin": {"l": 60, "r": 22, "t": 30 if _legend_entries(tuple(figure.elements)) > 1 else 12, "b": 50},
        "font": {"family": FONT, "size": 12, "color": "ink"},
        "paper_bgcolor": "paper",
        "plot_bgcolor": "paper",
        "xaxis": x_axis,
        "yaxis": y_axis,
        "showlegend": _legend_entries(tuple(figure.elements)) > 1,
        "legend": {
            "orientation": "h",
            "x": 0,
            "xanchor": "left",
            "y": 1.02,
            "yanchor": "bottom",
            "traceorder": "normal",
            "bgcolor": "rgba(0,0,0,0)",
            "font": {"size": 12},
        },
        "separators": ".\u202f",
        "hovermode": "x" if few else "closest",
        "hoverdistance": 24,
        "hoverlabel": {
            "bgcolor": "paper",
            "bordercolor": "axis",
            "align": "left",
            "font": {"family": FONT, "size": 12, "color": "ink"},
        },
        "barmode": figure.bar_mode,
        "bargap": 0.32,
        "bargroupgap": 0.06,
        "dragmode": "zoom",
        "shapes": _shapes(figure),
        "annotations": _annotations(figure, labels),
        "meta": {"labels": labels},
    }


_COLOUR_KEYS: Final = frozenset(
    {"color", "fillcolor", "gridcolor", "linecolor", "tickcolor", "bgcolor", "bordercolor", "arrowcolor"}
    | {"paper_bgcolor", "plot_bgcolor"}
)


def _coloured(node: Any, scheme: Scheme) -> Any:
    """Replace the roles of colours by colours."""
    if isinstance(node, dict):
        return {
            key: (
                colour(value, scheme)
                if key in _COLOUR_KEYS and isinstance(value, str) and not value.startswith(("rgba", "#"))
                else _coloured(value, scheme)
            )
            for key, value in node.items()
        }
    if isinstance(node, list) and node and isinstance(node[0], dict):
        return [_coloured(value, scheme) for value in node]
    return node


def render_plotly(figure: Figure, scheme: Scheme = "light", max_points: int = MAX_POINTS) -> dict[str, Any]:
    """Draw a figure as plotly's JSON.

    Parameters
    ----------
    figure : Figure
        What to draw.
    scheme : {"light", "dark", "css"}
        ``"css"`` leaves colours as ``var(--role)`` for the page's script to resolve.
    max_points : int
        Points of a trace at most; its peaks are kept.

    Returns
    -------
    dict
        ``data`` and ``layout``: lists, dictionaries, strings, numbers and None only, without NaN.

    Examples
    --------
    >>> from tdacoustic.reporting.figure import Axis, Figure, Line
    >>> figure = Figure("f", "F", "", Axis("Time", "s"), Axis("Level", "dB"), [Line([0, 1], [60, float("nan")], "mic")])
    >>> render_plotly(figure)["data"][0]["y"]
    [60, None]
    """
    return {"data": _coloured(_traces(figure, max_points), scheme), "layout": _coloured(_layout(figure), scheme)}
