"""``contributions.csv``, ``modes.csv`` and ``coherence.csv`` as views of what was found.

*contributions*: a row a part of a span. ``kind`` of the span: ``total`` (the whole band), ``tones`` (lobes of all
noise lines together), ``broadband`` (the rest), ``band`` (a third octave), ``order`` (of the kinematics; ``order`` per
turn of the motor, empty of the inverter's), ``tone`` (a noise line that no order owns). ``part``: a component,
``residual`` (what no sensor explains), ``total`` (what the microphone measured). ``level_db`` is empty of what is
``refused`` and where nothing is above its scatter, ``low_db`` where there is no lower bound; ``reason`` says why. What
no sensor explains is ``flagged`` where the paths differ from state to state. ``path_level_db`` is what plain
operational transfer paths say, cross-talk included. ``probability_largest`` is that of the part to be the largest of
its span, ``n_states`` the number of operating states behind the paths.

*coherence*: squared coherences at the lines that matter: noise lines, or the loudest lines of a state without any.
``other`` is the receiver, or the second reference of ``kind`` ``references``. ``value`` is as estimated, ``corrected``
without its bias, ``low`` to ``high`` its interval of 95 %.

*modes*: a row a band, loaded mode, receiver and speed; ``torque_share`` is what comes and goes with the torque.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tdacoustic.attribution.contribution_spans import NamedSpan
from tdacoustic.attribution.contribution_step import CHANGED, paths_changed
from tdacoustic.attribution.contributions import CampaignContributions
from tdacoustic.attribution.mode_comparison import SpeedModes
from tdacoustic.contributions import RESIDUAL, SpanContributions
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.units import level_db

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["contribution_tables", "power_db"]

SILENT = "no power"
BOUND = f"{CHANGED}: an upper bound"
UNDETERMINED = "one of both has no power of its own, or none is left"


def power_db(mean_square: float | None) -> float | None:
    """Return the level of a mean square of sound pressure; None of none."""
    return level_db(math.sqrt(mean_square), "sound_pressure") if mean_square is not None and mean_square > 0.0 else None


def contribution_tables(
    found: CampaignContributions | None, modes: Sequence[SpeedModes] | None
) -> dict[str, pd.DataFrame]:
    """Return ``contributions`` and ``coherence`` where there are contributions, ``modes`` where runs can be compared.

    Parameters
    ----------
    found : CampaignContributions or None
    modes : sequence of SpeedModes or None
    """
    tables = {}
    if found is not None:
        tables["contributions"] = frame_of("contributions", _contribution_rows(found))
        tables["coherence"] = frame_of("coherence", _coherence_rows(found))
    if modes is not None:
        tables["modes"] = frame_of("modes", _mode_rows(modes))
    return tables


def _contribution_rows(found: CampaignContributions) -> Iterator[Row]:
    for state, span, parts in found.rows():
        head: Row = {
            "run": state.run,
            "condition": state.condition,
            "train_speed_km_h": state.train_speed_km_h,
            "channel": parts.receiver,
            "span": parts.span,
            "kind": span.kind,
            "order": span.order,
            "low_hz": parts.band_hz[0],
            "high_hz": parts.band_hz[1],
            "n_states": float(parts.n_states),
        }
        yield from ({**head, **row} for row in _part_rows(parts))


def _part_rows(parts: SpanContributions) -> Iterator[Row]:
    yield {
        "part": "total",
        **_levels(parts.total, parts.total_low, parts.total_high),
        "verdict": "ok",
        "reason": "" if parts.total > 0.0 else SILENT,
    }
    for name, part in parts.groups.items():
        yield {
            "part": name,
            **_levels(part.mean_square, part.low, part.high),
            "path_level_db": power_db(part.path_mean_square),
            "verdict": part.verdict,
            "reason": part.reason,
            "probability_largest": parts.largest.get(name),
        }
    yield {
        "part": RESIDUAL,
        **_levels(parts.residual, parts.residual_low, parts.residual_high),
        "verdict": "flagged" if paths_changed(parts) else "ok",
        "reason": BOUND if paths_changed(parts) else "" if parts.residual > 0.0 else SILENT,
        "probability_largest": parts.largest.get(RESIDUAL),
    }


def _levels(value: float | None, low: float, high: float) -> Row:
    return {"level_db": power_db(value), "low_db": power_db(low), "high_db": power_db(high)}


def _coherence_rows(found: CampaignContributions) -> Iterator[Row]:
    named = {state.name: _named_lines(found, state.name) for state in found.states}
    for state, item in found.coherences():
        yield {
            "run": state.run,
            "condition": state.condition,
            "train_speed_km_h": state.train_speed_km_h,
            "kind": item.kind,
            "reference": item.reference or None,
            "other": item.other,
            "frequency_hz": item.frequency_hz,
            "span": _span_at(named[state.name], item.frequency_hz),
            "value": item.value if item.determined else None,
            "corrected": item.corrected if item.determined else None,
            "low": item.low,
            "high": item.high,
            "averages": item.averages,
            "reason": "" if item.determined else UNDETERMINED,
        }


def _named_lines(found: CampaignContributions, state: str) -> list[NamedSpan]:
    return [item for item in found.spans if item.kind in ("order", "tone") and state in (item.span.states or ())]


def _span_at(spans: Sequence[NamedSpan], frequency_hz: float) -> str | None:
    inside = (item.span.name for item in spans if item.span.low_hz <= frequency_hz <= item.span.high_hz)
    return next(inside, None)


def _mode_rows(modes: Sequence[SpeedModes]) -> Iterator[Row]:
    for item in modes:
        head: Row = {
            "train_speed_km_h": item.speed if item.unit == "km/h" else None,
            "motor_speed_rpm": 60.0 * item.speed if item.unit == "1/s" else None,
            "channel": item.channel,
            "runs": ", ".join(f"{mode} {run}" for mode, run in item.runs),
        }
        if item.comparison is None:
            yield {**head, "depends_on": "undecided", "words": item.reason}
            continue
        for part in item.comparison.parts:
            yield {
                **head,
                "band": part.band,
                "mode": part.mode,
                "level_db": power_db(part.mean_square),
                "torque_share": part.torque_share,
                "low": part.share_low,
                "high": part.share_high,
                "depends_on": part.depends_on,
                "words": part.words,
                "speed_level_db": power_db(part.speed_part),
                "torque_level_db": power_db(part.torque_part),
                "scatter_assumed": item.comparison.scatter_assumed,
            }
