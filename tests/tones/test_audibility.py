"""Tonal audibility over blocks: tones of known audibility, the standards' limits, and records without tones."""

import math

import numpy as np
import pytest
from tones_in_noise import DENSITY, tones_in_noise, width_hz

from tdacoustic.errors import AnalysisError
from tdacoustic.spectra import FramePowerMeter, a_weighting_db, average_spectrum, plan_frames
from tdacoustic.tones import DIN_45681, ISO_TS_20065, AudibilityMeter, ShortTimeMeter, audible_tones
from tdacoustic.tones.audibility import _candidates
from tdacoustic.tones.critical_bands import geometric_band, masking_index_db
from tdacoustic.tones.masking import (
    TONE_OVER_DB,
    groups_of,
    is_distinct,
    mean_narrow_band_level_db,
    tone_level_db,
)

RATE = 25600.0


def rated(x, methods=(ISO_TS_20065,), rate=RATE, cuts=(), **options):
    data = np.atleast_2d(x)
    names = [f"mic_{number}" for number in range(len(data))]
    meter = AudibilityMeter(names, rate, data.shape[1], methods, **options)
    for block in np.split(data, cuts, axis=1):
        meter.take(block)
    return meter.result()


def whitened(tones, **options):
    """Noise whose A-weighted density is flat, with tones: then the mean narrow-band level is that of the noise."""
    x = tones_in_noise((), **options)
    frequency = np.fft.rfftfreq(x.size, 1.0 / RATE)
    with np.errstate(divide="ignore"):
        gain = 10.0 ** (-0.05 * np.maximum(a_weighting_db(frequency), -45.0))
    x = np.fft.irfft(np.fft.rfft(x) * gain, x.size)
    t = np.arange(x.size) / RATE
    for number, (tone, ratio_db) in enumerate(tones):
        level = 10.0 ** (0.1 * (ratio_db - float(a_weighting_db(tone))))
        x += math.sqrt(2.0 * DENSITY * width_hz(tone) * level) * np.sin(2.0 * np.pi * tone * t + number)
    return x


@pytest.mark.parametrize("frequency", [60.3, 137.3, 500.0, 1000.7, 4000.0, 10000.3])
def test_a_tone_of_known_audibility(frequency, conformance):
    (result,) = rated(whitened([(frequency, 8.0)], seconds=40.0))
    tone = min(result.tones, key=lambda tone: abs(tone.frequency_hz - frequency))
    assert tone.n_spectra == len(result.spectra) == 13
    # A band of 37 lines and ten averages of 3 s: 0.25 dB each, 0.07 dB the mean of thirteen; leaving out lines that
    # stand 6 dB over takes none of such noise. A tone between two lines loses up to 0.3 dB below the 10 dB cut.
    conformance(
        f"audibility of a tone of 8 dB over its band's noise at {frequency:g} Hz",
        8.0 - masking_index_db(frequency),
        tone.audibility_db,
        0.5,
        "dB",
        "known input: sine in noise that is white when A-weighted; ISO/PAS 20065:2016, formulas (12) to (14)",
    )
    level = 10.0 * math.log10(DENSITY * width_hz(frequency) / 20e-6**2) + 8.0
    assert tone.level_db == pytest.approx(level, abs=0.4)
    assert abs(tone.frequency_hz - frequency) < 4.0 * tone.frequency_error_hz + 0.02


def test_two_tones_of_one_band_add_up_above_1_khz_and_stay_two_below(conformance):
    (near,) = rated(whitened([(2000.0, 6.0), (2100.0, 6.0)], seconds=20.0))
    both = 10.0 * math.log10(10**0.6 * (1.0 + width_hz(2100.0) / width_hz(2000.0)))
    for tones in near.spectra:
        assert len(tones.tones) == 2 and len(tones.groups) == 1
    conformance(
        "audibility of two tones of one critical band",
        both - masking_index_db(2050.0),
        near.mean_db,
        0.5,
        "dB",
        "known input: two sines; ISO/PAS 20065:2016, formula (17)",
    )
    (apart,) = rated(whitened([(400.0, 6.0), (440.0, 6.0)], seconds=20.0))
    assert all(len(tones.tones) == 2 and not tones.groups for tones in apart.spectra)
    assert apart.mean_db == pytest.approx(6.0 - masking_index_db(420.0), abs=0.8)  # the louder of two equal ones
    (close,) = rated(whitened([(400.0, 6.0), (420.0, 6.0)], seconds=20.0))
    assert all(len(tones.groups) == 1 for tones in close.spectra)


def test_noise_alone_and_silence():
    for seed in range(4):  # no line of ten averages stands 6 dB over the mean of its band
        (result,) = rated(tones_in_noise((), seconds=40.0, seed=seed))
        assert result.mean_db <= -9.0 and len(result.tones) <= 1
    iso, din = rated(np.zeros(int(20 * RATE)), (ISO_TS_20065, DIN_45681))
    assert iso.mean_db == din.mean_db == -10.0 and iso.tones == () and iso.uncertainty_db == 0.0
    assert iso.adjustment_db is None and din.adjustment_db == 0


