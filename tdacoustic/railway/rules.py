"""What the railway standards ask, each rule with how it is known.

The standards are sold, not public. ISO 3095:2013 is known through phonometry (MIT), which gives clause by clause what
it read from the standard's pages; ISO 3095:2025 (fourth edition, 90 pages, published 2025-09) through its title and
scope alone; ISO 3381:2021 through its scope, and notes of users. A rule that is taken over from another edition, or
from practice, carries `verified=False` and every text that names it says `UNVERIFIED`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from tdacoustic.errors import AnalysisError

__all__ = ["ISO_3095_2013", "ISO_3095_2025", "ISO_3381_2021", "STANDARDS", "UNVERIFIED", "Rule", "Standard"]

UNVERIFIED: Final = "[not verified against the standard's text]"


@dataclass(frozen=True)
class Rule:
    """One rule of a standard.

    Parameters
    ----------
    key : str
    value : float
        In the unit that the key names.
    clause : str
    source : str
        How it is known.
    verified : bool
        Whether that source read it from this edition.
    """

    key: str
    value: float
    clause: str
    source: str
    verified: bool = True

    @property
    def origin(self) -> str:
        """Clause and source in words, with `UNVERIFIED` where that holds."""
        place = f"{self.clause}, " if self.clause else ""
        return f"{place}{self.source}" + ("" if self.verified else f" {UNVERIFIED}")


@dataclass(frozen=True)
class Standard:
    """A standard, one edition of it.

    Parameters
    ----------
    name : str
        As ``"ISO 3095:2013"``.
    inside : bool
        Whether the microphones are in the vehicle.
    rules : tuple of Rule
    """

    name: str
    inside: bool
    rules: tuple[Rule, ...]

    def rule(self, key: str) -> Rule:
        """Return a rule.

        Raises
        ------
        AnalysisError
            There is none of that key.
        """
        for rule in self.rules:
            if rule.key == key:
                return rule
        raise AnalysisError(f"{self.name} has no rule {key!r}; there are {', '.join(rule.key for rule in self.rules)}")

    def value(self, key: str) -> float:
        """Return the value of a rule."""
        return self.rule(key).value


_READ: Final = "read by phonometry"
_PRACTICE: Final = "practice"

_EXTERIOR: Final = (
    Rule("distance_m", 7.5, "5.5.1.1, 6.4.1, 7.5.1, 8", _READ),
    Rule("height_m", 1.2, "5.5.1.1, 6.4.1, 7.5.1, 8", _READ),
    Rule("far_distance_m", 25.0, "6.4.1, 7.6", _READ),
    Rule("far_height_m", 3.5, "6.4.1, 7.6", _READ),
    Rule("far_from_km_h", 200.0, "6.4.1", _READ),
    # Table G.1 gives 0.23 dB at 7.5 m and 0.07 dB at 25 m, which is 20 lg of 0.2 m more.
    Rule(
        "position_tolerance_m", 0.2, "G.1", "from the uncertainty of table G.1 as phonometry prints it", verified=False
    ),
    Rule("background_distance_db", 10.0, "5.2.3, 6.1.3, 7.2.3, 8.1.3", _READ),
    Rule("background_correctable_db", 3.0, "D.4.2 (informative)", _READ),
    Rule("record_margin_db", 10.0, "6.6.3", _READ),
    Rule("stationary_s", 20.0, "5", _READ),
    Rule("speed_tolerance", 0.05, "", _PRACTICE, verified=False),
    Rule("braking_from_km_h", 30.0, "8", _READ),
    Rule("runs", 3.0, "5.8.1, 6.7.1, 7.5.4, 8.7", _READ),
    Rule("spread_db", 3.0, "9.3", _READ),
    Rule("rounding_db", 1.0, "5.8.1, 6.7.1, 7.5.4, 8.7", _READ),
)

ISO_3095_2013: Final = Standard("ISO 3095:2013", False, _EXTERIOR)

ISO_3095_2025: Final = Standard(
    "ISO 3095:2025",
    False,
    tuple(
        replace(
            rule, clause=f"{rule.clause} of 2013" if rule.clause else "", source="taken over from 2013", verified=False
        )
        for rule in _EXTERIOR
    ),
)

_NOTES: Final = "notes of a survey by ISO 3381 (github.com, acoustic-survey-methodology)"

ISO_3381_2021: Final = Standard(
    "ISO 3381:2021",
    True,
    (
        Rule("seated_height_m", 1.2, "", _NOTES, verified=False),
        Rule("standing_height_m", 1.6, "", _NOTES, verified=False),
        Rule("position_tolerance_m", 0.2, "", _PRACTICE, verified=False),
        Rule("background_distance_db", 10.0, "", _NOTES, verified=False),
        Rule("background_correctable_db", 3.0, "", "as ISO 3095:2013, D.4.2", verified=False),
        Rule("constant_speed_s", 20.0, "", _PRACTICE, verified=False),
        Rule("stationary_s", 20.0, "", "as ISO 3095:2013", verified=False),
        Rule("speed_tolerance", 0.05, "", _PRACTICE, verified=False),
        Rule("runs", 3.0, "", "as ISO 3095:2013", verified=False),
        Rule("spread_db", 3.0, "", "as ISO 3095:2013", verified=False),
        Rule("rounding_db", 1.0, "", "as ISO 3095:2013", verified=False),
    ),
)
"""Engineering grade (ISO 12001 grade 2) at constant speed and standing, survey grade when accelerating or braking: the
standard's scope. The heights lie above the floor."""

STANDARDS: Final = {standard.name: standard for standard in (ISO_3095_2013, ISO_3095_2025, ISO_3381_2021)}
"""By name, for a campaign that names one."""
