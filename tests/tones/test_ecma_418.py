"""Tone-to-noise and prominence ratio: printed bands, tones of known ratio, several tones in a band, empty spectra."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from tones_in_noise import DENSITY, tones_in_noise, width_hz

from tdacoustic.errors import AnalysisError
from tdacoustic.lines import Line
from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames
from tdacoustic.tones import ecma_tones
from tdacoustic.tones.critical_bands import (
    _THRESHOLD,
    arithmetic_or_geometric_band,
    critical_bandwidth_hz,
    hearing_threshold_db,
    separation_hz,
)
from tdacoustic.tones.ecma_418 import _LOWER_EDGE, _UPPER_EDGE, _polynomial, prominence_criterion_db, ratio_criterion_db

SOURCE = "standard: ECMA-418-1:2024, as quoted by the program phonometry"
RATE = 25600.0


def spectrum_of(x, rate=RATE, quantity="sound_pressure"):
    meter = FramePowerMeter(plan_frames(rate, x.size), 1)
    meter.take(x[None])
    return average_spectrum(meter.result(), 0, quantity, "Pa", "mic")


def only(tones, frequency):
    return min(tones.tones, key=lambda tone: abs(tone.frequency_hz - frequency))


def test_printed_bands_and_spacings(conformance):
    low, high = arithmetic_or_geometric_band(1000.0)
    conformance("lower edge of the critical band at 1 kHz", 922.2, low, 0.05, "Hz", SOURCE + ", clause 10")
    conformance("upper edge of the critical band at 1 kHz", 1084.4, high, 0.05, "Hz", SOURCE + ", clause 10")
    conformance("critical bandwidth at 500 Hz", 117.3, critical_bandwidth_hz(500.0), 0.05, "Hz", SOURCE + ", clause 10")
    conformance("proximity spacing at 150 Hz", 23.0, separation_hz(150.0), 0.05, "Hz", SOURCE + ", 11.6")
    conformance("proximity spacing at 850 Hz", 63.8, separation_hz(850.0), 0.05, "Hz", SOURCE + ", 11.6")


def test_bands_beside_meet_and_are_critical_bands_themselves():
    # The fits of tables 2 and 3 stand for the critical bands that touch the middle one (12.3, 12.4): the outer edge is
    # where a band that starts at the middle one's edge ends. They are fits, and within 6 % of that.
    assert _polynomial(_LOWER_EDGE, 171.4) == 20.0
    for frequency in (200.0, 500.0, 1000.0, 1600.0, 1601.0, 3000.0, 8000.0):
        low, high = arithmetic_or_geometric_band(frequency)
        edge = _polynomial(_LOWER_EDGE, frequency)
        assert low - edge == pytest.approx(critical_bandwidth_hz(math.sqrt(edge * low)), rel=0.06, abs=4.0)
        edge = _polynomial(_UPPER_EDGE, frequency)
        assert edge - high == pytest.approx(critical_bandwidth_hz(math.sqrt(edge * high)), rel=0.06, abs=4.0)


def test_the_pieces_of_the_threshold_of_hearing_meet():
    for piece, following in itertools.pairwise(_THRESHOLD):
        assert piece[1] == following[0]
        assert hearing_threshold_db(piece[1] - 1e-6) == pytest.approx(hearing_threshold_db(piece[1]), abs=0.015)
    assert hearing_threshold_db(15.0) is None and hearing_threshold_db(22050.0) is None


def test_criteria(conformance):
    for frequency, ratio, prominence in (
        (100.0, 16.33, 19.0),
        (500.0, 10.51, 12.01),
        (1000.0, 8.0, 9.0),
        (5e3, 8.0, 9.0),
    ):
        conformance(
            f"criterion of the ratio at {frequency:g} Hz", ratio, ratio_criterion_db(frequency), 0.005, "dB", SOURCE
        )
        conformance(
            f"criterion of the prominence at {frequency:g} Hz",
            prominence,
            prominence_criterion_db(frequency),
            0.005,
            "dB",
            SOURCE,
        )


@pytest.mark.parametrize("frequency", [100.0, 160.3, 400.0, 1000.5, 3150.2, 8000.0])
@pytest.mark.parametrize("ratio_db", [6.0, 20.0, 60.0])
def test_a_tone_of_known_ratio(frequency, ratio_db, conformance):
    tone = only(ecma_tones(spectrum_of(tones_in_noise([(frequency, ratio_db)]))), frequency)
    # White noise of a critical band over 40 s: 4.34 / sqrt(B T) = 0.07 dB; the tone's own beat with the noise of its
    # band is below 0.1 dB; at 6 dB the line under the tone connects two low points of a ragged floor. At 60 dB the
    # tone is 80 dB over the noise of a line, and the skirts of the window count as noise.
    tolerance = {6.0: 0.4, 20.0: 0.25, 60.0: 0.8}[ratio_db]
    what = f"tone-to-noise ratio of {ratio_db:g} dB at {frequency:g} Hz"
    note = "80 dB over the noise of a line, where the skirts of the window count as noise" if ratio_db > 50.0 else ""
    conformance(what, ratio_db, tone.tone_to_noise_db, tolerance, "dB", "known input: sine in white noise", note)
    expected = 10.0 * math.log10(1.0 + 10.0 ** (0.1 * ratio_db))  # the bands beside hold the same noise...
    low, high = arithmetic_or_geometric_band(frequency)
    below = 100.0 if frequency <= 171.4 else low - _polynomial(_LOWER_EDGE, frequency)
    beside = 0.5 * (below + _polynomial(_UPPER_EDGE, frequency) - high)
    expected += 10.0 * math.log10((high - low) / beside)  # ... but for their widths
    leak = 0.3 if ratio_db < 50 else 0.5  # at 60 dB the window's side lobes fill the bands beside
    conformance(
        f"prominence ratio for {ratio_db:g} dB at {frequency:g} Hz",
        expected,
        tone.prominence_db,
        leak,
        "dB",
        "known input: sine in white noise, bands beside by the fits of ECMA-418-1:2024, tables 2 and 3",
    )
    assert tone.tone_to_noise_prominent is bool(tone.tone_to_noise_db >= ratio_criterion_db(tone.frequency_hz))
    level = 10.0 * math.log10(DENSITY * width_hz(frequency) * 10.0 ** (0.1 * ratio_db) / 20e-6**2)
    assert tone.level_db == pytest.approx(level, abs=0.3)


def test_two_near_tones_of_one_band_count_as_one():
    # Above 1 kHz always: the ratio is that of both powers to the noise without either (MoSQITo's issue 80).
    tones = ecma_tones(spectrum_of(tones_in_noise([(2000.0, 15.0), (2100.0, 12.0)])))
    strong, weak = only(tones, 2000.0), only(tones, 2100.0)
    both = (width_hz(2000.0) * 10**1.5 + width_hz(2100.0) * 10**1.2) / width_hz(2000.0)
    assert strong.tone_to_noise_db == pytest.approx(10.0 * math.log10(both), abs=0.2)
    assert strong.combined_hz == (weak.frequency_hz,) and weak.combined_into_hz == strong.frequency_hz
    assert weak.tone_to_noise_db is None and "counted with the tone at 2000.0 Hz" in weak.notes[0]


def test_two_tones_of_one_band_far_apart_below_1_khz_stay_two():
    apart = separation_hz(400.0)
    near, far = 400.0 + 0.7 * apart, 400.0 + 1.5 * apart
    assert far < arithmetic_or_geometric_band(400.0)[1]
    together = ecma_tones(spectrum_of(tones_in_noise([(400.0, 15.0), (near, 12.0)])))
    assert only(together, near).combined_into_hz is not None
    two = ecma_tones(spectrum_of(tones_in_noise([(400.0, 15.0), (far, 12.0)])))
    for frequency, ratio_db in ((400.0, 15.0), (far, 12.0)):  # each with its own power, the noise without either
        assert only(two, frequency).tone_to_noise_db == pytest.approx(ratio_db, abs=0.3)
        assert only(two, frequency).combined_hz == ()


def test_three_tones_no_power_counts_twice():
    # 1000 and 1060 in one band, 1060 and 1120 too, 1000 and 1120 not: the middle one counts with the strongest alone.
    tones = ecma_tones(spectrum_of(tones_in_noise([(1000.0, 20.0), (1060.0, 10.0), (1140.0, 5.0)])))
    last = only(tones, 1140.0)
    assert only(tones, 1060.0).combined_into_hz == pytest.approx(1000.0, abs=0.1)
    assert last.tone_to_noise_db == pytest.approx(5.0, abs=0.4)


def test_a_band_full_of_tone_gives_no_negative_noise():
    # MoSQITo's issue 60: where the tone's level exceeds the band's, its ratio is no number. A tone at the edge of its
    # neighbour's band, and tones 200 dB over nothing.
    quiet = tones_in_noise([(1000.0, 40.0), (1083.5, 60.0), (922.5, 55.0)], density=0.0, seconds=8.0)
    for tone in ecma_tones(spectrum_of(quiet)).tones:
        for value in (tone.tone_to_noise_db, tone.prominence_db):
            assert value is None or math.isfinite(value)
        assert tone.tone_to_noise_db is not None or tone.notes
    edge = ecma_tones(spectrum_of(tones_in_noise([(1000.0, 10.0), (1084.0, 70.0)])))
    assert all(math.isfinite(tone.level_db) for tone in edge.tones)
    assert only(edge, 1084.0).tone_to_noise_db == pytest.approx(70.0, abs=0.3)


def test_a_sine_without_any_noise_has_no_ratio_and_says_so():
    spectrum = spectrum_of(tones_in_noise([(1000.0, 40.0)], density=0.0, seconds=8.0))
    density = np.where(np.abs(spectrum.frequencies_hz - 1000.0) < 1.5, spectrum.density, 0.0)
    tone = only(ecma_tones(replace(spectrum, density=density)), 1000.0)
    assert tone.tone_to_noise_db is None and tone.prominence_db is None
    assert "no noise beside the tone in its critical band" in tone.notes
    assert "no prominence ratio: nothing in the bands beside" in tone.notes


def test_silence_and_noise_alone_have_no_tones():
    silent = replace(spectrum_of(tones_in_noise([], seconds=8.0)), density=np.zeros(12801))
    assert ecma_tones(silent).tones == ()
    prominent = [
        tone
        for seed in range(10)
        for tone in ecma_tones(spectrum_of(tones_in_noise([], seconds=20.0, seed=seed))).tones
        if tone.tone_to_noise_prominent or tone.prominence_prominent
    ]
    assert prominent == []


def test_limits_of_frequency_are_said():
    spectrum = spectrum_of(tones_in_noise([(60.0, 30.0), (9500.0, 20.0), (11500.0, 20.0)]))
    tones = ecma_tones(spectrum)
    assert [round(tone.frequency_hz) for tone in tones.tones] == [9500]
    assert [(round(f), reason.split(",")[0]) for f, reason in tones.excluded] == [
        (60, "outside of 89.1 to 11200 Hz"),
        (11500, "outside of 89.1 to 11200 Hz"),
    ]
    short = spectrum_of(tones_in_noise([(3500.0, 20.0), (3900.0, 20.0)], rate=8192.0), rate=8192.0)
    tones = ecma_tones(short)
    assert tones.tones[0].prominence_db is None  # its upper band ends beyond half the rate
    assert "no prominence ratio: its upper band ends at 4520 Hz, the spectrum at 4096 Hz" in tones.tones[0].notes
    assert tones.excluded[0][1] == "its critical band ends at 4246 Hz, beyond the spectrum's 4096 Hz"


def test_a_tone_below_the_threshold_of_hearing_is_not_prominent():
    # -20 dB at 1 kHz, where the best ears hear -7 dB.
    quiet = tones_in_noise([(1000.0, 20.0)], density=(20e-6) ** 2 * 1e-4 / width_hz(1000.0))
    tone = only(ecma_tones(spectrum_of(quiet)), 1000.0)
    assert tone.tone_to_noise_db == pytest.approx(20.0, abs=0.3)
    assert tone.audible is False and tone.tone_to_noise_prominent is False
    assert "below the lower threshold of hearing" in tone.notes


def test_a_band_of_noise_is_no_discrete_tone():
    rate, seconds = RATE, 40.0
    rng = np.random.default_rng(4)
    transform = np.fft.rfft(rng.standard_normal(int(rate * seconds)) * 1e-3)
    frequency = np.fft.rfftfreq(int(rate * seconds), 1.0 / rate)
    transform[np.abs(frequency - 1000.0) < 20.0] *= 30.0  # 40 Hz wide: a quarter of the critical band
    spectrum = spectrum_of(np.fft.irfft(transform))
    for lines in (None, [Line(1000.0, 1.0, 0.01, 20.0, 10.0)]):
        tone = ecma_tones(spectrum, lines).tones[0]
        assert tone.tone_to_noise_prominent is False and tone.prominence_prominent is False
        assert tone.notes[0] == "wider than 15 % of the critical band's 162 Hz: not a discrete tone of the standard"


def test_a_line_found_twice_is_rated_once():
    spectrum = spectrum_of(tones_in_noise([(3150.2, 20.0)]))
    tones = ecma_tones(spectrum, [Line(3150.2, 0.1, 0.03, 40.0, 0.0), Line(3150.3, 0.1, 0.02, 40.0, 0.0)])
    assert [tone.line for tone in tones.tones] == [0]
    assert tones.tones[0].tone_to_noise_db == pytest.approx(20.0, abs=0.25)
    assert tones.excluded == ((3150.3, "the same line as that at 3150.20 Hz"),)


def test_only_sound_is_rated():
    with pytest.raises(AnalysisError, match="mic: tones are rated in a sound pressure, not in acceleration"):
        ecma_tones(spectrum_of(np.ones(30000), quantity="acceleration"))
