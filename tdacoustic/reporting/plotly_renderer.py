"""Draw a `Figure` as plotly's JSON, without plotly's Python classes.

The result is a plain dictionary of ``data`` and ``layout`` that plotly.js draws as it stands.
Traces are reduced by `tdacoustic.reporting.decimate`, numbers are rounded to what a screen can
show, and every word is escaped: plotly reads a subset of HTML in its texts.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from tdacoustic.reporting.decimate import drawn
from tdacoustic.reporting.figure import Axis, Band, Bars, Element, Figure, Heatmap, Line, Markers, Rule
from tdacoustic.reporting.layout import Label, axis_ranges, label_heights, log_ticks, place_labels, tick_text, wrapped
from tdacoustic.reporting.palette import Scheme, colour
from tdacoustic.reporting.plotly_traces import MAX_COLUMNS, MAX_ROWS, escape_text, reads_out_together, traces

__all__ = ["MAX_POINTS", "is_reduced", "render_plotly"]

MAX_POINTS: Final = 4000
"""Points of a trace in the page; four a pixel at the usual width."""
FONT: Final = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif'
NOMINAL_WIDTH: Final = 780
"""Width of the plot, in pixels, for which labels are first placed; the page's script corrects it."""

_CHARACTER: Final = 6.2
"""Mean width of a character of a tick, in pixels."""
_NARROWEST_TICK: Final = 70.0
"""Room of a category below which its name is not broken into lines, in pixels."""


def is_reduced(figure: Figure, max_points: int = MAX_POINTS) -> bool:
    """Whether the page shows fewer points or cells of a figure than it has."""
    for element in figure.elements:
        if isinstance(element, Line | Band) and element.x.size > max_points:
            return True
        if isinstance(element, Heatmap) and (element.x.size > MAX_COLUMNS or element.y.size > MAX_ROWS):
            return True
    return False


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
    if axis.names:
        names = [escape_text(name) for name in axis.names]
        layout |= {"tickmode": "array", "tickvals": list(range(len(names))), "ticktext": names}
    return layout


def _read_out_place(axis: Axis) -> dict[str, Any]:
    """The head of the box that reads out all lines, and the line that shows where."""
    place = f"{escape_text(axis.label)}: %{{x:.6~r}} {escape_text(axis.unit_text)}".rstrip()
    spike = {"spikecolor": "axis", "spikethickness": 1, "spikedash": "dot", "spikemode": "across"}
    return {"unifiedhovertitle": {"text": place}, "showspikes": True, **spike}


def _category_ticks(names: tuple[str, ...]) -> dict[str, Any]:
    """Names below their bars; long ones in lines, as turned ones run out of the figure at its ends."""
    room = NOMINAL_WIDTH / len(names)
    ticks: dict[str, Any] = {"tickmode": "array", "tickvals": list(range(len(names))), "ticks": ""}
    if sum(len(name) + 2 for name in names) * _CHARACTER <= NOMINAL_WIDTH or room < _NARROWEST_TICK:
        return ticks | {"ticktext": [escape_text(name) for name in names]}
    lines = [wrapped(name, room, _CHARACTER) for name in names]
    return ticks | {"ticktext": ["<br>".join(escape_text(text) for text in held) for held in lines], "tickangle": 0}


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
        x_axis |= _category_ticks(figure.categories)
    y_axis = _axis(figure.y_axis, y_range, figure.height - 70.0, grid=not heat)
    if figure.equal:  # to the right, beside the scale of a map
        x_axis |= {"constrain": "domain", "constraintoward": "right"}
        y_axis |= {"scaleanchor": "x", "scaleratio": 1, "constrain": "domain"}
    traces = [element for element in figure.elements if isinstance(element, Line | Markers | Bars)]
    sizes = [element.values.size if isinstance(element, Bars) else element.x.size for element in traces]
    few = 1 < len(traces) <= 8 and max(sizes) <= 200 and bool(figure.categories)
    lines = any(isinstance(element, Line) for element in figure.elements)
    together = reads_out_together(figure)
    if together:
        x_axis |= _read_out_place(figure.x_axis)
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
        "hovermode": "x unified" if together else "x" if few else "closest",
        # lines alone: the nearest is read out wherever the pointer is
        "hoverdistance": -1 if lines and not together and not heat and not figure.categories else 24,
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
    {"color", "fillcolor", "gridcolor", "linecolor", "tickcolor", "bgcolor", "fgcolor", "bordercolor", "arrowcolor"}
    | {"paper_bgcolor", "plot_bgcolor", "spikecolor"}
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
    return {"data": _coloured(traces(figure, max_points), scheme), "layout": _coloured(_layout(figure), scheme)}
