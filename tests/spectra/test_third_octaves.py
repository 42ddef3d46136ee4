"""Third octaves: class 1 by measurement, power of noise, independence of blocks, another program."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoctaveband import OctaveFilterBank
from pyoctaveband.compliance import class_limits

from tdacoustic.errors import AnalysisError
from tdacoustic.spectra import ThirdOctaveMeter
from tdacoustic.spectra.bands import STAGE_EDGE

G = 10.0**0.3
BREAKPOINTS = (0.0, 1 / 8, 1 / 4, 3 / 8, 1 / 2, 1.0, 2.0, 3.0, 4.0)
"""Exponents of the octave breakpoints of IEC 61260-1:2014, table 1."""


def measured(x, rate, cuts=(), **options):
    data = np.atleast_2d(x)
    meter = ThirdOctaveMeter(rate, len(data), data.shape[1], **options)
    for piece in np.split(data, cuts, axis=1):
        meter.take(piece)
    return meter.result()


def relative_frequencies():
    """Breakpoints for third octaves (formulas 9 and 10 of the standard), a hair to both sides of the edge."""
    scale = (G ** (1 / 6) - 1.0) / (G**0.5 - 1.0)
    high = np.array([1.0 + scale * (G**x - 1.0) for x in BREAKPOINTS])
    high = np.sort(np.concatenate((high, [high[4] * 1.0005, 1.6, 3.0])))
    return np.concatenate((1.0 / high[:0:-1], high))


def faded_sines(frequencies, rate, duration):
    """Sines of rms one, faded in so softly that the onset leaves no trace in a band far off."""
    t = np.arange(int(duration * rate)) / rate
    ramp = np.clip(t / (0.5 * duration), 0.0, 1.0)
    envelope = 35 * ramp**4 - 84 * ramp**5 + 70 * ramp**6 - 20 * ramp**7
    return math.sqrt(2.0) * envelope * np.sin(2.0 * np.pi * np.outer(frequencies, t))


@pytest.mark.parametrize("rate", [51200.0, 25600.0, 8192.0])
def test_every_band_is_of_class_1(rate, conformance):
    bands = measured(np.zeros(1000), rate)
    worst = math.inf
    for index, centre in enumerate(bands.centre_hz):
        edge = centre * 10.0**0.05
        stage_rate = rate / 2 ** max(0, math.floor(math.log2(STAGE_EDGE * rate / edge)))
        wanted = centre * relative_frequencies()
        images = np.array([k * stage_rate + side * centre for k in (1, 2, 3) for side in (-1, 1)])  # of decimation
        wanted = np.concatenate((wanted, images[images > 1.5 * centre]))
        wanted = wanted[wanted < 0.495 * rate]
        duration = max(160.0 / centre, 2000.0 / rate)  # 37 times the inverse bandwidth
        response = measured(faded_sines(wanted, rate, duration), rate).mean_square[:, index]
        attenuation = -10.0 * np.log10(response / response[np.argmin(np.abs(wanted / centre - 1.0))])
        low, high = class_limits(3, 1, wanted / centre)
        worst = min(worst, float(np.min(attenuation - low)), float(np.min(high - attenuation)))
        assert np.all(attenuation >= low) and np.all(attenuation <= high), (
            f"{bands.nominal_hz[index]:g} Hz at {rate:g} Hz: {np.round(wanted / centre, 3)} {np.round(attenuation, 2)}"
        )
    conformance(
        f"third-octave bands at {rate:g} Hz, largest excess over the limits of class 1",
        0.0,
        max(-worst, 0.0),
        1e-9,
        "dB",
        "standard: IEC 61260-1:2014, table 1, as in pyoctaveband.compliance",
    )


def test_the_bands_are_the_standards(conformance):
    bands = measured(np.zeros(1000), 51200.0)
    nominal = [20, 25, 31.5, 40, 50, 63, 80, 100, 125, 160, 200, 250, 315, 400, 500, 630, 800]
    nominal += [1000, 1250, 1600, 2000, 2500, 3150, 4000, 5000, 6300, 8000, 10000, 12500, 16000, 20000]
    assert bands.nominal_hz.tolist() == nominal
    exact = 1000.0 * 10.0 ** (np.arange(-17, 14) / 10.0)
    conformance(
        "third octaves, exact mid-band frequencies, largest relative distance",
        0.0,
        float(np.max(np.abs(bands.centre_hz / exact - 1.0))),
        1e-9,
        "1",
        "standard: IEC 61260-1:2014, 5.4",
    )


@pytest.mark.parametrize(
    ("rate", "highest"), [(44100.0, 16000.0), (48000.0, 16000.0), (25600.0, 10000.0), (8192.0, 3150.0), (1000.0, 400.0)]
)
def test_no_band_reaches_beyond_what_the_rate_holds(rate, highest):
    assert measured(np.zeros(5000), rate).nominal_hz[-1] == highest


def test_a_rate_too_low_is_refused():
    with pytest.raises(AnalysisError, match="a rate of 40 Hz holds no third octave from 20 Hz up"):
        ThirdOctaveMeter(40.0, 1, 1000)


@pytest.mark.parametrize("rate", [51200.0, 25600.0, 8192.0])
def test_white_noise_has_the_power_of_the_bands_width(rate):
    seconds = 60
    bands = measured(np.random.default_rng(1).standard_normal(int(seconds * rate)), rate)
    width = bands.centre_hz * (10.0**0.05 - 10.0**-0.05)
    found = 10.0 * np.log10(bands.mean_square[0] / (2.0 * width / rate))
    # A band's mean square scatters by 4.34/sqrt(B T) dB: three of that, and 0.12 dB for the effective
    # bandwidth of a Butterworth (IEC 61260-1, 5.12 allows 0.4 dB for class 1).
    assert np.all(np.abs(found) <= 0.12 + 3.0 * 4.34 / np.sqrt(width * seconds)), np.round(found, 2)


def test_the_bands_add_up_to_the_total():
    rate = 51200.0
    x = np.random.default_rng(2).standard_normal(int(20 * rate))
    bands = measured(x, rate)
    width = bands.centre_hz[-1] * 10.0**0.05 - bands.centre_hz[0] * 10.0**-0.05
    expected = 2.0 * width / rate
    assert 10.0 * math.log10(bands.mean_square.sum() / expected) == pytest.approx(0.0, abs=0.1)  # as above


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(0, 6000), max_size=8).map(sorted))
def test_any_cut_into_blocks_gives_the_same_bands(cuts):
    x = np.random.default_rng(3).standard_normal((2, 6000))
    whole, pieces = measured(x, 8192.0), measured(x, 8192.0, cuts)
    assert np.allclose(pieces.mean_square, whole.mean_square, rtol=1e-10)  # rounding of sums in another order


def test_a_last_block_of_one_sample_is_taken():
    x = np.random.default_rng(6).standard_normal(4002)
    assert np.allclose(measured(x, 8192.0, [4001]).mean_square, measured(x, 8192.0).mean_square, rtol=1e-10)


def test_a_channel_with_missing_values_spoils_no_other():
    x = np.random.default_rng(4).standard_normal((2, 20000))
    clean = measured(x, 8192.0).mean_square[1]
    x[0, 7000] = np.nan
    bands = measured(x, 8192.0)
    assert np.array_equal(bands.mean_square[1], clean)
    assert not np.any(np.isfinite(bands.mean_square[0]))


def test_equal_to_another_bank(conformance):
    rate, seconds = 51200, 30
    rng = np.random.default_rng(5)
    spectrum = np.fft.rfft(rng.standard_normal(rate * seconds))
    frequency = np.fft.rfftfreq(rate * seconds, 1.0 / rate)
    spectrum *= np.maximum(frequency, 5.0) ** -0.5
    x = np.fft.irfft(spectrum)
    x *= 1.0 / np.std(x)
    bands = measured(x, float(rate))
    other = OctaveFilterBank(fs=rate, fraction=3, order=6, limits=[19.0, 20500.0])
    levels, centres = other.filter(x, detrend=False)
    chosen = [int(np.argmin(np.abs(np.array(centres) - centre))) for centre in bands.centre_hz]
    theirs = np.asarray(levels).ravel()[chosen]
    ours = 10.0 * np.log10(bands.mean_square[0] / 20e-6**2)
    above = bands.centre_hz > 100.0
    # Same prototype, other rates and other settling at the start: 0.1 dB.
    conformance(
        "third octaves of pink noise above 100 Hz, largest distance",
        0.0,
        float(np.max(np.abs(ours - theirs)[above])),
        0.1,
        "dB",
        "program: pyoctaveband.OctaveFilterBank",
    )
