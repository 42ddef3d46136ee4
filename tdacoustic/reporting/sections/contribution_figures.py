"""Figures of contributions: the parts of components in third octaves, and over the speed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.attribution import CampaignContributions, ContributionState
from tdacoustic.attribution.contribution_spans import NamedSpan
from tdacoustic.attribution.contribution_step import paths_changed
from tdacoustic.contributions import GroupPart, SpanContributions
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.coherence import state_words
from tdacoustic.reporting.sections.words import OWNER_SLOT_OTHER, OWNER_SLOTS, slug, source_word
from tdacoustic.tables.contributions import power_db

__all__ = ["Row", "db_words", "over_frequency", "over_speed", "part_words"]

Array = NDArray[np.float64]
Row = tuple[ContributionState, NamedSpan, SpanContributions]

NO_LOWER_DB: Final = 15.0
"""Length of a bar without a lower end."""
FEW: Final = 12
"""Values of a trace up to which each has its dot."""
SYMBOLS: Final = {"ok": "circle", "flagged": "x", "refused": "triangle", "below": "triangle"}
LEGENDS: Final = {"flagged": mark("{component}, flagged"), "bound": mark("{component}, at most")}
RANGE: Final = mark("range")
RECORDED: Final = mark("recorded")
NO_SENSOR: Final = mark("explained by no sensor")
DRAWN: Final = mark(
    "A dot is known, a cross flagged, a triangle an upper bound of what is refused or does not stand above its "
    "scatter; the bars are the ranges of the table, and those without a lower end are drawn 15 dB down."
)


def db_words(mean_square: float | None) -> str:
    """Return a power as a level in words."""
    level = power_db(mean_square)
    return say("no power") if level is None else f"{level:.1f} dB"


def _range(part: GroupPart) -> str:
    low, high = power_db(part.low), power_db(part.high)
    if high is None:
        return ""
    return say("at most {high:.1f}", high=high) if low is None else say("{low:.1f} to {high:.1f}", low=low, high=high)


def part_words(name: str, part: GroupPart) -> str:
    """Return the part of a component in words: level, verdict and range, or its upper bound."""
    return f"{source_word(name)} {_level_words(part)}"


def _level_words(part: GroupPart) -> str:
    if part.verdict in ("refused", "below"):
        level = db_words(part.high)
        return (
            say("refused, at most {level}", level=level)
            if part.verdict == "refused"
            else say("at most {level}", level=level)
        )
    level = db_words(part.mean_square)
    if part.verdict == "flagged":
        return say("{level} (flagged, {range})", level=level, range=_range(part))
    return f"{level} ({_range(part)})"


def _slot(found: CampaignContributions, name: str) -> int:
    others = [component for component in found.components if component not in OWNER_SLOTS]
    return OWNER_SLOTS[name] if name in OWNER_SLOTS else (OWNER_SLOT_OTHER, 4, 5, 6)[others.index(name) % 4]


def _recorded(x: Array, rows: Sequence[SpanContributions], traces: Sequence[str]) -> Iterator[Element]:
    """What was recorded and what no sensor explains, a line for each run or mode."""
    total = np.array([power_db(parts.total) for parts in rows], dtype=np.float64)
    rest = np.array([None if paths_changed(p) else power_db(p.residual) for p in rows], dtype=np.float64)
    points = len(rows) <= FEW
    for trace in dict.fromkeys(traces):
        own = np.array([other == trace for other in traces])
        words = say(RECORDED)
        yield Line(x[own], total[own], words, color=7, group=words, points=points)
        if np.isfinite(rest[own]).any():
            words = say(NO_SENSOR)
            yield Line(x[own], rest[own], words, style="dashed", color=3, group=words, points=points)


def _elements(
    found: CampaignContributions,
    x: Sequence[float],
    rows: Sequence[SpanContributions],
    logarithmic: bool,
    traces: Sequence[str] | None = None,
) -> list[Element]:
    """Parts of some spans: what was recorded, what no sensor explains, and each component by its verdict."""
    at = np.array(x)
    elements: list[Element] = [*_recorded(at, rows, traces or [""] * len(rows))]
    names = found.components
    span = float(at.max() - at.min()) if at.size > 1 else 1.0
    for number, name in enumerate(names):
        step = number - 0.5 * (len(names) - 1)
        place = at * 1.025**step if logarithmic else at + 0.012 * span * step
        elements += _part_elements(name, place, [parts.groups[name] for parts in rows], _slot(found, name))
    return elements


def _part_elements(name: str, x: Array, parts: Sequence[GroupPart], slot: int) -> list[Element]:
    found: list[Element] = []
    bars_x: list[float] = []
    bars_y: list[float] = []
    groups: dict[str, list[tuple[float, float, str]]] = {}
    for place, part in zip(x, parts, strict=True):
        bound = part.verdict in ("refused", "below")
        level = power_db(part.high if bound else part.mean_square)
        if level is None:
            continue
        words = f"{source_word(name)}: {_level_words(part)}"
        groups.setdefault("bound" if bound else part.verdict, []).append((float(place), level, words))
        high, low = power_db(part.high), power_db(part.low)
        if not bound and high is not None:
            bars_x += [float(place)] * 3
            bars_y += [level - NO_LOWER_DB if low is None else low, high, np.nan]
    if bars_x:
        found.append(
            Line(
                np.array(bars_x),
                np.array(bars_y),
                say("{component}: range", component=source_word(name)),
                color=slot,
                opacity=0.5,
                group=say(RANGE),
            )
        )
    for kind, points in groups.items():
        found.append(
            Markers(
                np.array([p[0] for p in points]),
                np.array([p[1] for p in points]),
                say(LEGENDS[kind], component=source_word(name)) if kind in LEGENDS else source_word(name),
                texts=tuple(p[2] for p in points),
                symbol=SYMBOLS.get(kind, "triangle"),  # type: ignore[arg-type]
                color=slot,
            )
        )
    return found


def _limits(elements: Iterable[Element]) -> tuple[float, float]:
    """From a little below the lowest point to a little above the highest; bars may run out of it."""
    levels = [e.y for e in elements if isinstance(e, Markers)]
    levels += [e.y for e in elements if isinstance(e, Line) and e.group != say(RANGE)]
    values = np.concatenate(levels)
    values = values[np.isfinite(values)]
    return (float(values.min()) - 4.0, float(values.max()) + 3.0) if values.size else (0.0, 1.0)


def over_frequency(found: CampaignContributions, held: Sequence[Row], receiver: str) -> list[Figure]:
    """Return a figure for each operating state: its parts in third octaves.

    Parameters
    ----------
    found : CampaignContributions
    held : sequence of Row
        Of this microphone.
    receiver : str
    """
    figures = []
    for state in found.states:
        rows = [(span, parts) for s, span, parts in held if s.name == state.name and span.kind == "band"]
        if len(rows) < 2:
            continue
        centres = [float(np.sqrt(parts.band_hz[0] * parts.band_hz[1])) for _, parts in rows]
        elements = _elements(found, centres, [parts for _, parts in rows], logarithmic=True)
        name = slug("contributions", receiver, state.name, state.run)
        title = say("Contributions at {receiver}, run {run}", receiver=receiver, run=state.run)
        if state_words(state):
            title = f"{title}, {state_words(state)}"
        caption = " ".join([say("In third octaves."), _drawn([parts for _, parts in rows])])
        figures.append(_figure(name, title, caption, Axis(say("Frequency"), "Hz", "log"), elements, 360))
    return figures


def over_speed(
    found: CampaignContributions, held: Sequence[Row], receiver: str, modes: Mapping[str, str]
) -> list[Figure]:
    """Return the parts of the tones, and of the whole, over speed.

    Parameters
    ----------
    found : CampaignContributions
    held : sequence of Row
        Of this microphone.
    receiver : str
    modes : mapping of str to str
        By run. States are joined by a line within a run-up, and steady runs within a mode.
    """
    figures = []
    speeds = {state.name: state.train_speed_km_h for state in found.states}
    axis = Axis(say("Train speed"), "km/h")
    if any(speed is None for speed in speeds.values()):
        speeds = {state.name: None if state.motor_hz is None else 60.0 * state.motor_hz for state in found.states}
        axis = Axis(say("Motor speed"), "rpm")
    titles = {
        "tones": say("Contributions to the tones over speed at {receiver}", receiver=receiver),
        "total": say("Contributions to the whole sound over speed at {receiver}", receiver=receiver),
    }
    for kind, title in titles.items():
        rows = [(speed, s, p) for s, span, p in held if span.kind == kind and (speed := speeds[s.name]) is not None]
        rows.sort(key=lambda row: row[0])
        if len({speed for speed, *_ in rows}) < 2:
            continue
        parts = [part for *_, part in rows]
        traces = [f"steady, {modes.get(s.run, '')}" if s.steady else s.run for _, s, _ in rows]
        elements = _elements(found, [speed for speed, *_ in rows], parts, logarithmic=False, traces=traces)
        name = slug(f"contributions-over-speed-{kind}", receiver)
        joins = [say("Lines join the speeds of one run-up, and steady runs of one mode.")]
        caption = " ".join([*(joins if len(set(traces)) > 1 else []), _drawn(parts)])
        figures.append(_figure(name, title, caption, axis, elements, 340))
    return figures


def _drawn(rows: Sequence[SpanContributions]) -> str:
    """What the signs mean, and what is left out."""
    if not any(paths_changed(parts) for parts in rows):
        return say(DRAWN)
    left_out = say("What no sensor explains is left out where the paths differ from state to state.")
    return f"{say(DRAWN)} {left_out}"


def _figure(name: str, title: str, caption: str, x: Axis, elements: Sequence[Element], height: int) -> Figure:
    level = Axis(say("Sound pressure level"), "dB", reference="20 µPa", limits=_limits(elements))
    return Figure(name, title, caption, x, level, elements, height=height)
