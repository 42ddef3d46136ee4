"""The fonts of the PDF: DejaVu for nearly all text, Noto Sans SC for Chinese, a code for what neither can show.

`tdacoustic.reporting.font_files` says where they come from. Where the package of Noto Sans SC is missing, Chinese is
set in a font that the reader's program must have. Fonts that are embedded hold no more than the signs that are used.
"""

from __future__ import annotations

import hashlib
import io
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.cidfonts import UnicodeCIDFont
from reportlab.pdfbase.ttfonts import TTFont

from tdacoustic.reporting.font_files import chinese_font, dejavu_folder
from tdacoustic.reporting.pdf.bidi import visual

__all__ = ["BOLD", "REGULAR", "Fonts", "plain", "prepared"]

REGULAR: Final = "tdacoustic-regular"
BOLD: Final = "tdacoustic-bold"
_FILES: Final = {REGULAR: "DejaVuSans.ttf", BOLD: "DejaVuSans-Bold.ttf"}
_READERS_OWN: Final = "STSong-Light"
_LAST: Final = 0xFFFF
"""What lies above, reportlab draws but cannot say what it is: the text would read otherwise where it is copied."""
_NOT_DRAWN: Final = ("Cc", "Cf", "Cn", "Co", "Cs")
"""Categories of Unicode whose signs have no picture, or turn the direction of writing."""


@dataclass(frozen=True)
class Fonts:
    """Which font shows which sign.

    Parameters
    ----------
    chinese : str or None
        Registered name of the font for Chinese; None where the text has none.
    chinese_signs : frozenset of str
        What it shows.
    embedded : bool
        Whether it is in the file; if not, the reader's program must have a font for Chinese.
    coded : bool
        Whether the text has signs that no font shows.
    """

    chinese: str | None = None
    chinese_signs: frozenset[str] = frozenset()
    embedded: bool = True
    coded: bool = False

    def runs(self, text: str, bold: bool = False) -> list[tuple[str, str]]:
        """Return the parts of a text with the font of each; a sign that no font has becomes its code, ``[U+1F600]``.

        They are in the order in which they are seen from the left.

        Parameters
        ----------
        text : str
        bold : bool
            Chinese has one weight.
        """
        found: list[tuple[str, str]] = []
        own = BOLD if bold else REGULAR
        known = _signs(own)
        for sign in visual(plain(text)):
            if "\ufb50" <= sign <= "\ufefc" and ord(sign) not in known:  # a form of a letter that the font lacks
                sign = unicodedata.normalize("NFKC", sign)[0]
            if ord(sign) in known and unicodedata.category(sign) not in _NOT_DRAWN:
                font, shown = own, sign
            elif self.chinese is not None and sign in self.chinese_signs:
                font, shown = self.chinese, sign
            else:
                font, shown = own, f"[U+{ord(sign):04X}]"
            if found and found[-1][0] == font:
                found[-1] = (font, found[-1][1] + shown)
            else:
                found.append((font, shown))
        return found

    def width(self, text: str, size: float, bold: bool = False) -> float:
        """Return how wide a text is, in points."""
        return float(sum(pdfmetrics.stringWidth(part, font, size) for font, part in self.runs(text, bold)))

    def simple(self, text: str) -> bool:
        """Whether a text is shown as it stands by the regular font alone."""
        return self.runs(text) in ([], [(REGULAR, text)])


def plain(text: str) -> str:
    r"""Return a text in composed letters, with spaces for all that breaks lines, and a mark for what steers a program.

    Examples
    --------
    >>> plain("one\ntwo\x07")
    'one two�'
    """
    spaced = "".join(
        " " if sign in "\t\n\r\x0b\x0c\x85\u2028\u2029" else sign for sign in unicodedata.normalize("NFC", text)
    )
    return "".join("\ufffd" if unicodedata.category(sign) == "Cc" else sign for sign in spaced)


