"""Names in a figure that matplotlib draws: its legend, and the categories below its bars, of any length and script."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.reporting.figure import Figure, Heatmap, Line, Rule
from tdacoustic.reporting.layout import cut_text, in_lines, text_columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as MatplotlibFigure

__all__ = ["LONGEST_NAME", "legend_height", "set_categories", "set_legend"]

LONGEST_NAME: Final = 48
"""Columns of the name of a category or of a place along an axis; longer ones would leave no room for the plot."""
_NAME_COLUMN, _NARROWEST_NAME, _MOST_NAME_LINES = 4.4, 48.0, 5
"""Points of a column of such a name; points beside one another that names in lines need, and their lines at most."""
_LEGEND_ROWS, _LEGEND_ROW = 3, 12.0
"""Rows of a legend that a figure has room for, and the height of one more, in points."""


def _legend_names(figure: Figure) -> list[str]:
    """What the legend says; lines of a group are named once."""
    names = []
    for element in figure.elements:
        name = "" if isinstance(element, Heatmap | Rule) else element.name
        name = (element.group or name) if isinstance(element, Line) else name
        if name and not (isinstance(element, Line) and element.group and name in names):
            names.append(name)
    return names


def _legend_shape(names: Sequence[str], width: float) -> tuple[int, int]:
    """Columns of the legend, and columns of text that a name in it may have."""
    room = width - 40
    longest = int((room - 34) / 4.6)
    widest = max((min(text_columns(name), longest) for name in names), default=0) * 4.2 + 34
    return max(1, min(len(names), int(room / widest))), longest


def legend_height(figure: Figure, width: float) -> float:
    """Return by how much a figure is higher for the rows of its legend, in points: long names stand below one another.

    Parameters
    ----------
    figure : Figure
    width : float
        Of the figure, in points.
    """
    names = _legend_names(figure)
    if len(names) < 2:
        return 0.0
    columns, _ = _legend_shape(names, width)
    return max(0, math.ceil(len(names) / columns) - _LEGEND_ROWS) * _LEGEND_ROW


def set_legend(canvas: MatplotlibFigure, axes: Axes, width: float) -> None:
    """Set the legend above the plot, its names beside one another as far as a width in points allows.

    Parameters
    ----------
    canvas : matplotlib.figure.Figure
    axes : matplotlib.axes.Axes
    width : float
    """
    handles, names = axes.get_legend_handles_labels()
    if len(names) < 2:
        return
    columns, longest = _legend_shape(names, width)
    names = [cut_text(name, longest) for name in names]
    canvas.legend(handles, names, loc="outside upper left", ncols=columns, handlelength=1.8, columnspacing=1.6)


def set_categories(axes: Axes, names: Sequence[str], width: float, height: float) -> None:
    """Set names below their bars: in lines where they are long, and turned where there are too many for that.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    names : sequence of str
    width, height : float
        Of the figure, in points.
    """
    room = (width - 60) / len(names)
    axes.tick_params(axis="x", length=0)
    places = range(len(names))
    if all((text_columns(name) + 1) * _NAME_COLUMN <= room for name in names):
        axes.set_xticks(places, names)
    elif room >= _NARROWEST_NAME:
        columns = int(room / _NAME_COLUMN) - 1
        axes.set_xticks(places, ["\n".join(in_lines(name, columns, _MOST_NAME_LINES)) for name in names])
    else:
        longest = min(LONGEST_NAME, int(0.4 * height / (_NAME_COLUMN * math.sqrt(0.5))))
        axes.set_xticks(places, [cut_text(name, longest) for name in names], rotation=45)
        for label in axes.get_xticklabels():
            label.set(ha="right", rotation_mode="anchor")
