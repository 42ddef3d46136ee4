import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.campaign import Scale
from tdacoustic.errors import UnitError
from tdacoustic.ingest import convert
from tdacoustic.recording import LogChannel, Raster

RASTER = Raster(100.0, 10)


def log(**keys):
    return LogChannel("c", RASTER, **keys)


@pytest.mark.parametrize(
    ("said", "stated", "quantity", "symbol", "gain", "offset"),
    [
        # the log knows its unit; numbers of units from their definitions
        ({"unit": "Pa"}, {}, "sound_pressure", "Pa", 1.0, 0.0),
        ({"unit": "g"}, {}, "acceleration", "m/s^2", 9.80665, 0.0),
        ({"unit": "m/s²", "quantity": "acceleration"}, {}, "acceleration", "m/s^2", 1.0, 0.0),
        ({"unit": "tr/min"}, {}, "speed", "1/s", 1 / 60, 0.0),
        ({"unit": "km/h"}, {}, "speed", "m/s", 1 / 3.6, 0.0),
        ({"unit": "degC"}, {}, "temperature", "K", 1.0, 273.15),
        ({"unit": "mm"}, {}, "other", "m", 1e-3, 0.0),
        ({"unit": "mV"}, {}, "voltage", "V", 1e-3, 0.0),
        ({"unit": "A"}, {}, "current", "A", 1.0, 0.0),
        # the campaign knows it
        ({}, {"unit": "kN"}, "force", "N", 1e3, 0.0),
        ({"unit": "furlong"}, {"unit": "N m"}, "torque", "N m", 1.0, 0.0),
        # volts
        ({"unit": "V"}, {"sensitivity": "50 mV/Pa"}, "sound_pressure", "Pa", 20.0, 0.0),
        ({"unit": "mV", "quantity": "voltage"}, {"sensitivity": "50 mV/Pa"}, "sound_pressure", "Pa", 0.02, 0.0),
        ({"unit": "V"}, {"sensitivity": "100 mV/g"}, "acceleration", "m/s^2", 98.0665, 0.0),
        ({"unit": "pC"}, {"sensitivity": "2 pC/N"}, "force", "N", 0.5, 0.0),
        ({"unit": "V"}, {"sensitivity": "10 mV/A"}, "current", "A", 100.0, 0.0),
        ({"unit": "V"}, {"sensitivity": "10 mV/degC"}, "temperature", "K", 100.0, 273.15),
        ({"unit": "V"}, {"sensitivity": "1 mV/rpm"}, "speed", "1/s", 1000 / 60, 0.0),
        # fractions of full scale
        ({"full_scale": 1.0}, {"full_scale": "20 Pa"}, "sound_pressure", "Pa", 20.0, 0.0),
        ({"full_scale": 32768.0}, {"full_scale": "20 Pa"}, "sound_pressure", "Pa", 20 / 32768, 0.0),
        ({"full_scale": 1.0}, {"full_scale": "10 V", "sensitivity": "50 mV/Pa"}, "sound_pressure", "Pa", 200.0, 0.0),
        ({"full_scale": 1.0}, {"full_scale": "10 V"}, "voltage", "V", 10.0, 0.0),
        # nothing to convert
        ({}, {"quantity": "tacho"}, "tacho", "1", 1.0, 0.0),
        ({"full_scale": 1.0}, {"quantity": "tacho"}, "tacho", "1", 1.0, 0.0),
        ({"unit": "mV"}, {"quantity": "tacho"}, "tacho", "V", 1e-3, 0.0),
        ({}, {"quantity": "other"}, "other", "1", 1.0, 0.0),
        ({"quantity": "tacho"}, {}, "tacho", "1", 1.0, 0.0),
    ],
)
def test_numbers_become_si(said, stated, quantity, symbol, gain, offset):
    found = convert(log(**said), Scale(**stated))
    assert (found.quantity, found.si_symbol) == (quantity, symbol)
    assert found.gain == pytest.approx(gain, rel=1e-12)
    assert found.offset == pytest.approx(offset, rel=1e-12)
    assert found.scaling


