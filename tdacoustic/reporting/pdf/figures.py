"""Figures in the PDF: what matplotlib draws, kept as lines and text for reportlab's page.

Maps, and figures of more lines than pay, are pictures at print resolution. A figure is drawn once; pages are laid out
several times until their numbers settle, each time from what was kept.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias, cast

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.colors import to_rgb
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D
from PIL import Image
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from tdacoustic.reporting.figure import Figure
from tdacoustic.reporting.matplotlib_renderer import draw_with, printed_size
from tdacoustic.reporting.pdf.fonts import Fonts

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties
    from matplotlib.transforms import Transform

__all__ = ["Picture", "kept_figure"]

MAP_DPI: Final = 150
"""Of maps: a cell of a map is larger than a pixel."""
HIGHEST: Final = 600.0
"""Points that leave room for a caption on a page."""
LINE_DPI: Final = 300
MOST_LINE_BYTES: Final = 300_000
"""Of the path operators of a figure, before compression; the lines of one with more become a picture [assumed]."""

HATCH_PT: Final = 72.0
"""Side of the square that matplotlib repeats a hatch by."""

_CAPS: Final = {"butt": 0, "round": 1, "projecting": 2}
_JOINS: Final = {"miter": 0, "round": 1, "bevel": 2}
_OPERATORS: Final = {Outline.MOVETO: "m", Outline.LINETO: "l", Outline.CURVE4: "c"}


@dataclass(frozen=True)
class _Strokes:
    """A path in operators of PDF, with how opaque its strokes and its filling are."""

    code: str
    stroke_alpha: float
    fill_alpha: float


@dataclass(frozen=True)
class _Words:
    """A line of text: its left end on the base line in points, its angle in degrees."""

    x: float
    y: float
    angle: float
    size: float
    rgb: tuple[float, float, float]
    parts: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class _Raster:
    """A picture in its place, in points."""

    x: float
    y: float
    width: float
    height: float
    picture: ImageReader


_Kept: TypeAlias = _Strokes | _Words | _Raster


class _Recorder(RendererBase):
    """Keeps what matplotlib draws, in points from the lower left corner."""

    def __init__(self, width: float, height: float, fonts: Fonts, dpi: int) -> None:
        super().__init__()
        self.width, self.height, self.dpi = width, height, dpi
        self.fonts = fonts
        self.kept: list[_Kept] = []

    def flipy(self) -> bool:
        """Whether y grows downwards: no."""
        return False

    def get_canvas_width_height(self) -> tuple[float, float]:
        """Return the size in points."""
        return self.width, self.height

    def points_to_pixels(self, points: Any) -> Any:
        """Return the same: a pixel is a point."""
        return points

    def get_image_magnification(self) -> float:
        """Return pixels of a picture to a point."""
        return self.dpi / 72.0

    def get_text_width_height_descent(self, s: str, prop: FontProperties, ismath: Any) -> tuple[float, float, float]:
        """Return the size of a text as it will be shown, with signs that matplotlib's font lacks."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing")
            width, height, descent = super().get_text_width_height_descent(s, prop, ismath)
        if not self.fonts.simple(s):
            width = self.fonts.width(s, prop.get_size_in_points(), _is_bold(prop))
        return width, height, descent

    def draw_path(self, gc: GraphicsContextBase, path: Outline, transform: Transform, rgbFace: Any = None) -> None:
        """Keep a path, stroked and filled as its context says."""
        stroked = gc.get_linewidth() > 0 and gc.get_rgb()[3] > 0
        filled = rgbFace is not None and (len(rgbFace) < 4 or rgbFace[3] > 0)
        clip = None if filled else (-10.0, -10.0, self.width + 10.0, self.height + 10.0)
        lines = _operators(path, transform, clip)
        if not lines or not (stroked or filled):
            return
        before = [*_clipping(gc), *_pen(gc, rgbFace if filled else None)]
        ends = {(True, True): "B", (True, False): "S", (False, True): "f"}[stroked, filled]
        alpha = gc.get_alpha() if gc.get_forced_alpha() else None
        of_fill = rgbFace[3] if filled and len(rgbFace) > 3 else 1.0
        stroke_alpha, fill_alpha = (gc.get_rgb()[3], of_fill) if alpha is None else (alpha, alpha)
        self.kept.append(_Strokes("\n".join([*before, lines, ends]), float(stroke_alpha), float(fill_alpha)))
        if filled and gc.get_hatch():
            self._keep_hatch(gc, path.get_extents(transform).extents, lines)

    def _keep_hatch(self, gc: GraphicsContextBase, box: Sequence[float], outline: str) -> None:
        """Keep a hatch in squares over a box, cut by the outline that it fills."""
        left, bottom, right, top = (float(end) / HATCH_PT for end in box)
        squares = [
            Affine2D().scale(HATCH_PT).translate(HATCH_PT * column, HATCH_PT * row)
            for column in range(math.floor(left), math.ceil(right))
            for row in range(math.floor(bottom), math.ceil(top))
        ]
        ink = " ".join(_short(part) for part in to_rgb(gc.get_hatch_color()))
        pen = f"{ink} RG {ink} rg {_short(gc.get_hatch_linewidth())} w"
        drawn = [_operators(gc.get_hatch_path(), square, None) for square in squares]
        self.kept.append(_Strokes("\n".join([*_clipping(gc), outline, "W n", pen, *drawn, "B"]), 1.0, 1.0))

    def draw_image(self, gc: GraphicsContextBase, x: float, y: float, im: Any, transform: Any = None) -> None:
        """Keep a picture, in few colours: a quarter of the bytes."""
        with Image.fromarray(np.ascontiguousarray(im[::-1])) as picture:
            opacity = picture.getchannel("A").point([16 * round(level / 16) - (level > 247) for level in range(256)])
            few = picture.convert("RGB").quantize(96, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        shown = few.convert("RGB")
        if np.asarray(opacity).min() < 255:
            shown.putalpha(opacity)
        width, height = (side * 72.0 / self.dpi for side in shown.size)
        self.kept.append(_Raster(float(x), float(y), width, height, ImageReader(shown)))

    def draw_text(
        self,
        gc: GraphicsContextBase,
        x: float,
        y: float,
        s: str,
        prop: FontProperties,
        angle: float,
        ismath: Any = False,
        mtext: Any = None,
    ) -> None:
        """Keep a line of text."""
        size = prop.get_size_in_points()
        red, green, blue = (float(part) for part in gc.get_rgb()[:3])
        parts = tuple(self.fonts.runs(s, _is_bold(prop)))
        self.kept.append(_Words(float(x), float(y), float(angle), size, (red, green, blue), parts))


def _is_bold(prop: FontProperties) -> bool:
    weight = prop.get_weight()
    return weight in ("bold", "heavy", "black", "semibold") or (not isinstance(weight, str) and weight >= 600)


def _operators(path: Any, transform: Any, clip: tuple[float, float, float, float] | None) -> str:
    """A path as PDF writes it, to a hundredth of a point."""
    written = []
    here = (0.0, 0.0)
    for points, code in path.iter_segments(transform, clip=clip):
        values = [float(value) for value in points]
        if code == Outline.CLOSEPOLY:
            written.append("h")
            continue
        if code == Outline.CURVE3:
            values, code = _as_cubic(here, values), Outline.CURVE4
        if not all(map(math.isfinite, values)):
            continue
        written.append(f"{' '.join(_short(value) for value in values)} {_OPERATORS[code]}")
        here = (values[-2], values[-1])
    return "\n".join(written)


def _as_cubic(start: tuple[float, float], values: Sequence[float]) -> list[float]:
    """A quadratic curve as a cubic one: its control points two thirds of the way to the one it has."""
    (x0, y0), (x1, y1, x2, y2) = start, values
    return [x0 + (x1 - x0) * 2 / 3, y0 + (y1 - y0) * 2 / 3, x2 + (x1 - x2) * 2 / 3, y2 + (y1 - y2) * 2 / 3, x2, y2]


def _short(value: float) -> str:
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("", "-0") else text


def _clipping(gc: GraphicsContextBase) -> list[str]:
    found = []
    rectangle = gc.get_clip_rectangle()
    if rectangle is not None:
        found.append(f"{' '.join(_short(value) for value in rectangle.bounds)} re W n")
    path, transform = gc.get_clip_path()
    if path is not None:
        found.append(f"{_operators(path, transform, None)}\nW n")
    return found


def _pen(gc: GraphicsContextBase, filling: Any) -> list[str]:
    offset, dashes = cast("tuple[float | None, Sequence[float] | None]", gc.get_dashes())
    pattern = " ".join(_short(float(value)) for value in dashes or ())
    found = [
        f"{' '.join(_short(float(part)) for part in gc.get_rgb()[:3])} RG",
        f"{_short(gc.get_linewidth())} w {_CAPS[gc.get_capstyle()]} J {_JOINS[gc.get_joinstyle()]} j",
        f"[{pattern}] {_short(float(offset or 0))} d",
    ]
    if filling is not None:
        found.append(f"{' '.join(_short(float(part)) for part in filling[:3])} rg")
    return found


class Picture(Flowable):
    """A figure in the flow of a page.

    Parameters
    ----------
    kept : sequence
        What `kept_figure` keeps.
    size : (float, float)
        In points.
    """

    def __init__(self, kept: Sequence[_Kept], size: tuple[float, float]) -> None:
        super().__init__()
        self.kept = kept
        self.width, self.height = size
        self.scale = 1.0
        self.full_size = size

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Return the size in points, made smaller where the page is narrower or lower."""
        self.scale = min(1.0, availWidth / self.full_size[0], HIGHEST / self.full_size[1])
        self.width, self.height = (side * self.scale for side in self.full_size)
        return self.width, self.height

    def draw(self) -> None:
        """Draw it at the origin of the canvas."""
        canvas = self.canv
        canvas.saveState()
        canvas.scale(self.scale, self.scale)
        for part in self.kept:
            canvas.saveState()
            _replay(canvas, part)
            canvas.restoreState()
        canvas.restoreState()


def _replay(canvas: Canvas, part: _Kept) -> None:
    if isinstance(part, _Strokes):
        if part.stroke_alpha < 1.0 or part.fill_alpha < 1.0:
            canvas.setStrokeAlpha(part.stroke_alpha)
            canvas.setFillAlpha(part.fill_alpha)
        canvas.addLiteral(part.code)
    elif isinstance(part, _Raster):
        canvas.drawImage(part.picture, part.x, part.y, part.width, part.height, mask="auto")
    else:
        canvas.translate(part.x, part.y)
        canvas.rotate(part.angle)
        text = canvas.beginText(0, 0)
        text.setFillColorRGB(*part.rgb)
        for font, words in part.parts:
            text.setFont(font, part.size)
            text.textOut(words)
        canvas.drawText(text)


def kept_figure(figure: Figure, fonts: Fonts) -> Picture:
    """Draw a figure for the pages of a PDF.

    Parameters
    ----------
    figure : Figure
    fonts : Fonts
        With the signs of its texts.

    Returns
    -------
    Picture
        Its text is text; maps, and the lines of figures with more than `MOST_LINE_BYTES` of them, are pictures.
    """
    width, height = printed_size(figure)
    recorder = _Recorder(width, height, fonts, MAP_DPI)
    draw_with(figure, recorder, MAP_DPI)
    if sum(len(part.code) for part in recorder.kept if isinstance(part, _Strokes)) > MOST_LINE_BYTES:
        recorder = _Recorder(width, height, fonts, LINE_DPI)
        draw_with(figure, recorder, LINE_DPI, lines=False)
    return Picture(recorder.kept, (width, height))