def test_a_pure_tone_without_noise_stays_a_number():
    t = np.arange(int(9 * RATE)) / RATE
    (result,) = rated(np.sin(2.0 * np.pi * 1000.0 * t))
    assert math.isfinite(result.mean_db) and result.mean_db > 60.0
    assert [round(tone.frequency_hz) for tone in result.tones] == [1000]


def test_lower_limits_and_the_end_of_the_spectrum():
    x = whitened([(40.0, 15.0), (70.0, 15.0), (200.0, 10.0), (12500.0, 15.0)], seconds=12.0)
    iso, din = rated(x, (ISO_TS_20065, DIN_45681))
    assert [round(tone.frequency_hz) for tone in iso.tones] == [70, 200]
    assert [round(tone.frequency_hz) for tone in din.tones] == [200]
    reasons = {round(frequency / 10) * 10: reason for frequency, reason in din.excluded}
    assert reasons[70] == "below 90 Hz, from which DIN 45681:2005-03 rates tones"
    assert reasons[12500] == "its critical band ends at 14157 Hz, beyond the spectrum's 12800 Hz"
    assert [reason for frequency, reason in iso.excluded if frequency < 50] == [
        "below 50 Hz, from which ISO/TS 20065:2022 rates tones"
    ]


def test_the_tone_adjustment_is_dins_alone():
    iso, din = rated(whitened([(1000.0, 3.0)], seconds=40.0), (ISO_TS_20065, DIN_45681))
    assert iso.mean_db == din.mean_db and iso.adjustment_db is None
    assert din.adjustment_db == 3  # 3 + 2.82 dB


def test_what_the_standard_asks_and_the_record_lacks_is_said():
    (short,) = rated(tones_in_noise((), seconds=2.0))
    assert short.notes == (
        "averaged over 2 s; ISO/TS 20065:2022 asks for 3 s",
        "1 spectrum, fewer than 12: the uncertainty counts with the result",
    )
    assert rated(tones_in_noise((), seconds=37.0))[0].notes == ()
    gap = tones_in_noise((), seconds=40.0)
    gap[int(3.0 * RATE) : int(6.1 * RATE)] = np.nan
    (result,) = rated(gap)
    assert len(result.spectra) == 12 and math.isfinite(result.mean_db)
    assert result.notes == ("stretches left out because no frame of them holds numbers throughout: 1",)
    (nothing,) = rated(np.full(int(7 * RATE), np.nan))
    assert nothing.mean_db is None and nothing.uncertainty_db is None
    assert nothing.notes[0] == "no spectrum: no stretch of the averaging time holds numbers throughout"


def test_line_spacings_outside_of_the_limits_are_refused():
    for spacing in (1.0, 1.8, 4.2, 8.0):
        with pytest.raises(AnalysisError, match=r"line spacing of 1.9 to 4 Hz; .* samples at 25600 Hz give .* Hz"):
            AudibilityMeter(["mic"], RATE, 10**6, line_spacing_hz=spacing)
    with pytest.raises(AnalysisError, match="2560 samples at 25600 Hz give 10 Hz"):
        AudibilityMeter(["mic"], RATE, 2560)
    meter = FramePowerMeter(plan_frames(RATE, 100000, 1.0), 1)
    meter.take(np.ones((1, 100000)))
    spectrum = average_spectrum(meter.result(), 0, "sound_pressure", "Pa", "mic")
    with pytest.raises(AnalysisError, match=r"mic: DIN 45681:2005-03 takes a line spacing of 1.9 to 4 Hz, got 1 Hz"):
        audible_tones(spectrum, DIN_45681)
    with pytest.raises(AnalysisError, match="not in acceleration"):
        audible_tones(average_spectrum(meter.result(), 0, "acceleration", "m/s^2", "a"))


def test_any_cut_into_blocks_gives_the_same_ratings():
    x = np.stack([tones_in_noise([(1000.0, 8.0)], seconds=7.0, seed=seed) for seed in (1, 2)])
    whole = rated(x)
    pieces = rated(x, cuts=[1, 5000, 76799, 76800, 76801, 150000])
    assert [(r.channel, r.mean_db, r.tones) for r in whole] == [(r.channel, r.mean_db, r.tones) for r in pieces]


