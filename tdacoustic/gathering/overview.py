"""A campaign's conditions at a glance: speed, level at 4 m, dominant source."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final, Literal, TypeAlias

__all__ = ["ConditionRow", "Origin", "condition_rows", "energy_mean_db"]

Origin: TypeAlias = Literal["measured", "synthetic", "printed"]
"""Where numbers come from."""

SURFACE_M: Final = 4.0
NEAR: Final = 0.05
"""A microphone whose distance differs by no more from 4 m counts as one at 4 m; others are not moved there."""

_CORRECTIONS: Final = ("none", "applied", "marginal", "impossible")
"""What may have been done about the background, the weakest word last."""

Row: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True)
class ConditionRow:
    """A row of ``overview``: a condition of a campaign, with its recorded level, or with a stated one.

    Parameters
    ----------
    condition : str
    train_speed_km_h : float or None
    speed_from : str
        ``run``, or ``fleet`` where only the fleet's condition of that name has a speed.
    mode : str
        Of the model's condition, empty without one.
    level_4m_db, laeq_4m_db : float or None
        Energy mean over runs and microphones near 4 m, re 20 uPa, corrected for background as `correction` says.
    level_from : str
        ``recorded`` or ``stated``; empty without a level.
    level_origin : str
        ``measured``, ``synthetic`` or ``printed``.
    correction : str
        The weakest of the levels' corrections.
    levels : int
        How many are averaged.
    model_4m_db : float or None
        What the model says.
    dominant, leading, dominant_excitation : str
    confidence, line_fraction : float or None
    """

    condition: str
    train_speed_km_h: float | None
    speed_from: str
    mode: str
    level_4m_db: float | None
    laeq_4m_db: float | None
    level_from: str
    level_origin: Origin
    correction: str
    levels: int
    model_4m_db: float | None
    dominant: str
    confidence: float | None
    leading: str
    dominant_excitation: str
    line_fraction: float | None

    def row(self) -> dict[str, Any]:
        """The row of ``overview``."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


def condition_rows(
    origin: Origin, levels: Sequence[Row], quality: Sequence[Row], dominance: Sequence[Row], conditions: Sequence[Row]
) -> tuple[ConditionRow, ...]:
    """Return a row a condition; a second one where it has both a recorded and a stated level at 4 m.

    A channel that is bad does not enter. Levels of results without distances (``distance_m`` of ``levels``) are of
    unknown place, and none of theirs is taken to be at 4 m.

    Parameters
    ----------
    origin : str
        Of the campaign.
    levels, quality, dominance, conditions : sequences of rows
        Of the tables of these names.
    """
    bad = {(row["run"], row["channel"]) for row in quality if row["verdict"] == "bad"}
    sound = [row for row in levels if _is_at_4m(row) and not {(row["run"], row["channel"]), (row["run"], None)} & bad]
    verdicts = {row["condition"]: row for row in dominance}
    model = {row["condition"]: row for row in conditions}
    names = dict.fromkeys([*verdicts, *(row["condition"] for row in sound if row["condition"])])
    found = []
    for name in names:
        held = [row for row in sound if row["condition"] == name]
        recorded = [row for row in held if not _is_stated(row)]
        stated = [row for row in held if _is_stated(row)]
        parts = [("recorded", recorded), ("stated", stated)]
        for kind, rows in [part for part in parts if part[1]] or [("", [])]:
            verdict = verdicts.get(name, {}) if kind != "stated" or not recorded else {}
            found.append(_row(name, origin, kind, rows, verdict, model.get(name, {}), verdicts.get(name, {})))
    return tuple(found)


def _row(
    name: str, origin: Origin, kind: str, rows: Sequence[Row], verdict: Row, model: Row, speeds: Row
) -> ConditionRow:
    speed = speeds.get("train_speed_km_h")
    if speed is None:
        speed = _mean(row["train_speed_km_h"] for row in rows)
    from_fleet = speed is None and model.get("train_speed_km_h") is not None
    return ConditionRow(
        condition=name or "",
        train_speed_km_h=model["train_speed_km_h"] if from_fleet else speed,
        speed_from="fleet" if from_fleet else "run" if speed is not None else "",
        mode=model.get("mode") or "",
        level_4m_db=energy_mean_db(row["level_db"] for row in rows),
        laeq_4m_db=energy_mean_db(row["laeq_db"] for row in rows),
        level_from=kind,
        level_origin=origin if kind != "stated" or origin == "measured" else "printed",
        correction=max((row["correction"] or "none" for row in rows), key=_weakness, default=""),
        levels=len(rows),
        model_4m_db=model.get("spl_4m_db"),
        dominant=verdict.get("dominant") or "",
        confidence=verdict.get("confidence"),
        leading=verdict.get("leading") or "",
        dominant_excitation=verdict.get("dominant_excitation") or "",
        line_fraction=verdict.get("line_fraction"),
    )


def _weakness(word: str) -> int:
    return _CORRECTIONS.index(word) if word in _CORRECTIONS else len(_CORRECTIONS)


def _is_at_4m(row: Row) -> bool:
    distance_m = row["distance_m"]
    near = distance_m is not None and abs(distance_m - SURFACE_M) <= NEAR * SURFACE_M
    known = row["level_db"] is not None or row["laeq_db"] is not None
    return near and known and row["quantity"] == "sound_pressure" and row["role"] in (None, "receiver")


def _is_stated(row: Row) -> bool:
    """Whether a level stands in the campaign's file: those are numbered, and no record has a band of theirs."""
    return row["level_band_from_hz"] is None and re.fullmatch(r"level \d+", row["run"] or "") is not None


def _mean(values: Iterable[float | None]) -> float | None:
    held = [value for value in values if value is not None]
    return sum(held) / len(held) if held else None


def energy_mean_db(levels_db: Iterable[float | None]) -> float | None:
    """Return the energy mean of the levels that are known, or None of none; of any finite levels, without overflow.

    Examples
    --------
    >>> round(energy_mean_db([80.0, None, 83.0]), 2)
    81.75
    """
    held = [level for level in levels_db if level is not None]
    if not held:
        return None
    most = max(held)
    return most + 10.0 * math.log10(sum(10.0 ** (0.1 * (level - most)) for level in held) / len(held))
