"""Where things go on a figure: ranges, ticks and labels, the same for both renderers."""

from __future__ import annotations

import math
import textwrap
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from tdacoustic.reporting.decimate import FloatArray, drawn
from tdacoustic.reporting.figure import Band, Bars, Figure, Heatmap, Line, Markers, Rule

__all__ = [
    "COLUMN_WIDTH",
    "Label",
    "Placed",
    "axis_ranges",
    "cell_edges",
    "cut_text",
    "figure_width",
    "in_lines",
    "label_heights",
    "log_ticks",
    "place_labels",
    "text_columns",
    "tick_text",
    "wrapped",
]

COLUMN_WIDTH: Final = 900
"""Pixels that a figure is wide in the page where there is room."""
_BESIDE, _ABOVE_AND_BELOW, _SCALE, _NARROWEST = 92, 90, 92, 420
"""Pixels beside the plot and above and below it, for the scale of a map, and of the narrowest figure [assumed]."""


def figure_width(figure: Figure) -> int:
    """Return how wide a figure is drawn, in pixels: the column, and of a map with equal axes what its shape needs.

    Parameters
    ----------
    figure : Figure
    """
    if not figure.equal:
        return COLUMN_WIDTH
    (left, right), (bottom, top) = axis_ranges(figure)
    plot = (figure.height - _ABOVE_AND_BELOW) * (right - left) / (top - bottom)
    scale = _SCALE if any(isinstance(element, Heatmap) for element in figure.elements) else 0
    return int(min(max(plot + _BESIDE + scale, _NARROWEST), COLUMN_WIDTH))


def _x_values(figure: Figure) -> list[FloatArray]:
    values = []
    for element in figure.elements:
        if isinstance(element, Line | Band | Markers):
            values.append(element.x)
        elif isinstance(element, Heatmap):
            values.append(cell_edges(element.x, figure.x_axis.log))
    return values


def _y_values(figure: Figure, x_range: tuple[float, float]) -> list[FloatArray]:
    """Everything drawn along y, where x is in the range shown."""
    low, high = (10.0**end for end in x_range) if figure.x_axis.log else x_range
    values: list[FloatArray] = []
    for element in figure.elements:
        if isinstance(element, Rule | Bars):
            continue
        if isinstance(element, Heatmap):
            values.append(cell_edges(element.y, figure.y_axis.log))
            continue
        inside = (element.x >= low) & (element.x <= high)
        if isinstance(element, Band):
            values += [element.lower[inside], element.upper[inside]]
        elif isinstance(element, Markers) and element.errors is not None:
            values += [(element.y + side * np.nan_to_num(element.errors))[inside] for side in (-1, 1)]
        else:
            values.append(element.y[inside])
    values += _bar_ends(figure)
    return values


def _bar_ends(figure: Figure) -> list[FloatArray]:
    bars = [element for element in figure.elements if isinstance(element, Bars)]
    if not bars:
        return []
    heights = [np.nan_to_num(bar.values) for bar in bars]
    if figure.bar_mode == "stack":
        heights = [np.sum(np.maximum(heights, 0.0), axis=0), np.sum(np.minimum(heights, 0.0), axis=0)]
    errors = []
    for bar in bars:
        if bar.errors is not None:
            below, above = np.broadcast_to(np.nan_to_num(bar.errors), (2, bar.values.size))
            errors += [bar.values - below, bar.values + above]
    return [*heights, *errors, np.zeros(0 if figure.y_axis.log else 1)]


