"""Plain sentences on another source's numbers and features beside the model's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tdacoustic.fleet import Fleet
from tdacoustic.fleet.studies import Feature
from tdacoustic.studies.cases import Case
from tdacoustic.studies.checks import FeatureCheck, Findings, Influence, Move, ReferenceCheck

__all__ = [
    "UNITS",
    "CheckWords",
    "difference_words",
    "feature_words",
    "margin_words",
    "number_words",
    "quantity_words",
    "reference_words",
    "unit_of",
]

UNITS: Final = {"db": "dB", "um": "µm", "n": "N", "hz": "Hz", "deg": "°"}
"""Of quantities, by the last part of their names."""

_UNITS_OF_KEYS: Final = {
    **{"_n_per_m": "N/m", "_kg_m2": "kg m²", "_kg_m3": "kg/m³", "_kg": "kg", "_n_m": "N m", "_um": "µm", "_mm": "mm"},
    **{"_km_h": "km/h", "_db": "dB", "_hz": "Hz", "_gpa": "GPa", "_kw": "kW", "_t": "T", "_degc": "°C", "_deg": "°"},
    **{"_percent": "%", "_m": "m", "_n": "N"},
}
_OF_TWO: Final = ("pinion", "wheel")
_OF_THREE: Final = ("x", "y", "z")


@dataclass(frozen=True)
class CheckWords:
    """A check in plain sentences.

    Parameters
    ----------
    subject : str
        What it is about.
    claim : str
        What the source says, with the source.
    verdict : str
        Whether the model has it, with its figures.
    hangs_on : str
        The assumed parameters that it depends on most; empty of none.
    moved : str
        Which single assumed parameter would turn the verdict; empty where that was not looked for.
    """

    subject: str
    claim: str
    verdict: str
    hangs_on: str
    moved: str

    @property
    def statement(self) -> str:
        """Claim and verdict."""
        return f"{self.claim}: {self.verdict}"

    @property
    def dependence(self) -> str:
        """What it depends on, after what it is about; empty where that was not found."""
        told = " ".join(part for part in (self.hangs_on, self.moved) if part)
        return f"{self.subject}. {told}" if told else ""

    @property
    def text(self) -> str:
        """All of it."""
        return " ".join(part for part in (self.statement, self.hangs_on, self.moved) if part)


def number_words(key: str, fleet: Fleet) -> str:
    """Return a number of a fleet in a few words, made of its key.

    Examples
    --------
    ``gear_dynamics.pinion_bearing_stiffness_n_per_m.2`` is "pinion bearing stiffness y".
    """
    parts = key.split(".")
    places = [int(part) for part in parts if part.isdecimal()]
    names = [part for part in parts if not part.isdecimal()]
    last = names[-1]
    suffix = next((one for one in _UNITS_OF_KEYS if last.endswith(one)), "")
    words = last.removesuffix(suffix).replace("_", " ")
    if names[0] == "motor" and "excitation" in names and fleet.motor is not None:
        return f"{words} of {fleet.motor.excitation[places[0] - 1].name}"
    if names[0] in ("housing", "masuda", "motor", "radiation") and names[0] not in words:
        words = f"{'Masuda' if names[0] == 'masuda' else names[0]} {words}"
    if not parts[-1].isdecimal():
        return words
    place = places[-1] - 1
    whole = fleet.value_of(key.rpartition(".")[0])
    if last == "transmission_error_um":
        return words if len(whole) == 1 else f"{words}, mesh x{place + 1}"
    if last == "resistance_n":
        return f"{words} {'abc'[place]}"
    return f"{_OF_TWO[place]} {words}" if len(whole) == 2 else f"{words} {_OF_THREE[place]}"


def unit_of(key: str) -> str:
    """Return the unit that a key names, empty of none.

    Examples
    --------
    >>> unit_of("gear_pair.1.face_width_mm"), unit_of("gear_dynamics.mass_kg.2"), unit_of("housing.loss_factor")
    ('mm', 'kg', '')
    """
    last = [part for part in key.split(".") if not part.isdecimal()][-1]
    return next((unit for suffix, unit in _UNITS_OF_KEYS.items() if last.endswith(suffix)), "")


def quantity_words(quantity: str, fleet: Fleet) -> str:
    """Return what a quantity is, as in a sentence."""
    radius, circle = fleet.radiation.sphere_radius_m.value, fleet.radiation.circle_radius_m.value
    fixed = {
        "spl_4m_db": f"level at {radius:g} m",
        "masuda_spl_1m_db": "Masuda's level at 1 m",
        "dte_pp_um": "dynamic transmission error, peak to peak",
        "mesh_frequency_hz": "mesh frequency",
        "loudest_deg": f"loudest direction at {circle:g} m",
        "range_12m_db": f"range over the directions at {circle:g} m",
        "pattern": f"shape of the level around the drive at {circle:g} m",
    }
    if quantity in fixed:
        return fixed[quantity]
    if quantity.endswith("_spl_4m_db"):
        return f"{quantity.partition('_')[0]}'s level at {radius:g} m"
    gear, _, direction, _ = quantity.split("_")
    return f"force on the {gear}'s bearings along {direction} at the mesh frequency"


def reference_words(check: ReferenceCheck, fleet: Fleet) -> CheckWords:
    """Return a number of another source beside the model's in sentences."""
    reference = check.reference
    unit = _unit(reference.quantity)
    where = (
        f"helix angle {reference.helix_angle_deg:g}°"
        if reference.condition is None
        else f"condition {' or '.join(reference.condition)}"
    )
    said = "measured" if reference.kind == "measured" else "printed"
    subject = f"{_large(quantity_words(reference.quantity, fleet))}, {where}, {said} {reference.value:g}{unit}"
    claim = f"{subject} ({reference.origin})"
    if check.holds is None:
        return CheckWords(subject, claim, "the model has no such number.", "", "")
    own = "" if reference.condition is None or len(reference.condition) == 1 or check.case is None else check.case.name
    at = f" in condition {own}" if own else ""
    of_unit = "°" if unit == "°" else " dB"
    verdict = f"the model has {_number(check.value, reference.quantity)}{unit}{at}, {difference_words(check)}."
    what = "brings it there" if not check.holds else ""
    hangs = _hangs_on(check.findings.influences, of_unit, fleet)
    return CheckWords(subject, claim, verdict, hangs, _moved(check.findings, what, fleet, of_unit))


