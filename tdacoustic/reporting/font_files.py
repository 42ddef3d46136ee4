"""The font files of a report's pictures and of its PDF: DejaVu Sans for nearly all text, Noto Sans SC for Chinese.

DejaVu comes with matplotlib and has Latin, Greek, Cyrillic and the signs of the trade. Noto Sans SC comes with the
extra ``pdf``.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["chinese_font", "dejavu_folder"]


def dejavu_folder() -> Path:
    """Return the folder of the DejaVu fonts that come with matplotlib."""
    import matplotlib

    return Path(matplotlib.get_data_path()) / "fonts" / "ttf"


def chinese_font() -> Path | None:
    """Return the OpenType file of Noto Sans SC; None where the package that brings it is not installed."""
    try:
        from pylopdf_fonts_zh_cn import sans_path
    except ImportError:
        return None
    path = Path(sans_path())
    return path if path.is_file() else None