@pytest.mark.parametrize(
    ("said", "stated", "match"),
    [
        (
            {"unit": "V"},
            {"quantity": "sound_pressure"},
            r'sound_pressure in V needs a sensitivity, add sensitivity = "\.\.\. V/Pa" to its \[\[channel\]\]',
        ),
        ({"unit": "mV", "quantity": "acceleration"}, {}, r'add sensitivity = "\.\.\. mV/\(m/s\^2\)"'),
        (
            {"full_scale": 1.0},
            {},
            r'fractions of a full scale \(1\) that the log does not state, add full_scale = "20 Pa"',
        ),
        ({"full_scale": 1.0}, {"sensitivity": "50 mV/Pa"}, r'add full_scale = "10 V"'),
        ({"full_scale": 1.0}, {"quantity": "acceleration"}, r'add full_scale = "20 m/s\^2"'),
        ({"full_scale": 1.0}, {"full_scale": "10 V", "quantity": "force"}, r"force in V needs a sensitivity"),
        ({}, {}, r'the log states no unit, add unit = "Pa"'),
        ({}, {"sensitivity": "50 mV/Pa"}, r'the log states no unit, add unit = "V"'),
        ({"unit": "furlong"}, {}, r"the log's unit 'furlong' is not known, add unit = "),
        ({"unit": "furlong"}, {"quantity": "temperature"}, r'add unit = "degC"'),
        (
            {"unit": "Pa"},
            {"quantity": "acceleration"},
            r"acceleration cannot be in Pa: correct quantity, or add unit = 'm/s\^2'",
        ),
        (
            {"unit": "Pa"},
            {"sensitivity": "50 mV/Pa"},
            r"is for V, but the log's numbers are in Pa: leave it out, or add unit = \"V\"",
        ),
        ({"unit": "Pa"}, {"full_scale": "20 Pa"}, r"the log's are in Pa already; leave full_scale out"),
        (
            {"unit": "rpm"},
            {"quantity": "tacho"},
            r'a tacho gives pulses, but the numbers are in rpm: say quantity = "speed"',
        ),
        ({"unit": "V"}, {"quantity": "force", "sensitivity": "50 mV/Pa"}, r"does not fit quantity 'force'"),
        ({"unit": "V"}, {"quantity": "heat"}, r"quantity must be one of acceleration, .*, got 'heat'"),
        ({"full_scale": 1.0}, {"full_scale": "11"}, r"full_scale '11' is not of the form '20 Pa'"),
    ],
)
def test_what_is_refused_names_the_key(said, stated, match):
    with pytest.raises(UnitError, match=match):
        convert(log(**said), Scale(**stated))


@pytest.mark.parametrize(
    ("said", "stated", "warning"),
    [
        (
            {"full_scale": 1.0},
            {"unit": "Pa"},
            'numbers are fractions of full scale; 1.0 is taken as 1 Pa because unit = "Pa"',
        ),
        (
            {"full_scale": 32768.0},
            {"unit": "Pa"},
            'numbers reach 32768 at full scale; 1.0 is taken as 1 Pa because unit = "Pa"',
        ),
        ({}, {"full_scale": "20 Pa"}, "the log does not say which number is full scale; 1.0 is taken as 20 Pa"),
        ({"unit": "V"}, {"unit": "Pa"}, "the log says V, but unit = 'Pa' is used as stated"),
        ({"unit": "V"}, {}, "numbers in V are kept as voltage; a sensor's channel needs quantity and sensitivity"),
        ({"unit": "pC"}, {}, "numbers in pC are kept as other; a sensor's channel needs quantity and sensitivity"),
        (
            {"quantity": "acceleration"},
            {"unit": "Pa"},
            "the log says acceleration, sound_pressure is used as stated",
        ),
        (
            {"unit": "furlong"},
            {"quantity": "other"},
            "the log's unit 'furlong' is not known; numbers are used as they are",
        ),
    ],
)
def test_what_is_doubtful_is_warned_of(said, stated, warning):
    assert convert(log(**said), Scale(**stated)).warnings == (warning,)


@pytest.mark.parametrize("unit", ["Pa", "V"])
def test_another_spelling_of_the_logs_unit_is_no_doubt(unit):
    stated = Scale(quantity="voltage" if unit == "V" else None, unit=unit)
    spelled = {"Pa": "pascal", "V": "Volt"}[unit]
    assert convert(log(unit=spelled), stated).warnings == ()


def test_scaling_in_words():
    assert convert(log(unit="V"), Scale(sensitivity="10.2 mV/(m/s^2)")).scaling == "0.0102 V/(m/s^2); log in V"
    assert convert(log(unit="Pa"), Scale()).scaling == "log in Pa"
    assert convert(log(unit="degC"), Scale()).scaling == "log in degC, x 1 + 273.15"
    assert convert(log(full_scale=1.0), Scale(full_scale="20 Pa")).scaling == "full scale 20 Pa at 1, x 20"


def test_limits_follow():
    found = convert(log(unit="degF", limits=(32.0, 212.0)), Scale())
    assert found.limits((32.0, 212.0)) == pytest.approx((273.15, 373.15), abs=1e-9)
    assert found.limits(None) is None


@given(st.floats(1e-3, 1e3), st.sampled_from(["Pa", "g", "N", "rpm", "A"]), st.floats(1e-2, 1e5))
def test_a_sensor_read_back_gives_what_it_felt(ratio, unit, felt):
    """A sensor of `ratio` mV per unit that feels `felt` units gives ratio * felt / 1000 V."""
    by_volts = convert(log(unit="V"), Scale(sensitivity=f"{ratio!r} mV/{unit}"))
    direct = convert(log(unit=unit), Scale())
    volts = ratio * felt / 1000.0
    assert math.isclose(volts * by_volts.gain + by_volts.offset, felt * direct.gain + direct.offset, rel_tol=1e-9)