def difference_words(check: ReferenceCheck) -> str:
    """Return model less reference with its sign and unit; empty of none."""
    if math.isnan(check.difference):
        return ""
    return f"{_signed(check.difference, 1)}{'°' if check.reference.quantity == 'loudest_deg' else ' dB'}"


def margin_words(check: FeatureCheck) -> str:
    """Return the margin of a feature with its sign and unit; empty where it cannot be said."""
    if math.isnan(check.margin):
        return ""
    unit = _margin_unit(check.feature)
    return f"{_signed(check.margin, 2 if check.feature.shape == 'alike' else 1)}{unit}"


def _margin_unit(feature: Feature) -> str:
    return " in correlation" if feature.shape == "alike" else "°" if feature.shape == "toward" else " dB"


def feature_words(check: FeatureCheck, fleet: Fleet) -> CheckWords:
    """Return a feature of another source, and whether the model has it, in sentences."""
    feature = check.feature
    subject = feature.name or _claim(feature, fleet)
    claim = f"{_claim(feature, fleet)} ({feature.origin})"
    if check.holds is None:
        return CheckWords(subject, claim, f"cannot be said: {_why_not(check, fleet)}.", "", "")
    figures = _figures(check)
    verdict = f"{'reproduced' if check.holds else 'not reproduced'}; {figures}"
    unit = _margin_unit(feature)
    margin = f"{abs(check.margin):.2f}" if feature.shape == "alike" else f"{abs(check.margin):.1f}"
    verdict += f", {margin}{unit} {'to spare' if check.holds else 'short'}."
    what = "takes it away" if check.holds else "brings it"
    hangs = _hangs_on(check.findings.influences, unit, fleet)
    return CheckWords(subject, claim, verdict, hangs, _moved(check.findings, what, fleet, unit))


