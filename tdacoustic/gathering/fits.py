"""What ``calibration.json`` says: parameters with intervals and doubts, and residuals."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from tdacoustic.errors import GatheringError
from tdacoustic.gathering.texts import checked_text, number_or_none, parsed_json, shown_text

__all__ = ["FittedValue", "State", "parsed_fit"]

SCHEMA: Final = "tdacoustic-calibration/1"

State: TypeAlias = Literal["determined", "on a bound", "undetermined", "tied"]

_EQUAL: Final = 1e-9
"""Relative distance of a value from a bound up to which it is that bound, whatever the doubts say."""

_MOST: Final = 1000
"""Parameters and residuals of one calibration; a fit has some two and some fifty."""


@dataclass(frozen=True)
class FittedValue:
    """A calibrated parameter of one campaign.

    Parameters
    ----------
    parameter : str
    value, initial, low, high : float or None
        The value, where it started, and its bounds.
    stderr : float or None
    ci95 : (float or None, float or None)
        An end is None where the data do not bound that side.
    state : str
        ``determined``; ``on a bound``: the optimum may lie beyond it; ``undetermined``: its interval is open or there
        is none; ``tied``: given by an expression of others.
    doubt : str
        What the calibration says against it, empty of nothing.
    """

    parameter: str
    value: float | None
    initial: float | None
    low: float | None
    high: float | None
    stderr: float | None
    ci95: tuple[float | None, float | None]
    state: State
    doubt: str

    def row(self) -> dict[str, Any]:
        """The row of ``parameters``."""
        return {
            **{"parameter": self.parameter, "value": self.value, "initial": self.initial, "min": self.low},
            **{"max": self.high, "stderr": self.stderr, "ci95_low": self.ci95[0], "ci95_high": self.ci95[1]},
            **{"state": self.state, "doubt": self.doubt},
        }


def parsed_fit(data: bytes) -> tuple[tuple[FittedValue, ...], list[dict[str, Any]]]:
    """Return the parameters of a ``calibration.json``, and the rows of ``residuals``.

    Raises
    ------
    GatheringError
        It is none of tdacoustic, or does not hold what it should.
    """
    held = parsed_json(data, "calibration.json")
    if held.get("schema") != SCHEMA:
        raise GatheringError(f"calibration.json: schema must be {SCHEMA!r}")
    parameters, residuals, doubts = (held.get(key) for key in ("parameters", "residuals", "doubts"))
    if not isinstance(parameters, dict) or not isinstance(residuals, list) or not isinstance(doubts, list):
        raise GatheringError("calibration.json: parameters, residuals or doubts are missing")
    if len(parameters) > _MOST or len(residuals) > _MOST:
        raise GatheringError(f"calibration.json: more than {_MOST} parameters or residuals")
    said = [shown_text(doubt) for doubt in doubts if isinstance(doubt, str)]
    return tuple(_values(parameters, said)), [_residual(entry) for entry in residuals]


def _values(parameters: Mapping[str, Any], doubts: Sequence[str]) -> Iterator[FittedValue]:
    for name, held in parameters.items():
        key = checked_text(name, "calibration.json: a parameter's name", 200)
        if not isinstance(held, dict):
            raise GatheringError(f"calibration.json: parameter {key} is no table")
        numbers = {
            what: number_or_none(held.get(what), f"calibration.json: {what} of {key}")
            for what in ("value", "initial", "min", "max", "stderr")
        }
        ends = held.get("ci95")
        if ends is not None and not (isinstance(ends, list) and len(ends) == 2):
            raise GatheringError(f"calibration.json: ci95 of {key} is no pair")
        low, high = (number_or_none(end, f"calibration.json: ci95 of {key}") for end in ends or (None, None))
        own = [doubt for doubt in doubts if re.search(rf"(?<![\w.]){re.escape(key)}(?![\w.]*\w)", doubt)]
        value, least, most = numbers["value"], numbers["min"], numbers["max"]
        tied = held.get("expression") is not None
        yield FittedValue(
            parameter=key,
            value=value,
            initial=numbers["initial"],
            low=least,
            high=most,
            stderr=numbers["stderr"],
            ci95=(low, high),
            state="tied" if tied else _state(value, least, most, (low, high), f"{key} ended on its bound", own),
            doubt="; ".join(own),
        )


def _state(
    value: float | None,
    least: float | None,
    most: float | None,
    ends: tuple[float | None, float | None],
    bound_words: str,
    doubts: Sequence[str],
) -> State:
    if value is None:
        return "undetermined"
    near = any(end is not None and abs(value - end) <= _EQUAL * max(abs(end), abs(value)) for end in (least, most))
    if near or any(doubt.startswith(bound_words) for doubt in doubts):
        return "on a bound"
    return "undetermined" if None in ends else "determined"


def _residual(entry: Any) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise GatheringError("calibration.json: a residual is no table")
    texts = {"receiver": "receiver", "what": "what", "weighting": "weighting"}
    texts |= {"condition": "condition", "level_origin": "origin", "source": "source", "of_campaign": "campaign"}
    found: dict[str, Any] = {}
    for column, key in texts.items():
        value = entry.get(key)
        found[column] = None if value is None else checked_text(value, f"calibration.json: {key} of a residual")
    for column in ("measured_db", "predicted_db", "before_db", "sigma_db"):
        found[column] = number_or_none(entry.get(column), f"calibration.json: {column} of a residual")
    return found
