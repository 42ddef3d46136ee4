"""Right-to-left writing for a renderer that draws from left to right: Hebrew and Arabic in the order they are seen.

The implicit part of the Unicode Bidirectional Algorithm (UAX #9, rules W1 to W7, N0 to N2, I1, L2 to L4) in a
paragraph that runs from left to right; signs that steer the direction are not heeded. Arabic letters get the form that
joins them to their neighbours, as far as Unicode has it as a sign. The order is found before lines are broken: words of
a right-to-left phrase that goes over the end of a line change lines.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from functools import cache
from typing import Final

__all__ = ["is_right_to_left", "visual"]

_RIGHT: Final = ("R", "AL")
_CLOSING: Final = {"(": ")", "[": "]", "{": "}"}
_SIDES: Final = {"L": "L", "R": "R", "EN": "R", "AN": "R"}
_MIRRORED: Final = str.maketrans("()[]{}<>«»‹›", ")(][}{><»«›‹")
_FORMS: Final = {"<isolated>": 0, "<final>": 1, "<initial>": 2, "<medial>": 3}
_LAM, _TATWEEL = "\u0644", "\u0640"


def is_right_to_left(text: str) -> bool:
    """Whether a text has a sign of right-to-left writing."""
    return any(sign >= "\u0590" and unicodedata.bidirectional(sign) in _RIGHT for sign in text)


def visual(text: str) -> str:
    """Return a text with its signs in the order in which they are seen from the left.

    Parameters
    ----------
    text : str
        A line, in the order in which it is read.

    Examples
    --------
    >>> visual("run אבג 12 (דה)") == "run (הד) 12 גבא"
    True
    """
    if not is_right_to_left(text):
        return text
    levels = _levels(text)
    clusters: list[tuple[int, str]] = []
    for sign, level in zip(_joined(text), levels, strict=True):
        if not sign:
            continue
        if clusters and unicodedata.bidirectional(sign) == "NSM":  # a mark follows its letter, however that is turned
            clusters[-1] = (clusters[-1][0], clusters[-1][1] + sign)
        else:
            clusters.append((level, sign.translate(_MIRRORED) if level % 2 else sign))
    for least in (2, 1):
        clusters = _turned(clusters, least)
    return "".join(part for _, part in clusters)


def _turned(clusters: Sequence[tuple[int, str]], least: int) -> list[tuple[int, str]]:
    """Each run of at least this level in reverse (L2)."""
    found: list[tuple[int, str]] = []
    run: list[tuple[int, str]] = []
    for cluster in clusters:
        if cluster[0] >= least:
            run.append(cluster)
            continue
        found += [*reversed(run), cluster]
        run = []
    return found + run[::-1]


def _levels(text: str) -> list[int]:
    """Level of each sign in a paragraph from left to right: 0 as it stands, 1 turned, 2 a number in what is turned."""
    kinds = _weak([unicodedata.bidirectional(sign) for sign in text])
    kinds = _neutrals(_brackets(text, kinds))
    return [{"R": 1, "EN": 2, "AN": 2}.get(kind, 0) for kind in kinds]


def _weak(kinds: list[str]) -> list[str]:
    """Numbers and what belongs to them (W1 to W7)."""
    strong, before = "L", "L"
    for at, kind in enumerate(kinds):
        if kind == "NSM":
            kind = before
        elif kind == "EN" and strong == "AL":
            kind = "AN"
        elif kind in ("L", *_RIGHT):
            strong = kind
        kinds[at] = before = kind
    kinds = ["R" if kind == "AL" else kind for kind in kinds]
    for at in range(1, len(kinds) - 1):
        left, kind, right = kinds[at - 1 : at + 2]
        if left == right and ((kind in ("ES", "CS") and left == "EN") or (kind == "CS" and left == "AN")):
            kinds[at] = left
    for order in (range(len(kinds)), range(len(kinds) - 1, -1, -1)):
        near = ""
        for at in order:
            if kinds[at] == "ET" and near == "EN":
                kinds[at] = "EN"
            near = kinds[at]
    strong = "L"
    for at, kind in enumerate(kinds):
        if kind in ("L", "R"):
            strong = kind
        elif kind == "EN" and strong == "L":
            kinds[at] = "L"
    return kinds


def _brackets(text: str, kinds: list[str]) -> list[str]:
    """Brackets turn in pairs: where they hold right-to-left writing alone, and follow some (N0)."""
    opened: list[int] = []
    pairs: list[tuple[int, int]] = []
    for at, sign in enumerate(text):
        if kinds[at] != "ON":
            continue
        if sign in _CLOSING:
            opened.append(at)
        matching = [place for place in opened if _CLOSING[text[place]] == sign]
        if matching:
            pairs.append((matching[-1], at))
            opened = opened[: opened.index(matching[-1])]
    for first, last in sorted(pairs):
        held = {_SIDES.get(kind) for kind in kinds[first + 1 : last]} - {None}
        if not held:
            continue
        before = next((_SIDES[kind] for kind in reversed(kinds[:first]) if kind in _SIDES), "L")
        kinds[first] = kinds[last] = "R" if held == {"R"} and before == "R" else "L"
    return kinds


def _neutrals(kinds: list[str]) -> list[str]:
    """What has no direction takes that of both its neighbours, else that of the paragraph (N1, N2)."""
    at = 0
    while at < len(kinds):
        end = at
        while end < len(kinds) and kinds[end] not in _SIDES:
            end += 1
        if end > at:
            left = _SIDES.get(kinds[at - 1], "L") if at else "L"
            right = _SIDES.get(kinds[end], "L") if end < len(kinds) else "L"
            kinds[at:end] = [left if left == right else "L"] * (end - at)
        at = end + 1
    return kinds


@cache
def _arabic_forms() -> dict[str, dict[int, str]]:
    """Arabic letters, and lam with alef, with the signs of their forms: alone, final, initial, medial."""
    found: dict[str, dict[int, str]] = {}
    for code in (*range(0xFB50, 0xFC00), *range(0xFE80, 0xFEFD)):
        kind, *parts = unicodedata.decomposition(chr(code)).split() or ("",)
        letters = "".join(chr(int(part, 16)) for part in parts)
        if kind in _FORMS and (len(letters) == 1 or (len(letters) == 2 and letters[0] == _LAM)):
            found.setdefault(letters, {})[_FORMS[kind]] = chr(code)
    return found


def _joined(text: str) -> list[str]:
    """The sign that shows each sign of a text: letters in their forms; none for an alef that its lam has taken."""
    forms = _arabic_forms()
    shown = list(text)
    places = [at for at, sign in enumerate(text) if unicodedata.bidirectional(sign) != "NSM"]
    before = False  # whether the letter before reaches out to this one
    taken = False
    for number, at in enumerate(places):
        if taken:
            shown[at], taken = "", False
            continue
        sign = text[at]
        after = text[places[number + 1]] if number + 1 < len(places) else ""
        if sign == _LAM and sign + after in forms:
            shown[at], taken, before = forms[sign + after][int(before)], True, False
            continue
        own = forms.get(sign, {})
        reaches = sign == _TATWEEL or 2 in own
        met = after == _TATWEEL or 1 in forms.get(after, {})
        shown[at] = own.get(int(before and 1 in own) + 2 * int(reaches and met), sign)
        before = reaches
    return shown
