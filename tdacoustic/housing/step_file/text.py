"""What the text of a STEP file says before any geometry is made of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from tdacoustic.housing.box import HousingError

__all__ = ["MOST_PARTS", "check_text", "too_many_parts"]

MOST_PARTS: Final = 20
"""Solids of one file at most [assumed]: a housing of two halves with covers and feet, and no whole drive."""

MOST_BYTES: Final = 100_000_000
"""Of a file [assumed]; a casting with all its roundings has some 10 MB."""

_START: Final = b"ISO-10303-21;"
_END: Final = b"END-ISO-10303-21;"
_SOLID: Final = re.compile(r"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(\s*'((?:[^']|'')*)'", re.I)


def check_text(content: bytes) -> None:
    """Raise for what is no STEP file, is cut off, or holds far more than a housing.

    Parameters
    ----------
    content : bytes
        Of the whole file.

    Raises
    ------
    HousingError
        The message does not name the file; who read it does.
    """
    if len(content) > MOST_BYTES:
        raise HousingError(
            f"it has {len(content) / 1e6:.0f} MB, {MOST_BYTES / 1e6:.0f} MB at most are read: export the housing "
            "alone, simplified"
        )
    head = content[:1000].removeprefix(b"\xef\xbb\xbf").lstrip()
    if head[:2] == b"PK" or head[:2] == b"\x1f\x8b":
        raise HousingError("it is compressed: unpack it and name the STEP file itself")
    if not head.startswith(_START):
        found = "is empty" if not content.strip() else f"begins with {_excerpt(head[:24])}"
        raise HousingError(f"it is no STEP file: it {found}, and not with {_START.decode()!r}")
    if _END not in content[-1000:]:
        last = content.rstrip().rsplit(b"\n", 1)[-1]
        raise HousingError(
            f"it is cut off: its end mark {_END.decode()!r} is missing; the last of its {len(content)} bytes are "
            f"{_excerpt(last[-40:])}. Export or copy it anew"
        )
    names = _SOLID.findall(content.decode("latin-1"))
    if len(names) > MOST_PARTS:
        raise too_many_parts(names)


def too_many_parts(names: Sequence[str | None]) -> HousingError:
    """Return the error for a file of more solids than a housing has.

    Parameters
    ----------
    names : sequence of str or None
        Of all solids.
    """
    told = list(dict.fromkeys(name for name in names if name))[:4]
    some = f" ({', '.join(told)}, ...)" if told else ""
    return HousingError(
        f"it holds {len(names)} solid parts{some}, {MOST_PARTS} at most are taken: export the housing alone, "
        "simplified, without screws, gears and bearings"
    )


def _excerpt(some: bytes) -> str:
    return repr(some.decode("latin-1"))
