"""Hearing a run: its results are those of the meters, blocks and rasters do not matter, what cannot be had is said."""

import math

import numpy as np
import pytest
from array_recording import recording_of

from tdacoustic.measured import hearing_step
from tdacoustic.measured.hearing_step import HEARING, hear_recording
from tdacoustic.recording import Recording
from tdacoustic.steps.codec import decode, encode
from tdacoustic.tones import DIN_45681, ISO_TS_20065, AudibilityMeter

RATE = 8192.0
ISO, DIN = ISO_TS_20065.name, DIN_45681.name


def tone_in_noise(seconds=10.0, rate=RATE, frequency=1000.0, seed=1):
    t = np.arange(int(seconds * rate)) / rate
    noise = np.random.default_rng(seed).standard_normal(t.size)
    return 0.1 * noise + 0.1 * np.sin(2.0 * np.pi * frequency * t)


@pytest.fixture(scope="module")
def pair():
    return np.stack([tone_in_noise(seed=1), tone_in_noise(seed=2, frequency=500.0)])


def test_the_ratings_are_those_of_the_meter(pair):
    found = hear_recording(recording_of(pair, RATE))
    meter = AudibilityMeter(["c0", "c1"], RATE, pair.shape[1], (ISO_TS_20065, DIN_45681))
    meter.take(pair)
    for rated in meter.result():
        kept = found.rated(rated.channel, rated.method.name)
        assert (kept.mean_db, kept.uncertainty_db, kept.adjustment_db) == (
            rated.mean_db,
            rated.uncertainty_db,
            rated.adjustment_db,
        )
        assert kept.tones == rated.tones
        assert kept.decisive_db.tolist() == [spectrum.decisive_db for spectrum in rated.spectra]
        assert kept.seen.frequency_hz.size == sum(len(spectrum.tones) for spectrum in rated.spectra)
        assert np.all(np.diff(kept.seen.spectrum) >= 0)
    assert round(found.rated("c1", ISO).tones[0].frequency_hz) == 500


def test_the_levels_over_time_are_there(pair):
    found = hear_recording(recording_of(pair, RATE))
    history, place, start_s = found.levels("c1")
    assert (place, start_s, history.weighting) == (1, 0.0, "A")
    level = 10.0 * math.log10(history.mean_square_between(1, 1.0, 10.0) / 20e-6**2)
    # Noise of 0.1 Pa rms white to 4096 Hz, less what the A curve takes off (0.1 dB), and a tone 3.2 dB down at 500 Hz.
    assert level == pytest.approx(75.0, abs=0.5)
    assert found.levels("c9") is None


def test_blocks_do_not_matter(pair, monkeypatch):
    whole = hear_recording(recording_of(pair, RATE))
    monkeypatch.setattr(hearing_step, "BLOCK_BYTES", 16 * 1250)
    pieces = hear_recording(recording_of(pair, RATE))
    assert [rated.tones for rated in whole.audibility] == [rated.tones for rated in pieces.audibility]
    assert np.allclose(whole.rasters[0].levels.fast, pieces.rasters[0].levels.fast, rtol=1e-9)


def test_microphones_on_several_rasters_and_a_late_start():
    slow, fast = recording_of(tone_in_noise(), RATE, start_s=2.5), recording_of(tone_in_noise(rate=16384.0), 16384.0)
    from dataclasses import replace

    channels = (slow["c0"], replace(fast["c0"], name="c1", log_index=1))
    found = hear_recording(Recording("run", slow.logs + fast.logs, channels))
    assert [raster.start_s for raster in found.rasters] == [2.5, 0.0]
    assert {rated.channel for rated in found.audibility} == {"c0", "c1"}
    assert found.levels("c0")[2] == 2.5


def test_a_record_too_short_is_refused_with_the_reason():
    found = hear_recording(recording_of(tone_in_noise(0.2), RATE))
    assert found.rated("c0", ISO) is None and found.levels("c0") is not None
    assert "takes a line spacing of 1.9 to 4 Hz; 1638 samples at 8192 Hz give" in found.reason("c0", "audibility")
    assert found.reason("c0", "levels") is None


def test_a_rate_too_low_is_refused_with_the_reason():
    found = hear_recording(recording_of(tone_in_noise(20.0, 1000.0, 100.0), 1000.0))
    assert "at least 2000 Hz, got 1000" in found.reason("c0", "levels")
    rated = found.rated("c0", ISO)
    assert rated.notes[-1] == "sampled at 1000 Hz: tones above 440 Hz cannot be rated"
    found = hear_recording(recording_of(tone_in_noise(20.0, 160.0, 10.0), 160.0))
    assert found.audibility == () and found.rasters[0].levels is None
    assert found.reason("c0", "audibility") == (
        "a rate of 160 Hz holds no critical band from 50 Hz up, from which tones are rated"
    )


def test_the_note_on_the_rate_is_absent_where_nothing_is_lost():
    found = hear_recording(recording_of(tone_in_noise(4.0, 51200.0), 51200.0))
    assert not any(note.startswith("sampled at") for note in found.rated("c0", ISO).notes)


def test_the_store_keeps_it_and_it_is_small(pair):
    found = hear_recording(recording_of(pair, RATE))
    arrays = []
    tree = encode(found, arrays)
    again = decode(tree, arrays)
    assert again.audibility[0].tones == found.audibility[0].tones
    assert np.array_equal(again.rasters[0].levels.fast, found.rasters[0].levels.fast)
    # Five doubles an interval of 10 ms a channel, and a flag: 4.1 kB a second; the samples are 65 kB a second.
    assert sum(array.nbytes for array in arrays) < 5000 * 20
    assert HEARING.version >= 1


def test_missing_samples_leave_the_rest():
    x = tone_in_noise(20.0)
    x[30000:30100] = np.nan
    found = hear_recording(recording_of(x, RATE))
    rated = found.rated("c0", ISO)
    assert math.isfinite(rated.mean_db) and np.all(np.isfinite(rated.decisive_db))
    assert found.levels("c0")[0].has_missing(0, 3.5, 3.8)
