"""Words on what the gears do that several sections share."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import GearState
from tdacoustic.fleet import Fleet
from tdacoustic.gears import DIRECTIONS, GEARS, SteadyState
from tdacoustic.reporting.figure import Symbol
from tdacoustic.reporting.language import mark, say, say_count, spoken
from tdacoustic.reporting.sections.printed import FIGURE_11_CONDITION, is_of_the_paper, printed_of
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction

__all__ = [
    "DIRECTION_SLOTS",
    "DIRECTION_SYMBOLS",
    "begun_large",
    "begun_small",
    "by_speed",
    "conditions_words",
    "first_harmonic_n",
    "flank_words",
    "gear_word",
    "hertz",
    "largest_line",
    "law_words",
    "level_unit",
    "micrometres",
    "motion_cells",
    "motion_words",
    "named_conditions",
    "newtons",
    "range_words",
    "sentence",
    "shown_state",
    "significant",
    "state_words",
    "torque_words",
]

DIRECTION_SLOTS = {"x": 0, "y": 1, "z": 2}
"""Colour of a direction, the same in every figure."""
DIRECTION_SYMBOLS: dict[str, Symbol] = {"x": "circle", "y": "diamond", "z": "square"}

MINUS = "\N{MINUS SIGN}"

_LAWS = {
    "constant": mark("constant over speed"),
    "constant_power": mark("from a constant power"),
    "running_resistance": mark("from the running resistance"),
    "table": mark("from the fleet's table over speed"),
}
_GEAR_WORDS = {"pinion": mark("pinion"), "wheel": mark("wheel")}


def significant(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits and a true minus sign, without an exponent.

    Examples
    --------
    >>> significant(999.7), significant(0.01234), significant(0.0)
    ('1000', '0.0123', '0')
    """
    if value == 0.0 or not math.isfinite(value):
        return "0" if value == 0.0 else say("not determined")
    rounded = float(f"{value:.{digits - 1}e}")
    decimals = digits - 1 - math.floor(math.log10(abs(rounded)))
    text = f"{rounded:.{min(max(decimals, 0), 12)}f}"
    return text.replace("-", MINUS)


def newtons(value: float) -> str:
    """Return a force in N or kN.

    Examples
    --------
    >>> newtons(9121.2), newtons(145.04)
    ('9.12 kN', '145 N')
    """
    return f"{significant(1e-3 * value)} kN" if abs(value) >= 999.5 else f"{significant(value)} N"


def micrometres(value_m: float) -> str:
    """Return a length in µm."""
    return f"{significant(1e6 * value_m)} µm"


def hertz(value: float) -> str:
    """Return a frequency in Hz, with a decimal unless it is whole.

    Examples
    --------
    >>> hertz(174.968), hertz(3000.0)
    ('175.0 Hz', '3000 Hz')
    """
    return f"{value:.0f} Hz" if value.is_integer() else f"{value:.1f} Hz"


def sentence(text: str) -> str:
    """Return a text as a sentence: first letter large, a full stop."""
    return f"{begun_large(text)}{'' if text.endswith(('.', '!')) else '.'}"


def begun_large(text: str) -> str:
    """Return a text with its first letter large."""
    return f"{text[:1].upper()}{text[1:]}"


def begun_small(text: str) -> str:
    """Return a text that is a sentence or a heading as it stands within a sentence.

    In another language than English it stays as it is: there a noun may begin with a capital anywhere.
    """
    return f"{text[:1].lower()}{text[1:]}" if spoken().code.startswith("en") else text


def range_words(low: str, high: str) -> str:
    """Return two numbers as a range, equal ones as one.

    Examples
    --------
    >>> range_words("0.5", "0.9"), range_words("0.5", "0.5")
    ('0.5 to 0.9', '0.5')
    """
    return low if low == high else say("{low} to {high}", low=low, high=high)


def gear_word(gear: str) -> str:
    """Return the name of one of `GEARS` as it is said."""
    return say(_GEAR_WORDS[gear])


def by_speed(states: Sequence[GearState]) -> list[GearState]:
    """Return the conditions by mesh frequency."""
    return sorted(states, key=lambda state: state.mesh_hz)