def _extent(values: Sequence[FloatArray], log: bool) -> tuple[float, float]:
    positions = [drawn(np.ravel(v), log) for v in values]
    finite = np.concatenate([p[np.isfinite(p)] for p in positions] or [np.zeros(0)])
    if finite.size == 0:
        return (0.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    if high > low:
        return low, high
    half = 0.5 if log else max(abs(low) * 0.05, 0.5)
    return low - half, high + half


def axis_ranges(figure: Figure) -> tuple[tuple[float, float], tuple[float, float]]:
    """Range of x and of y as drawn: decadic logarithms on a logarithmic axis.

    Limits of an axis win. Traces and maps fill the width; points, bars and anything along y
    are given some air, and labelled figures room for their labels.
    """
    heat = any(isinstance(e, Heatmap) for e in figure.elements)
    labelled = any(
        (isinstance(e, Markers) and any(e.labels)) or (isinstance(e, Rule) and e.label) for e in figure.elements
    )
    bars = bool(figure.categories)
    if figure.x_axis.limits is not None:
        x_low, x_high = (float(v) for v in drawn(np.array(figure.x_axis.limits), figure.x_axis.log))
    elif bars:
        x_low, x_high = -0.5, len(figure.categories) - 0.5
    else:
        x_low, x_high = _extent(_x_values(figure), figure.x_axis.log)
        widest = any(isinstance(e, Line | Band | Heatmap) and e.x.size > 50 for e in figure.elements)
        pad = 0.0 if widest or heat else 0.03 * (x_high - x_low)
        x_low, x_high = x_low - pad, x_high + pad
    if figure.y_axis.limits is not None:
        y_low, y_high = (float(v) for v in drawn(np.array(figure.y_axis.limits), figure.y_axis.log))
    else:
        y_low, y_high = _extent(_y_values(figure, (x_low, x_high)), figure.y_axis.log)
        span = y_high - y_low
        if not heat:
            y_high += (0.16 if labelled else 0.06) * span
            y_low -= 0.0 if bars and y_low == 0.0 and not figure.y_axis.log else 0.05 * span
    return (x_low, x_high), (y_low, y_high)


def cell_edges(centres: FloatArray, log: bool) -> FloatArray:
    """Edges of cells halfway between their centres, as drawn; shape (n + 1,) for the n drawable centres."""
    position = drawn(centres, log)
    position = position[np.isfinite(position)]
    if position.size < 2:
        return np.asarray(10.0**position if log else position)
    middle = (position[1:] + position[:-1]) / 2
    edges = np.r_[2 * position[0] - middle[0], middle, 2 * position[-1] - middle[-1]]
    return np.asarray(10.0**edges if log else edges)


def tick_text(value: float) -> str:
    """Write a tick's value: thousands apart by a narrow space, powers of ten where it gets long.

    Examples
    --------
    >>> tick_text(31.5), tick_text(2000.0), tick_text(1e-7)
    ('31.5', '2000', '1e-7')
    """
    if value >= 1e6 or value < 1e-4:
        return f"{value:.0e}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
    if value >= 10_000:
        return f"{value:,.0f}".replace(",", "\u202f")
    return f"{value:g}"


def wrapped(caption: str, room: float, char: float) -> list[str]:
    """Break an axis title into lines of at most ``room`` pixels, at ``char`` pixels a character.

    Examples
    --------
    >>> wrapped("Level / dB re 20 uPa (density, per Hz)", 150, 6.0)
    ['Level / dB re 20 uPa', '(density, per Hz)']
    """
    columns = max(12, int(room / char))
    parts = [caption] if len(caption) <= columns else caption.replace(" (", "\n(", 1).split("\n")
    return [line for part in parts for line in textwrap.wrap(part, columns, break_long_words=False)] or [""]


def cut_text(text: str, columns: int) -> str:
    """Return a text of at most so many columns, with a mark where it is cut; Chinese signs take two.

    Examples
    --------
    >>> cut_text("a very long name of a channel", 12), cut_text("short", 12)
    ('a very long…', 'short')
    """
    taken = 0
    for place, sign in enumerate(text):
        taken += text_columns(sign)
        if taken > columns:
            return f"{text[: place - 1]}…"
    return text


def text_columns(text: str) -> int:
    """Return how many columns a text takes; Chinese signs take two.

    Examples
    --------
    >>> text_columns("mic"), text_columns("麦克")
    (3, 4)
    """
    return sum(2 if unicodedata.east_asian_width(sign) in "WF" else 1 for sign in text)


def in_lines(text: str, columns: int, most: int) -> list[str]:
    """Break a text into lines of so many columns, within words where these are longer; the last one allowed is cut.

    Examples
    --------
    >>> in_lines("pinion bearing stiffness", 10, 3), in_lines("Getriebegehaeuse", 10, 3), in_lines("a b c d", 1, 2)
    (['pinion', 'bearing', 'stiffness'], ['Getriebege', 'haeuse'], ['a', '…'])
    """
    lines = [""]
    for word in text.split():
        joined = f"{lines[-1]} {word}".strip()
        if text_columns(joined) <= columns:
            lines[-1] = joined
            continue
        lines += [""] if lines[-1] else []
        for sign in word:
            lines += [""] if text_columns(lines[-1] + sign) > columns and lines[-1] else []
            lines[-1] += sign
    if len(lines) <= most:
        return lines
    return [*lines[: most - 1], cut_text(f"{lines[most - 1]}{lines[most]}", columns)]


def label_heights(markers: Markers) -> FloatArray:
    """Where the label of each point starts along y: its value, or the upper end of its error bar."""
    return markers.y if markers.errors is None else markers.y + np.nan_to_num(markers.errors)


def log_ticks(low: float, high: float) -> list[float]:
    """Ticks at 1, 2 and 5 (over more than four decades: at 1) between two decadic logarithms.

    Examples
    --------
    >>> log_ticks(1.3, 3.0)
    [20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    """
    digits = (1, 2, 5) if high - low <= 4 else (1,)
    powers = range(math.floor(low), math.ceil(high) + 1)
    values = [float(f"{digit}e{power}") for power in powers for digit in digits]
    return [value for value in values if low - 1e-6 <= math.log10(value) <= high + 1e-6]


@dataclass(frozen=True)
class Label:
    """A word to draw at a point: position in pixels from the plot's left and top edge."""

    x: float
    y: float
    text: str
    rule: bool = False


@dataclass(frozen=True)
class Placed:
    """Where a label goes: index of the label, centre of its box in pixels, and whether it needs a leader."""

    index: int
    x: float
    y: float
    leader: bool


def place_labels(
    labels: Sequence[Label], width: float, height: float, char: float = 6.2, line: float = 15.0, levels: int = 5
) -> list[Placed]:
    """Place labels so that none covers another or another's point; those without room are left out.

    Labels of rules hang from the top edge beside their rule; labels of points stand above them,
    highest point first, are lifted in steps of ``line`` where the place is taken, or stand beside
    their point. The page's script does the same again whenever a figure is zoomed or resized.

    Parameters
    ----------
    labels : sequence of Label
        What to place.
    width, height : float
        Of the plot, in pixels.
    char, line : float
        Mean width of a character and height of a line.
    levels : int
        How often a label may be lifted.
    """
    boxes: list[tuple[float, float, float, float]] = []
    points = [(one.x, one.y, index) for index, one in enumerate(labels) if not one.rule]
    placed: list[Placed] = []

    def free(box: tuple[float, float, float, float], own: int) -> bool:
        return all(box[2] <= b[0] or box[0] >= b[2] or box[3] <= b[1] or box[1] >= b[3] for b in boxes) and not any(
            box[0] - 3 < x < box[2] + 3 and box[1] - 3 < y < box[3] + 3 for x, y, index in points if index != own
        )

    shown = [i for i, one in enumerate(labels) if one.text and -1 <= one.x <= width + 1 and -1 <= one.y <= height + 1]
    for index in sorted(shown, key=lambda i: (not labels[i].rule, labels[i].x if labels[i].rule else labels[i].y)):
        label = labels[index]
        size = len(label.text) * char + 6
        side = size / 2 + 0.5 * line
        if label.rule:
            centre = label.x + 3 + size / 2 if label.x + 3 + size <= width else label.x - 3 - size / 2
            places = [(centre, 3 + line * (level + 0.5)) for level in range(levels)]
        else:
            centre = min(max(label.x, size / 2), width - size / 2)
            above = [(centre, label.y - line * (level + 0.95)) for level in range(levels)]
            places = [*above, (label.x + side, label.y), (label.x - side, label.y)]
        for level, (centre, middle) in enumerate(places):
            box = (centre - size / 2, middle - line / 2, centre + size / 2, middle + line / 2)
            if box[1] >= 0 and box[0] >= -1 and box[2] <= width + 1 and free(box, index):
                boxes.append(box)
                placed.append(Placed(index, centre, middle, leader=0 < level < levels and not label.rule))
                break
    return placed