def test_a_tone_that_comes_and_goes_counts_with_minus_ten_where_it_is_not():
    x = whitened([(1000.0, 8.0)], seconds=24.0)
    quiet = whitened((), seconds=24.0)
    x[x.size // 2 :] = quiet[x.size // 2 :]
    (result,) = rated(x)
    (tone,) = (tone for tone in result.tones if abs(tone.frequency_hz - 1000.0) < 2.0)
    assert tone.n_spectra == 4 and len(result.spectra) == 8
    half = 10.0 * math.log10(0.5 * (10.0 ** (0.1 * (8.0 - masking_index_db(1000.0))) + 0.1))
    assert tone.audibility_db == pytest.approx(half, abs=0.4)


def test_the_sieve_loses_no_tone():
    """Against the iteration on every local maximum."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        levels = 10.0 * np.log10(rng.chisquare(rng.integers(2, 30), 400)) + np.cumsum(rng.normal(0.0, 0.3, 400))
        levels[rng.integers(20, 380, 12)] += rng.uniform(3.0, 25.0, 12)
        step, found = 2.7, set()
        for peak in range(1, 399):
            if not (levels[peak] >= levels[peak - 1] and levels[peak] > levels[peak + 1]):
                continue
            low, high = geometric_band(peak * step)
            band = max(1, math.ceil(low / step - 1e-9)), min(400, math.floor(high / step + 1e-9) + 1)
            if levels[peak] > mean_narrow_band_level_db(levels, band, peak)[0] + TONE_OVER_DB:
                found.add(peak)
        assert found <= set(_candidates(levels, step)) and found


def test_a_smeared_tone_is_not_distinct():
    t = np.arange(int(12 * RATE)) / RATE
    steady = tones_in_noise([(1000.0, 12.0)], seconds=12.0)
    assert rated(steady)[0].tones
    wandering = tones_in_noise((), seconds=12.0)
    phase = 2.0 * np.pi * (1000.0 * t + 60.0 / (2 * np.pi * 0.5) * np.sin(2 * np.pi * 0.5 * t))  # +-60 Hz
    wandering += math.sqrt(2.0 * DENSITY * width_hz(1000.0) * 10**1.2) * np.sin(phase)
    assert [tone for tone in rated(wandering)[0].tones if tone.n_spectra > 1] == []


def test_one_line_carries_no_bandwidth_correction():
    levels = np.array([40.0, 60.0, 54.0])
    assert tone_level_db(levels, [1]) == 60.0
    assert tone_level_db(levels, [1, 2]) == pytest.approx(60.97 - 1.76, abs=0.01)


def test_tones_of_two_bands_make_no_group():
    assert groups_of([500.0, 1500.0], [3.0, 4.0]) == ()
    assert groups_of([], []) == ()


def test_short_time_spectra_are_those_of_the_stretches():
    x = tones_in_noise((), seconds=10.0)
    meter = ShortTimeMeter(("mic",), RATE, x.size)
    found = list(meter.take(x[None]))
    assert [(spectrum.start_s, spectrum.end_s) for spectrum in found] == [(0.0, 3.0), (3.0, 6.0), (6.0, 9.0)]
    assert 1.9 <= meter.line_spacing_hz <= 4.0
    part = x[int(3 * RATE) : int(6 * RATE)]
    own = FramePowerMeter(plan_frames(RATE, part.size, meter.line_spacing_hz), 1)
    own.take(part[None])
    expected = average_spectrum(own.result(), 0, "sound_pressure", "Pa").density
    assert np.allclose(found[1].spectra[0].density, expected, rtol=1e-6)


def test_a_distinct_tone_is_narrow_and_steep():
    """Edges two lines from the peak at 135 Hz: 24 dB an octave is a drop of 1.36 dB by DIN, 1.92 and 0.96 dB by ISO."""
    step, peak = 2.7, 50

    def judged(below_db, above_db, print_of, extent=(49, 51)):
        levels = np.full(100, 20.0)
        levels[extent[0] : extent[1] + 1] = 60.0
        levels[extent[0] - 1], levels[extent[1] + 1] = 60.0 - below_db, 60.0 - above_db
        return is_distinct(levels, step, peak, extent, print_of)

    assert judged(1.37, 1.37, "din")
    assert not judged(1.35, 30.0, "din") and not judged(30.0, 1.35, "din")
    assert judged(1.93, 0.97, "iso") and not judged(1.37, 1.37, "iso") and not judged(1.93, 0.95, "iso")
    # Formula (9): at 135 Hz a tone is no wider than 29.5 Hz, ten lines of 2.7 Hz.
    assert judged(30.0, 30.0, "din", (45, 54)) and not judged(30.0, 30.0, "din", (45, 55))


def test_a_tone_nobody_hears_is_marked():
    # 10 dB over the noise of its band in both, which at -25 dB lies below the lower threshold of hearing (-7 dB).
    for density, heard in ((DENSITY, True), ((20e-6) ** 2 * 10**-2.5 / width_hz(1000.0), False)):
        (result,) = rated(tones_in_noise([(1000.0, 10.0)], seconds=9.0, density=density))
        (tone,) = (tone for tone in result.tones if tone.n_spectra == 3)
        assert tone.over_threshold is heard


def test_tones_beyond_the_critical_bands_are_not_rated():
    x = tones_in_noise([(15000.0, 12.0), (16400.0, 12.0)], seconds=9.0, rate=51200.0)
    (result,) = rated(x, rate=51200.0)
    assert [round(tone.frequency_hz, -2) for tone in result.tones if tone.n_spectra == 3] == [15000.0]
    reasons = {round(frequency, -2): reason for frequency, reason in result.excluded}
    assert reasons[16400.0] == "above 15500 Hz, where the critical bands of hearing end"
    assert any("15500 Hz" in limit for limit in ISO_TS_20065.limits)
