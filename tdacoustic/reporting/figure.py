"""What a figure shows, independent of who draws it.

A `Figure` is a frozen description in numbers and words: axes with units, and elements on
them. `tdacoustic.reporting.plotly_renderer` and `tdacoustic.reporting.matplotlib_renderer`
draw the same description; neither library is imported here.

Arrays are checked and made read-only on construction. NaN is a gap; an infinite value is
refused (a level of silence is a gap, not minus infinity).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import TdacousticError
from tdacoustic.reporting.palette import SERIES_SLOTS

__all__ = [
    "Axis",
    "Band",
    "Bars",
    "Element",
    "Figure",
    "Hatch",
    "Heatmap",
    "Line",
    "Markers",
    "ReportError",
    "Rule",
    "check_slug",
]

FloatArray: TypeAlias = NDArray[np.float64]
LineStyle = Literal["solid", "dashed", "dotted", "steps"]
Symbol = Literal["circle", "square", "diamond", "triangle", "cross", "x"]

Hatch = Literal["/", "\\", "x", "-", "|", "+", "."]

HATCHES: Final[tuple[str, ...]] = get_args(Hatch)
LINE_STYLES: Final = ("solid", "dashed", "dotted", "steps")
SYMBOLS: Final = ("circle", "square", "diamond", "triangle", "cross", "x")


class ReportError(TdacousticError, ValueError):
    """A figure, a table or a document contradicts itself."""


def check_slug(name: str, what: str) -> None:
    """Raise `ReportError` unless ``name`` can serve as an anchor and a file name.

    Examples
    --------
    >>> check_slug("spectrum-1a", "figure name")
    """
    if not re.fullmatch(r"[a-z0-9][a-z0-9_-]*", name):
        raise ReportError(f"{what} must be lower-case letters, digits, '-' and '_', got {name!r}")


def _values(what: str, values: ArrayLike, shape: tuple[int, ...] | None = None, ndim: int = 1) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    if array.ndim != ndim:
        raise ReportError(f"{what} must have {ndim} dimension(s), got shape {array.shape}")
    if shape is not None and array.shape != shape:
        raise ReportError(f"{what} must have shape {shape}, got {array.shape}")
    if np.isinf(array).any():
        raise ReportError(f"{what} must be finite or NaN (a gap), got an infinite value")
    array.setflags(write=False)
    return array


def _slot(what: str, color: int | None) -> None:
    if color is not None and not 0 <= color < SERIES_SLOTS:
        raise ReportError(f"color of {what} must be None or a slot from 0 to {SERIES_SLOTS - 1}, got {color!r}")


@dataclass(frozen=True)
class Axis:
    """An axis: what is drawn along it, in which unit, and how.

    Parameters
    ----------
    label : str
        The quantity, ``"Sound pressure level"``.
    unit : str
        ``"Hz"``, ``"dB"``; empty for a number or a name.
    scale : {"linear", "log"}
        On a logarithmic axis, values that are not positive are gaps.
    limits : (float, float), optional
        What is shown at first; default: the data.
    reference : str, optional
        Reference of a level, ``"20 uPa"``.
    note : str, optional
        What else the number depends on, ``"density, per Hz"``.
    names : sequence of str
        Of the places 0, 1, 2, ... along a linear axis, instead of numbers.

    Examples
    --------
    >>> Axis("Sound pressure level", "dB", reference="20 uPa", note="density, per Hz").caption
    'Sound pressure level / dB re 20 uPa (density, per Hz)'
    """

    label: str
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    limits: tuple[float, float] | None = None
    reference: str | None = None
    note: str | None = None
    names: Sequence[str] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        if self.names and self.log:
            raise ReportError(f"axis {self.label!r} has names, it must be linear")
        if self.scale not in ("linear", "log"):
            raise ReportError(f"scale of axis {self.label!r} must be 'linear' or 'log', got {self.scale!r}")
        if self.limits is not None:
            low, high = self.limits
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                raise ReportError(f"limits of axis {self.label!r} must be finite and rising, got {self.limits}")
            if self.log and low <= 0:
                raise ReportError(f"limits of logarithmic axis {self.label!r} must be positive, got {self.limits}")

    @property
    def log(self) -> bool:
        """Whether the axis is logarithmic."""
        return self.scale == "log"

    @property
    def unit_text(self) -> str:
        """The unit with its reference, as it follows a number: ``"dB re 20 uPa"``."""
        return " re ".join(part for part in (self.unit, self.reference) if part)

    @property
    def caption(self) -> str:
        """The axis title, quantity / unit re reference (note)."""
        unit = f" / {self.unit_text}" if self.unit_text else ""
        note = f" ({self.note})" if self.note else ""
        return f"{self.label}{unit}{note}"


@dataclass(frozen=True, eq=False)
class Line:
    """A trace.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        In the units of the axes. On a figure with `Bars`, x counts the categories from 0.
    name : str
        Shown in the legend and under the pointer.
    style : {"solid", "dashed", "dotted", "steps"}
        ``"steps"`` is level around each x, as for bands.
    color : int, optional
        Slot of the palette, 0 to 7; default: the next one of the figure.
    width : float, optional
        In CSS pixels; default 1.5, or 1 where there are more than 1000 points.
    opacity : float
        More than 0, at most 1.
    group : str, optional
        Lines of one group share one colour, if none is given, and one entry of the legend,
        which reads as the group does.
    points : bool
        Whether each value has a dot too: for few values, which the line only joins.
    """

    x: FloatArray
    y: FloatArray
    name: str
    style: LineStyle = "solid"
    color: int | None = None
    width: float | None = None
    opacity: float = 1.0
    group: str | None = None
    points: bool = False

    def __post_init__(self) -> None:
        x = _values(f"x of line {self.name!r}", self.x)
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "y", _values(f"y of line {self.name!r}", self.y, x.shape))
        _slot(f"line {self.name!r}", self.color)
        if self.style not in LINE_STYLES:
            raise ReportError(f"style of line {self.name!r} must be one of {LINE_STYLES}, got {self.style!r}")
        if not (self.stroke > 0 and 0 < self.opacity <= 1):
            raise ReportError(
                f"line {self.name!r} needs width > 0 and 0 < opacity <= 1, got {self.width, self.opacity}"
            )

    @property
    def stroke(self) -> float:
        """Width it is drawn with, in CSS pixels."""
        return self.width if self.width is not None else (1.0 if self.x.size > 1000 else 1.5)


@dataclass(frozen=True, eq=False)
class Band:
    """The region between two traces, such as an interval of confidence.

    Parameters
    ----------
    x, lower, upper : array_like, shape (n,)
        Edges in the units of the axes; a NaN in any of them is a gap.
    name : str
        Shown in the legend.
    color : int, optional
        Slot of the palette; default: the next one.
    """

    x: FloatArray
    lower: FloatArray
    upper: FloatArray
    name: str
    color: int | None = None

    def __post_init__(self) -> None:
        x = _values(f"x of band {self.name!r}", self.x)
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "lower", _values(f"lower of band {self.name!r}", self.lower, x.shape))
        object.__setattr__(self, "upper", _values(f"upper of band {self.name!r}", self.upper, x.shape))
        _slot(f"band {self.name!r}", self.color)
        if np.any(self.lower > self.upper):
            raise ReportError(f"band {self.name!r} has a lower edge above its upper edge")


@dataclass(frozen=True, eq=False)
class Markers:
    """Single points, where asked with a label on the picture.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        In the units of the axes.
    name : str
        Shown in the legend and under the pointer.
    labels : sequence of str, optional
        One a point, drawn on the picture; empty for none. Labels that would cover another one
        are left out, lower points first, so keep them short and few.
    texts : sequence of str, optional
        One a point, shown under the pointer only.
    symbol : {"circle", "square", "diamond", "triangle", "cross", "x"}
        Shape of the points.
    errors : array_like, shape (n,), optional
        Half length of a vertical error bar.
    color : int, optional
        Slot of the palette; default: the next one.
    """

    x: FloatArray
    y: FloatArray
    name: str
    labels: Sequence[str] = ()
    texts: Sequence[str] = ()
    symbol: Symbol = "circle"
    errors: FloatArray | None = None
    color: int | None = None

    def __post_init__(self) -> None:
        x = _values(f"x of markers {self.name!r}", self.x)
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "y", _values(f"y of markers {self.name!r}", self.y, x.shape))
        if self.errors is not None:
            object.__setattr__(self, "errors", _values(f"errors of markers {self.name!r}", self.errors, x.shape))
        for key in ("labels", "texts"):
            words = tuple(getattr(self, key))
            if words and len(words) != x.size:
                raise ReportError(f"{key} of markers {self.name!r} must be {x.size} or none, got {len(words)}")
            object.__setattr__(self, key, words)
        if self.symbol not in SYMBOLS:
            raise ReportError(f"symbol of markers {self.name!r} must be one of {SYMBOLS}, got {self.symbol!r}")
        _slot(f"markers {self.name!r}", self.color)


@dataclass(frozen=True, eq=False)
class Bars:
    """One bar a category; several `Bars` of a figure stand side by side or are stacked.

    Parameters
    ----------
    categories : sequence of str
        The same for all `Bars` of a figure.
    values : array_like, shape (n,)
        Height of each bar; NaN leaves it out.
    name : str
        Shown in the legend and under the pointer.
    errors : array_like, shape (n,) or (2, n), optional
        Half length of an error bar, or its lengths below and above.
    color : int, optional
        Slot of the palette; default: the next one.
    hatch : Hatch, optional
        Strokes or dots over the colour, so that bars differ without it too; default: none.
    """

    categories: Sequence[str]
    values: FloatArray
    name: str
    errors: FloatArray | None = None
    color: int | None = None
    hatch: Hatch | None = None

    def __post_init__(self) -> None:
        categories = tuple(str(category) for category in self.categories)
        object.__setattr__(self, "categories", categories)
        shape = (len(categories),)
        object.__setattr__(self, "values", _values(f"values of bars {self.name!r}", self.values, shape))
        if self.errors is not None:
            ndim = np.ndim(self.errors)
            of_sides = (2, *shape) if ndim == 2 else shape
            object.__setattr__(
                self, "errors", _values(f"errors of bars {self.name!r}", self.errors, of_sides, max(ndim, 1))
            )
        _slot(f"bars {self.name!r}", self.color)
        if self.hatch is not None and self.hatch not in HATCHES:
            raise ReportError(f"hatch of bars {self.name!r} must be None or one of {HATCHES}, got {self.hatch!r}")


@dataclass(frozen=True, eq=False)
class Heatmap:
    """A map of levels over both axes.

    Parameters
    ----------
    x, y : array_like, shape (n,) and (m,)
        Centres of the cells, rising.
    z : array_like, shape (m, n)
        One row a value of y.
    name : str
        Shown under the pointer.
    z_axis : Axis
        What the colour means; its limits clip the colour scale.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    name: str
    z_axis: Axis

    def __post_init__(self) -> None:
        x, y = _values(f"x of heatmap {self.name!r}", self.x), _values(f"y of heatmap {self.name!r}", self.y)
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "y", y)
        object.__setattr__(self, "z", _values(f"z of heatmap {self.name!r}", self.z, (y.size, x.size), ndim=2))
        for key, centres in (("x", x), ("y", y)):
            if centres.size < 2 or not np.all(np.diff(centres) > 0):
                raise ReportError(f"{key} of heatmap {self.name!r} must be at least two rising values")