def state_words(state: GearState) -> str:
    """Return a condition's name with its speed."""
    return say("condition {name} ({speed:.4g} km/h)", name=state.condition.name, speed=state.condition.train_speed_km_h)


def conditions_words(states: Sequence[GearState]) -> str:
    """Return several conditions by name."""
    return named_conditions([state.condition.name for state in states])


def named_conditions(names: Sequence[str]) -> str:
    """Return names of conditions, one or several, as they are said."""
    return say_count("condition {names}", "conditions {names}", len(names), names=joined(names))


def shown_state(result: FleetPrediction) -> GearState:
    """Return the condition that figures have in sight: that of the paper's figures, else the middle one by speed."""
    states = by_speed(result.prediction.conditions)
    if is_of_the_paper(result.fleet):
        for state in states:
            row = printed_of(state)
            if row is not None and row.condition == FIGURE_11_CONDITION:
                return state
    return states[len(states) // 2]


def law_words(fleet: Fleet) -> str:
    """Return how the torque follows from the speed."""
    return say(_LAWS[fleet.operation.torque.value])


def torque_words(torque_n_m: float) -> str:
    """Return a torque with its sign."""
    if not torque_n_m:
        return say("no torque")
    size = abs(torque_n_m)
    number = f"{size:.0f}" if size >= 1000.0 else f"{size:.4g}"
    return f"{'+' if torque_n_m > 0.0 else MINUS}{number} N m"


def flank_words(torque_n_m: float) -> str:
    """Return which flanks of the teeth a torque presses together."""
    return say("no flanks") if not torque_n_m else say("drive flanks") if torque_n_m > 0.0 else say("coast flanks")


def motion_words(steady: SteadyState) -> str:
    """Return how a motion was found and what it is."""
    if steady.method == "at_rest":
        return say("at rest: without torque the teeth of the model do not touch")
    method = say("harmonic balance") if steady.method == "harmonic_balance" else say("time integration")
    if steady.repeats_after is None:
        repeats = say("the motion does not repeat")
    elif steady.repeats_after == 1:
        repeats = say("periodic with the mesh")
    else:
        repeats = say("the motion repeats only after {count} mesh periods", count=steady.repeats_after)
    contact = (
        say("teeth are apart {percent} % of the time", percent=significant(100.0 * (1.0 - steady.contact_part), 2))
        if steady.separates
        else say("teeth stay in contact")
    )
    return f"{method}: {repeats}, {contact}"


def motion_cells(steady: SteadyState) -> tuple[str, str]:
    """Return what a motion is and how it was found, short enough for a table."""
    if steady.method == "at_rest":
        return say("at rest"), ""
    method = say("balance") if steady.method == "harmonic_balance" else say("integration")
    if steady.repeats_after is None:
        return say("does not repeat"), method
    if steady.repeats_after == 1:
        return say("periodic"), method
    return say("every {count} periods", count=steady.repeats_after), method


def largest_line(state: GearState) -> tuple[str, str, float, float] | None:
    """Return the largest line of the bearing forces: the gear as it is said, direction, N, Hz; None of no line."""
    amplitude = np.abs(state.forces.amplitude_n)
    if not amplitude.size:
        return None
    gear, direction, line = np.unravel_index(int(amplitude.argmax()), amplitude.shape)
    force, frequency = float(amplitude[gear, direction, line]), float(state.forces.frequency_hz[line])
    return gear_word(GEARS[int(gear)]), DIRECTIONS[int(direction)], force, frequency


def first_harmonic_n(state: GearState) -> NDArray[np.float64]:
    """Return the peak amplitudes at the mesh frequency, shape (2, 3); NaN where there is no such line."""
    place = np.flatnonzero(state.forces.harmonic == 1.0)
    if not place.size:
        return np.full((len(GEARS), len(DIRECTIONS)), np.nan)
    return np.asarray(np.abs(state.forces.amplitude_n[:, :, int(place[0])]))


def level_unit(fleet: Fleet) -> str:
    """Return the unit of Masuda's level in the fleet's reading."""
    return "dB" if fleet.masuda.weighting.value == "Z" else "dB(A)"
