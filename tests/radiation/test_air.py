"""Absorption of the air against the printed table of ISO 9613-2, which gives ISO 9613-1 in dB/km."""

import numpy as np
import pytest

from tdacoustic.errors import RadiationError
from tdacoustic.radiation import absorption_db_per_m

BANDS_HZ = 1000.0 * 10.0 ** (0.3 * np.arange(-4, 4))  # exact midband frequencies of 63 Hz to 8 kHz

PRINTED = {  # ISO 9613-2:1996, Table 2: °C, % -> dB/km from 63 Hz to 8 kHz
    (10, 70): (0.1, 0.4, 1.0, 1.9, 3.7, 9.7, 32.8, 117.0),
    (20, 70): (0.1, 0.3, 1.1, 2.8, 5.0, 9.0, 22.9, 76.6),
    (30, 70): (0.1, 0.3, 1.0, 3.1, 7.4, 12.7, 23.1, 59.3),
    (15, 20): (0.3, 0.6, 1.2, 2.7, 8.2, 28.2, 88.8, 202.0),
    (15, 50): (0.1, 0.5, 1.2, 2.2, 4.2, 10.8, 36.2, 129.0),
    (15, 80): (0.1, 0.3, 1.1, 2.4, 4.1, 8.3, 23.7, 82.8),
}


@pytest.mark.parametrize("air", PRINTED)
def test_iso_9613(conformance, air):
    degrees, humidity = air
    found = 1000.0 * absorption_db_per_m(BANDS_HZ, 273.15 + degrees, humidity)
    for frequency, printed, ours in zip((63, 125, 250, 500, 1000, 2000, 4000, 8000), PRINTED[air], found, strict=True):
        digits = 0.5 if printed > 100.0 else 0.055  # half of the last printed digit, and a tenth of it
        name = f"absorption of air at {degrees} °C, {humidity} %, {frequency} Hz"
        conformance(name, printed, ours, digits, "dB/km", "standard: ISO 9613-2:1996, Table 2")


@pytest.mark.parametrize(("kelvin", "humidity"), [(0.0, 50.0), (290.0, -1.0), (290.0, 101.0), (290.0, float("nan"))])
def test_air_that_cannot_be(kelvin, humidity):
    with pytest.raises(RadiationError, match="of the air must be"):
        absorption_db_per_m(1000.0, kelvin, humidity)
