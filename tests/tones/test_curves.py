"""The curves of the figure: a tone a decibel over one is prominent or audible, a decibel under it is not."""

import math

import numpy as np
import pytest
from tones_in_noise import DENSITY, tones_in_noise, width_hz

from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames
from tdacoustic.tones import AudibilityMeter, audible_level_db, ecma_tones, prominent_level_db
from tdacoustic.tones.critical_bands import masking_index_db
from tdacoustic.tones.ecma_418 import ratio_criterion_db

RATE = 25600.0


def spectrum_of(x):
    meter = FramePowerMeter(plan_frames(RATE, x.size), 1)
    meter.take(x[None])
    return average_spectrum(meter.result(), 0, "sound_pressure", "Pa", "mic")


@pytest.fixture(scope="module")
def quiet():
    return spectrum_of(tones_in_noise((), seconds=4.0))


def over_noise(level_db, frequency):
    return level_db - 10.0 * math.log10(DENSITY * width_hz(frequency) / 20e-6**2)


@pytest.mark.parametrize("frequency", [200.0, 1000.0, 4000.0])
def test_prominent_from_the_curve_on(quiet, frequency):
    (level,) = prominent_level_db(quiet, np.full_like(quiet.density, DENSITY), [frequency])
    ratio = over_noise(level, frequency)
    assert ratio == pytest.approx(ratio_criterion_db(frequency), abs=0.05)  # lines of 1 Hz at the band's edges
    for over in (1.0, -1.0):
        found = ecma_tones(spectrum_of(tones_in_noise([(frequency, ratio + over)])))
        tone = min(found.tones, key=lambda tone: abs(tone.frequency_hz - frequency))
        assert tone.tone_to_noise_prominent is (over > 0.0)


@pytest.mark.parametrize("frequency", [500.0, 2000.0])
def test_audible_from_the_curve_on(quiet, frequency):
    (level,) = audible_level_db(quiet, np.full_like(quiet.density, DENSITY), [frequency])
    ratio = over_noise(level, frequency)
    assert ratio == pytest.approx(masking_index_db(frequency), abs=0.05)
    meter = AudibilityMeter(["mic"], RATE, int(40 * RATE))
    meter.take(tones_in_noise([(frequency, ratio + 3.0)], seconds=40.0)[None])
    (rated,) = meter.result()
    tone = min(rated.tones, key=lambda tone: abs(tone.frequency_hz - frequency))
    assert tone.audibility_db == pytest.approx(3.0, abs=0.7)  # noise that is white before the A-weighting


def test_no_curve_where_a_method_does_not_rate(quiet):
    assert np.all(np.isnan(prominent_level_db(quiet, quiet.density, [50.0, 11500.0])))
    assert np.isnan(audible_level_db(quiet, quiet.density, [40.0, 12700.0, 15600.0])).tolist() == [True, True, True]
    assert np.all(np.isfinite(audible_level_db(quiet, quiet.density, [50.0, 10000.0])))