def _claim(feature: Feature, fleet: Fleet) -> str:
    what = quantity_words(feature.quantity, fleet)
    along = "with speed" if feature.over == "conditions" else "with the helix angle"
    every = "in every condition" if feature.over == "conditions" else "at every helix angle"
    names = " or ".join(feature.at)
    at = f"in condition {names}" if feature.over == "conditions" else f"at helix angle {names}°"
    value = 0.0 if feature.value is None else feature.value
    said = {
        "rises": f"rises {along}",
        "falls": f"falls {along}",
        "rises_then_falls": f"rises, then falls {along}",
        "flat_or_rises_then_falls": f"stays or rises at first, then falls {along}",
        "flat": f"does not change {along}",
        "highest_at": f"is highest {at}",
        "lowest_at": f"is lowest {at}",
        "span": f"differs by {value:g} dB between the extremes {along}",
        "above": f"is above that along {' and '.join(name.split('_')[2] for name in feature.than)} {every}"
        if all("_force_" in name for name in feature.than)
        else f"is above {' and '.join(quantity_words(name, fleet) for name in feature.than)} {every}",
        "toward": f"is {value:g}° {every}",
        "alike": f"is the same {every}",
    }
    return f"{_large(what)} {said[feature.shape]}"


def _figures(check: FeatureCheck) -> str:
    feature = check.feature
    if feature.shape == "alike":
        return (
            f"the least alike two correlate with {_signed(check.values[0], 2, plus=False)}, asked are {feature.value:g}"
        )
    unit = _unit(feature.quantity)
    numbers = ", ".join(_number(value, feature.quantity) for value in check.values)
    return f"the model has {numbers}{unit} {'at' if feature.over == 'helix' else 'in'} {_cases(check.cases)}"


def _why_not(check: FeatureCheck, fleet: Fleet) -> str:
    if check.feature.quantity == "pattern":
        return "fewer than two of the patterns have a shape, 1 dB or more between directions"
    missing = [case for case, value in zip(check.cases, check.values, strict=True) if math.isnan(value)]
    if missing:
        where = "at" if check.feature.over == "helix" else "in"
        return f"there is no value of the {quantity_words(check.feature.quantity, fleet)} {where} {_cases(missing)}"
    if not check.cases:
        return "nothing was computed over that"
    return "too few values"


def _cases(cases: Sequence[Case]) -> str:
    names = ", ".join(f"{case.name}°" if case.over == "helix" else case.name for case in cases)
    if cases[0].over == "helix":
        return names
    return f"condition{'s' if len(cases) > 1 else ''} {names}"


def _hangs_on(influences: Sequence[Influence], unit: str, fleet: Fleet) -> str:
    if not influences:
        return ""
    digits = 2
    told = [f"{number_words(one.key, fleet)} ({_signed(one.change, digits)}{unit} for {one.per})" for one in influences]
    return f"Of the assumed parameters it depends most on {_joined(told)}."


def _moved(findings: Findings, what: str, fleet: Fleet, unit: str) -> str:
    if not what:
        return ""
    if findings.moves:
        told = [_move(one, fleet) for one in findings.moves]
        return f"A single assumed parameter {what}: {' or '.join(told)}."
    if findings.closest is None and not findings.influences:
        return ""
    text = f"No single assumed parameter {what} within its scanned range"
    if findings.closest is not None:
        digits = 1 if unit.strip() in ("dB", "°") else 2
        text += (
            f"; nearest comes {_move(findings.closest, fleet)}, {abs(findings.closest.margin):.{digits}f}{unit} away"
        )
    return f"{text}."


def _move(move: Move, fleet: Fleet) -> str:
    name = number_words(move.key, fleet)
    if move.kind == "level":
        return f"{name} {_signed(move.amount, 1)} dB"
    unit = unit_of(move.key)
    unit = unit if unit in ("", "°") else f" {unit}"
    value = "" if move.value is None else f"at {_plain(move.value)}{unit} "
    return f"{name} {value}(×{move.amount:.3g})"


def _plain(value: float) -> str:
    return f"{value:.3g}".replace("e+0", "e") if abs(value) >= 1e5 else f"{float(f'{value:.3g}'):g}"


def _unit(quantity: str) -> str:
    unit = UNITS.get(quantity.rpartition("_")[2], "")
    return unit if unit == "°" else f" {unit}"


def _number(value: float, quantity: str) -> str:
    if math.isnan(value):
        return "nothing"
    if quantity.endswith("_db"):
        return f"{value:.1f}".replace("-", "\N{MINUS SIGN}")
    return f"{value:.0f}" if quantity.endswith("_deg") or abs(value) >= 1000.0 else f"{value:.3g}"


def _signed(value: float, digits: int, plus: bool = True) -> str:
    rounded = round(value, digits) or 0.0
    text = f"{rounded:+.{digits}f}" if plus else f"{rounded:.{digits}f}"
    return text.replace("-", "\N{MINUS SIGN}")


def _large(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


def _joined(words: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)
