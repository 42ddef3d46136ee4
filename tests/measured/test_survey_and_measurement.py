"""Survey and measurement of a whole run: levels, weighting, bands, siblings of a raster, background."""

import math
from dataclasses import replace

import numpy as np
import pytest
from array_recording import recording_of

from tdacoustic.errors import AnalysisError
from tdacoustic.measured import MeasurementSettings, RunSpeed, survey_recording
from tdacoustic.measured.levels import energy_mean_db
from tdacoustic.measured.measurement_step import measure_run
from tdacoustic.recording import Recording
from tdacoustic.speed import SpeedProfile

PUT_IN = "known input: tone of 1 Pa"

RATE = 8192.0
T = np.arange(int(16 * RATE)) / RATE


def measured(recording, speed=None, bands=True, **changes):
    settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, (("motor", 25.0),))
    return measure_run(replace(settings, **changes), speed or RunSpeed(()), survey_recording(recording, bands=bands))


def tone(frequency, rms=1.0):
    return math.sqrt(2.0) * rms * np.sin(2.0 * np.pi * frequency * T)


@pytest.mark.parametrize(("frequency", "weighting"), [(125.8925, -16.1), (1000.0, 0.0), (1995.262, 1.2)])
def test_levels_of_a_tone(frequency, weighting, conformance):
    x = tone(frequency) + 1e-3 * np.random.default_rng(1).standard_normal(T.size)
    (result,) = measured(recording_of(x, RATE)).channels
    level = 20.0 * math.log10(result.rms / 20e-6)
    conformance(f"level of a 1 Pa tone at {frequency:.4g} Hz", 93.979, level, 0.002, "dB", PUT_IN)
    conformance(
        f"A-weighted level of a 1 Pa tone at {frequency:.4g} Hz",
        93.979 + weighting,
        result.laeq_db,
        0.06,  # the table is rounded to 0.1 dB; 0.01 dB for a tone between two lines
        "dB",
        "standard: IEC 61672-1:2013, table 3",
    )
    (line,) = result.lines
    conformance(f"rms of the line of a 1 Pa tone at {frequency:.4g} Hz", 1.0, line.rms, 2e-3, "Pa", PUT_IN)
    band = max(result.bands, key=lambda band: band.mean_square)
    assert band.nominal_hz == pytest.approx(frequency, rel=0.01)
    assert 10.0 * math.log10(band.mean_square) == pytest.approx(0.0, abs=0.05)  # pass-band ripple: 0


def test_bands_beside_a_strong_line_depend_on_the_filter():
    x = tone(1000.0) + 1e-4 * np.random.default_rng(1).standard_normal(T.size)
    (result,) = measured(recording_of(x, RATE)).channels
    assert {band.nominal_hz for band in result.bands if band.filter_dependent} == {500, 630, 800, 1250, 1600, 2000}


def test_the_level_band_holds_what_lies_in_it():
    x = tone(100.0, 2.0) + tone(1000.0, 1.0) + tone(3900.0, 5.0)
    (result,) = measured(recording_of(x, RATE), level_band_hz=(500.0, 2000.0)).channels
    assert result.band_rms == pytest.approx(1.0, abs=1e-3)
    (result,) = measured(recording_of(x, RATE)).channels
    assert result.level_band_hz == (20.0, 0.4 * RATE)
    assert result.band_rms == pytest.approx(math.sqrt(5.0), abs=1e-3)


def test_only_sounds_are_weighted_and_only_sound_and_vibration_have_bands():
    x = np.random.default_rng(2).standard_normal((3, T.size))
    results = measured(recording_of(x, RATE, ["sound_pressure", "acceleration", "voltage"])).channels
    assert [result.laeq_db is None for result in results] == [False, True, True]
    assert [len(result.bands) > 0 for result in results] == [True, True, False]


def test_channels_on_several_rasters_are_surveyed_each_on_its_own():
    slow, fast = recording_of(tone(300.0)[::2], RATE / 2), recording_of(tone(300.0, 2.0), RATE)
    channels = (slow["c0"], replace(fast["c0"], name="c1", log_index=1))
    results = measured(Recording("run", slow.logs + fast.logs, channels)).channels
    assert [result.lines[0].rms for result in results] == pytest.approx([1.0, 2.0], rel=1e-3)
    assert [result.lines[0].frequency_hz for result in results] == pytest.approx([300.0, 300.0], abs=1e-3)
    survey = survey_recording(Recording("run", slow.logs + fast.logs, channels), bands=False)
    assert survey.of_channel("c1")[1] == 0 and len(survey.rasters) == 2
    with pytest.raises(AnalysisError, match="no channel 'x' in the survey"):
        survey.of_channel("x")


def test_a_run_up_has_a_map_and_no_spectrum():
    sweep = np.sin(2.0 * np.pi * (200.0 * T + 50.0 * T**2))  # 200 Hz at the start, 1800 Hz at the end
    profile = SpeedProfile("tacho", "motor", "1/s", T[::400], 10.0 + 5.0 * T[::400])
    (result,) = measured(recording_of(sweep, RATE), RunSpeed((profile,))).channels
    assert (result.spectrum, result.floor, result.lines, result.families) == (None, None, (), ())
    ridge = result.map.frequencies_hz[np.argmax(result.map.density, axis=0)]
    # The energy of a segment lies between its frames' instants; 100 Hz/s, frames of a second.
    assert np.max(np.abs(ridge - (200.0 + 100.0 * result.map.times_s))) < 70.0
    assert result.rms == pytest.approx(math.sqrt(0.5), rel=1e-3)


def test_refused_channels_are_bad_and_the_rest_is_measured():
    run = measured(recording_of(tone(300.0), RATE), refused=(("mic_9", "not in the log"),))
    assert [(v.channel, v.check, v.verdict) for v in run.verdicts if v.verdict == "bad"] == [
        ("mic_9", "channel", "bad")
    ]
    assert run.channel("c0").usable and run.channel("mic_9") is None


def test_energies_are_averaged_not_decibels(conformance):
    conformance(
        "energy mean of 80 and 90 dB",
        87.404,
        energy_mean_db([80.0, 90.0]),
        1e-3,
        "dB",
        "analytic: 10 lg of the mean energy",
    )
    assert energy_mean_db([]) is None


def test_the_survey_does_not_depend_on_the_size_of_its_blocks(monkeypatch):
    from tdacoustic.measured import survey_step

    recording = recording_of(np.random.default_rng(3).standard_normal((2, 50001)), RATE)
    whole = survey_recording(recording).rasters[0]
    monkeypatch.setattr(survey_step, "BLOCK_BYTES", 16 * 1250)
    pieces = survey_recording(recording).rasters[0]
    assert np.array_equal(whole.powers.density, pieces.powers.density)
    assert np.allclose(whole.bands.mean_square, pieces.bands.mean_square, rtol=1e-10)  # order of a sum
    assert np.allclose(whole.statistics.mean_square, pieces.statistics.mean_square, rtol=1e-10)