@dataclass(frozen=True)
class Rule:
    """A vertical line over the whole height at ``x``, labelled at its top."""

    x: float
    label: str = ""

    def __post_init__(self) -> None:
        if not np.isfinite(self.x):
            raise ReportError(f"rule {self.label!r} must stand at a finite x, got {self.x}")


Element: TypeAlias = Line | Band | Markers | Bars | Heatmap | Rule


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure: two axes and what is drawn on them, first element first.

    Parameters
    ----------
    name : str
        Unique in a document; anchor of the figure and name of the downloaded picture.
    title, caption : str
        Shown below the figure, the caption in whole sentences.
    x_axis, y_axis : Axis
        What is drawn along each.
    elements : sequence of Line, Band, Markers, Bars, Heatmap or Rule
        At least one that is not a `Rule`, and at most one `Heatmap`.
    height : int
        In CSS pixels on the screen.
    bar_mode : {"group", "stack"}
        How several `Bars` share a category.
    equal : bool
        Whether a unit is as long along x as along y, as on a map; on linear axes.

    Raises
    ------
    ReportError
        A name, a shape, an axis or the categories are wrong.

    Examples
    --------
    >>> Figure("levels", "Levels", "", Axis("Time", "s"), Axis("Level", "dB"), (Line([0, 1], [60, 61], "mic_1"),)).name
    'levels'
    """

    name: str
    title: str
    caption: str
    x_axis: Axis
    y_axis: Axis
    elements: Sequence[Element]
    height: int = 420
    bar_mode: Literal["group", "stack"] = "group"
    equal: bool = False

    def __post_init__(self) -> None:
        check_slug(self.name, "name of a figure")
        elements = tuple(self.elements)
        object.__setattr__(self, "elements", elements)
        if all(isinstance(element, Rule) for element in elements):
            raise ReportError(f"figure {self.name!r} draws nothing")
        if sum(isinstance(element, Heatmap) for element in elements) > 1:
            raise ReportError(f"figure {self.name!r} has more than one heatmap")
        if not 120 <= self.height <= 1600:
            raise ReportError(f"height of figure {self.name!r} must be 120 to 1600 pixels, got {self.height}")
        if self.bar_mode not in ("group", "stack"):
            raise ReportError(f"bar_mode of figure {self.name!r} must be 'group' or 'stack', got {self.bar_mode!r}")
        if self.equal and (self.x_axis.log or self.y_axis.log):
            raise ReportError(f"figure {self.name!r} has a logarithmic axis, its axes cannot be equal")
        bars = [element for element in elements if isinstance(element, Bars)]
        if len({bar.categories for bar in bars}) > 1:
            raise ReportError(f"the bars of figure {self.name!r} have different categories")
        if bars and self.x_axis.log:
            raise ReportError(f"figure {self.name!r} has bars over categories, its x axis must be linear")
        rules = [element for element in elements if isinstance(element, Rule)]
        if self.x_axis.log and any(rule.x <= 0 for rule in rules):
            raise ReportError(f"figure {self.name!r} has a rule at x <= 0 on a logarithmic axis")

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the bars, empty without bars."""
        return next((tuple(e.categories) for e in self.elements if isinstance(e, Bars)), ())

    def slots(self) -> tuple[int | None, ...]:
        """Palette slot of each element: its own, its group's, else the next unused one."""
        slots: list[int | None] = []
        groups: dict[str, int] = {}
        taken = {e.color for e in self.elements if not isinstance(e, Rule | Heatmap) and e.color is not None}
        free = [slot for slot in range(SERIES_SLOTS) if slot not in taken] or list(range(SERIES_SLOTS))
        used = 0
        for element in self.elements:
            if isinstance(element, Rule | Heatmap):
                slots.append(None)
                continue
            group = element.group if isinstance(element, Line) else None
            slot = element.color if element.color is not None else groups.get(group or "")
            if slot is None:
                slot, used = free[used % len(free)], used + 1
            if group:
                groups.setdefault(group, slot)
            slots.append(slot)
        return tuple(slots)
