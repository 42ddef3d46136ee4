"""How matplotlib draws all figures: sizes, colours, fonts.

DejaVu Sans stands first; a sign that it lacks is drawn in the font for Chinese where its package is installed.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Final, cast

from tdacoustic.reporting.font_files import chinese_font
from tdacoustic.reporting.palette import colour

__all__ = ["CHINESE", "drawing_style"]

CHINESE: Final = "tdacoustic-chinese"
"""What matplotlib knows the font for Chinese as."""
_STYLE: Final[dict[str, Any]] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 7.5,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.edgecolor": colour("axis"),
    "axes.labelcolor": colour("ink"),
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "text.color": colour("ink"),
    "text.parse_math": False,
    "xtick.color": colour("axis"),
    "ytick.color": colour("axis"),
    "xtick.labelcolor": colour("ink"),
    "ytick.labelcolor": colour("ink"),
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3,
    "ytick.major.size": 3,
    "grid.color": colour("grid"),
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "lines.solid_joinstyle": "round",
    "path.simplify": True,
    "svg.hashsalt": "tdacoustic",
    "svg.fonttype": "path",
}


@contextmanager
def drawing_style() -> Iterator[None]:
    """Return a context in which figures are made and drawn.

    Nothing is said of a sign that none of the fonts has: it is an empty box, and the texts beside the figure have it.
    """
    import matplotlib

    families = [*_STYLE["font.family"], *_chinese_family()]
    with matplotlib.rc_context(cast(Any, {**_STYLE, "font.family": families})), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


@cache
def _chinese_family() -> tuple[str, ...]:
    """Make the font for Chinese known to matplotlib under a name that no other program asks for."""
    from matplotlib.font_manager import fontManager, ttfFontProperty
    from matplotlib.ft2font import FT2Font

    path = chinese_font()
    if path is None:
        return ()
    regular = dataclasses.replace(ttfFontProperty(FT2Font(path)), fname=str(path), name=CHINESE)
    bold = dataclasses.replace(regular, weight=700)  # the same: it has one weight, and matplotlib would warn of it
    fontManager.ttflist += [regular, bold]
    return (CHINESE,)
