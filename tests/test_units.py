"""Units are a closed table with the exact factors of their definitions; levels carry their references."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.errors import UnitError
from tdacoustic.units import (
    QUANTITIES,
    level_db,
    parse_full_scale,
    parse_sensitivity,
    parse_unit,
    quantity_of_unit,
    reference_label,
)

DEFINITIONS = {  # spelling: (value in SI of 1 unit, SI symbol, source)
    "g": (9.80665, "m/s^2", "standard: 3rd CGPM (1901), standard acceleration of gravity"),
    "psi": (0.45359237 * 9.80665 / 0.0254**2, "Pa", "standard: international yard and pound agreement (1959)"),
    "bar": (1e5, "Pa", "standard: Directive 80/181/EEC, annex, chapter I, 1.4: 1 bar = 10⁵ Pa"),
    "mbar": (100.0, "Pa", "standard: Directive 80/181/EEC, annex, chapter I, 1.4: 1 bar = 10⁵ Pa"),
    "rpm": (1.0 / 60.0, "1/s", "analytic: one turn in 60 s"),
    "tr/min": (1.0 / 60.0, "1/s", "analytic: one turn in 60 s"),
    "deg/s": (1.0 / 360.0, "1/s", "analytic: one turn is 360 deg"),
    "rad/s": (0.15915494309189535, "1/s", "analytic: one turn is 2 pi rad"),
    "km/h": (0.2777777777777778, "m/s", "analytic: 1000 m in 3600 s"),
    "m/s²": (1.0, "m/s^2", "standard: SI Brochure, 9th ed. (2019), SI prefixes and coherent derived units"),
    "kN m": (1000.0, "N m", "standard: SI Brochure, 9th ed. (2019), SI prefixes and coherent derived units"),
    "µPa": (1e-6, "Pa", "standard: SI Brochure, 9th ed. (2019), SI prefixes and coherent derived units"),
}


@pytest.mark.parametrize("spelling", DEFINITIONS)
def test_factors_are_those_of_the_definitions(spelling, conformance):
    expected, symbol, source = DEFINITIONS[spelling]
    unit = parse_unit(spelling)
    assert unit.si_symbol == symbol
    conformance(f"1 {spelling}", expected, unit.factor, 1e-12 * expected, symbol, source)  # rounding


@pytest.mark.parametrize(("celsius", "fahrenheit"), [(0.0, 32.0), (100.0, 212.0), (-40.0, -40.0)])
def test_temperatures_have_an_offset(celsius, fahrenheit):
    c, f = parse_unit("°C"), parse_unit("degF")
    kelvin = celsius * c.factor + c.offset
    assert kelvin == pytest.approx(celsius + 273.15, abs=1e-9)
    assert fahrenheit * f.factor + f.offset == pytest.approx(kelvin, abs=1e-9)


@pytest.mark.parametrize(
    "spellings",
    [
        ("m/s2", "m/s^2", "m/s²", "m/s**2", "m s-2", "m·s⁻²", "(m/s2)", " m/s^2 "),
        ("Nm", "N m", "N*m", "N·m"),
        ("rpm", "RPM", "1/min", "min-1", "U/min", "tr/min"),
        ("uPa", "µPa", "μPa"),
    ],
)
def test_spellings_of_one_unit_are_one_unit(spellings):
    assert len({(parse_unit(s).si_symbol, parse_unit(s).factor) for s in spellings}) == 1


@pytest.mark.parametrize("spelling", ["", "furlong", "PAA", "m/s3", "g/V", "mpa", "MPA"])
def test_an_unknown_spelling_is_refused_and_implies_nothing(spelling):
    with pytest.raises(UnitError, match="is not known"):
        parse_unit(spelling)
    assert quantity_of_unit(spelling) is None


def test_case_tells_milli_from_mega():
    assert parse_unit("MPa").factor == 1e6 and parse_unit("mPa").factor == 1e-3


def test_a_unit_implies_a_quantity_where_it_can():
    implied = {"Pa": "sound_pressure", "g": "acceleration", "rpm": "speed", "km/h": "speed", "V": "voltage"}
    assert {unit: quantity_of_unit(unit) for unit in implied} == implied
    assert quantity_of_unit(None) is None and quantity_of_unit("m/s") is None
    assert set(implied.values()) <= set(QUANTITIES)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("50 mV/Pa", 0.05),
        ("100 mV/g", 0.1 / 9.80665),
        ("10.2 mV/(m/s^2)", 0.0102),
        ("10.2mV/(m/s²)", 0.0102),
        ("1e-1 V/g", 0.1 / 9.80665),
        ("3.5 pC/g", 3.5e-12 / 9.80665),
    ],
)
def test_a_sensitivity_is_electrical_over_physical(text, expected):
    assert parse_sensitivity(text).electrical_per_physical == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("50", "is not of the form"),
        ("mV/Pa", "is not of the form"),
        ("50 Pa/mV", "is no electrical unit"),
        ("0 mV/Pa", "must be positive"),
        ("-50 mV/Pa", "must be positive"),
        ("50 mV/foo", "'foo' is not known"),
        ("1e999 mV/Pa", "must be positive"),
    ],
)
def test_a_wrong_sensitivity_is_refused(text, match):
    with pytest.raises(UnitError, match=match):
        parse_sensitivity(text)


def test_a_full_scale_is_a_number_and_a_unit():
    number, unit = parse_full_scale("20 Pa")
    assert (number, unit.symbol) == (20.0, "Pa")
    assert parse_full_scale("5g")[0] == 5.0
    for text in ("20", "Pa", "20 foo", "0 Pa", "-1 Pa"):
        with pytest.raises(UnitError):
            parse_full_scale(text)


def test_levels_have_the_references_of_the_standard(conformance):
    for quantity, value, expected in [
        ("sound_pressure", 20e-6, 0.0),
        ("sound_pressure", 1.0, 93.9794),
        ("acceleration", 1e-6, 0.0),
    ]:
        got = level_db(value, quantity)
        conformance(
            f"level of {value:g} ({quantity})", expected, got, 1e-4, "dB", "standard: ISO 1683:2015, reference values"
        )
    assert reference_label("sound_pressure") == "20 uPa" and reference_label("torque") is None


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_what_has_no_level_has_none(value):
    assert level_db(value, "sound_pressure") is None
    assert level_db(1.0, "torque") is None


@given(st.floats(1e-9, 1e9))
def test_a_level_rises_by_six_decibels_when_the_value_doubles(value):
    assert level_db(2.0 * value, "sound_pressure") - level_db(value, "sound_pressure") == pytest.approx(
        6.0206, abs=1e-4
    )
