"""Scales from a calibrator or a sensor database, in logs of several kinds."""

import pytest

from tdacoustic.campaign.scale import Scale
from tdacoustic.errors import UnitError
from tdacoustic.ingest.known_scale import CalibratedScale, KnownScale, number_unit
from tdacoustic.recording import LogChannel, Raster

RASTER = Raster(48000.0, 10)


def log(**keys):
    return LogChannel("mic", RASTER, **keys)


@pytest.mark.parametrize(
    ("channel", "scale", "unit", "factor"),
    [
        (log(unit="V"), Scale(), "V", 1.0),
        (log(unit="mV"), Scale(), "V", 1e-3),
        (log(), Scale(unit="mV"), "V", 1e-3),
        (log(full_scale=32768.0), Scale(), "full scale", 1 / 32768),
        (log(full_scale=1.0), Scale(full_scale="10 V"), "V", 10.0),
        (log(full_scale=1.0), Scale(unit="Pa"), "Pa", 1.0),
        (log(), Scale(), "number", 1.0),
        (log(unit="furlong"), Scale(), "number", 1.0),
        (log(unit="g"), Scale(), "m/s^2", 9.80665),
    ],
)
def test_what_a_number_is(channel, scale, unit, factor):
    found = number_unit(channel, scale)
    assert (found.unit, found.factor) == (unit, pytest.approx(factor))


def test_a_calibrated_scale_holds_for_numbers_of_the_same_kind():
    calibrated = CalibratedScale("sound_pressure", "Pa", "V", 20.0)
    known = KnownScale("50 mV/Pa by calibrator run cal", calibrated=calibrated)
    found = known.convert(log(unit="mV"), Scale(sensitivity="1 mV/Pa"))
    assert (found.quantity, found.si_symbol, found.scaling) == ("sound_pressure", "Pa", known.words)
    assert found.gain == pytest.approx(0.02) and found.offset == 0.0
    with pytest.raises(UnitError, match=r"recorded in V, but the log's numbers are in full scale"):
        known.convert(log(full_scale=1.0), Scale())


def test_a_sensor_of_the_database_is_converted_as_if_the_campaign_said_it():
    known = KnownScale("sensor 12 of sensors.csv", Scale(sensitivity="100 mV/g"))
    found = known.convert(log(unit="V"), Scale())
    assert found.gain == pytest.approx(98.0665)
    assert found.scaling == "0.0101972 V/(m/s^2); log in V; sensor 12 of sensors.csv"