def prepared(texts: Iterable[str]) -> Fonts:
    """Register the fonts that some texts need, and return which sign each shows.

    Parameters
    ----------
    texts : iterable of str
        All that will be shown.
    """
    for name, file in _FILES.items():
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, str(dejavu_folder() / file)))
    known = _signs(REGULAR) & _signs(BOLD)
    signs = {sign for text in texts for sign in plain(text)}
    undrawn = {sign for sign in signs if unicodedata.category(sign) in _NOT_DRAWN}
    others = {sign for sign in signs - undrawn if ord(sign) not in known}
    source = chinese_font()
    has = _in_gbk if source is None else (lambda sign: ord(sign) in _noto_signs(source))
    shown = frozenset(sign for sign in others if has(sign))
    coded = bool(undrawn | others - shown)
    if not shown:
        return Fonts(coded=coded)
    if source is None:
        pdfmetrics.registerFont(UnicodeCIDFont(_READERS_OWN))
        return Fonts(_READERS_OWN, shown, embedded=False, coded=coded)
    name = f"tdacoustic-chinese-{hashlib.sha256(''.join(sorted(shown)).encode()).hexdigest()[:12]}"
    if name not in pdfmetrics.getRegisteredFontNames():
        pdfmetrics.registerFont(TTFont(name, io.BytesIO(_true_type(source, shown, name))))
    return Fonts(name, shown, coded=coded)


def _in_gbk(sign: str) -> bool:
    """Whether a font for Chinese has a sign: the set of the Chinese standard GBK."""
    try:
        sign.encode("gbk")
    except UnicodeEncodeError:
        return False
    return ord(sign) <= _LAST


@cache
def _signs(font: str) -> frozenset[int]:
    """Code points that a registered font has."""
    return frozenset(code for code in pdfmetrics.getFont(font).face.charToGlyph if 0x20 <= code <= _LAST)


@cache
def _noto_signs(path: Path) -> frozenset[int]:
    from fontTools.ttLib import TTFont as OpenType

    with OpenType(path, lazy=True) as font:
        return frozenset(code for code in font.getBestCmap() if code <= _LAST)


def _true_type(path: Path, signs: frozenset[str], name: str) -> bytes:
    """The outlines of some signs of an OpenType font as a TrueType font, the only kind that reportlab embeds.

    Cubic curves become quadratic ones within a thousandth of the size of the type. The name is its own: reportlab
    takes a font of a name that it knows for the one it has.
    """
    from fontTools.pens.cu2quPen import Cu2QuPen
    from fontTools.pens.ttGlyphPen import TTGlyphPen
    from fontTools.subset import Options, Subsetter
    from fontTools.ttLib import TTFont as OpenType
    from fontTools.ttLib import newTable

    options = Options(layout_features=[], notdef_outline=True, hinting=False)
    options.drop_tables += ["GSUB", "GPOS", "GDEF", "BASE", "VORG", "vhea", "vmtx"]
    with OpenType(path, lazy=True, recalcTimestamp=False) as font:
        subsetter = Subsetter(options)
        subsetter.populate(unicodes=[ord(sign) for sign in signs])
        subsetter.subset(font)
        drawn, order = font.getGlyphSet(), font.getGlyphOrder()
        glyphs: dict[str, Any] = {}
        for sign in order:
            pen = TTGlyphPen(drawn)
            drawn[sign].draw(Cu2QuPen(pen, font["head"].unitsPerEm / 1000.0, reverse_direction=True))
            glyphs[sign] = pen.glyph()
        font["loca"], font["glyf"] = newTable("loca"), newTable("glyf")
        font["glyf"].glyphOrder, font["glyf"].glyphs = order, glyphs
        for record in font["name"].names:
            if record.nameID in (3, 4, 6):  # unique, full and PostScript name
                record.string = f"{record.toUnicode()}-{name.rpartition('-')[2]}"
        _as_true_type(font, len(order))
        packed = io.BytesIO()
        font.save(packed)
    return packed.getvalue()


def _as_true_type(font: Any, n_glyphs: int) -> None:
    """Set what the tables of a TrueType font say besides its outlines."""
    limits = ["Zones", "TwilightPoints", "Storage", "FunctionDefs", "InstructionDefs", "StackElements"]
    limits += ["SizeOfInstructions", "ComponentElements", "Points", "Contours", "CompositePoints"]
    limits += ["CompositeContours", "ComponentDepth"]
    profile = font["maxp"]
    profile.tableVersion, profile.numGlyphs = 0x00010000, n_glyphs
    for limit in limits:
        setattr(profile, f"max{limit}", 0)
    profile.maxZones = 1
    font["post"].formatType = 3.0
    del font["CFF "]
    font.sfntVersion = "\x00\x01\x00\x00"
