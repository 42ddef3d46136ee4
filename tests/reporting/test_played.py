"""Sound as a page plays it: LAME encodes it, mpg123 decodes it (both in libsndfile); it is what was put in."""

import io
import math

import numpy as np
import pytest
import soundfile

from tdacoustic.reporting import Document, Section
from tdacoustic.reporting.document import Sound, SoundStrip, SoundTrack
from tdacoustic.reporting.figure import ReportError
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.played import FADE_S, HEADROOM_DB, played_alike
from tdacoustic.reporting.sound_strip import strip_of, strip_png
from tdacoustic.reporting.sound_view import sound_view

RATE = 32000
SECONDS = 3.0
T = np.arange(round(RATE * SECONDS)) / RATE
MIDDLE = slice(2000, -2000)


def falling(seed, rms):
    """Noise that falls by 3 dB an octave."""
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal(T.size))
    spectrum /= np.sqrt(np.maximum(np.fft.rfftfreq(T.size, 1.0 / RATE), 30.0))
    samples = np.fft.irfft(spectrum, T.size)
    return samples * (rms / samples.std())


def heard(mp3):
    samples, rate = soundfile.read(io.BytesIO(mp3), dtype="float64")
    assert rate == RATE
    return samples


def db(ratio):
    return 20.0 * math.log10(ratio)


@pytest.fixture(scope="module")
def sounds():
    line = 0.3 * np.sin(2.0 * np.pi * 437.3 * T)
    return [falling(1, 1.0) + line, line, falling(2, 0.05)]


@pytest.fixture(scope="module")
def played(sounds):
    return played_alike(list(zip(sounds, (0.0, 6.0, 0.0), ("whole", "tone", "whole"), strict=True)), RATE)


def test_levels_compare_and_are_those_that_are_stated(sounds, played):
    full_scale_pa = 20e-6 * 10.0 ** (played.full_scale_db / 20.0)
    assert played.full_scale_db == round(played.full_scale_db)
    for samples, raised, mp3 in zip(sounds, (0.0, 6.0, 0.0), played.mp3, strict=True):
        out = heard(mp3)
        assert out.size == samples.size
        stated = db(np.std(out[MIDDLE]) * full_scale_pa) - raised
        assert stated == pytest.approx(db(np.std(samples[MIDDLE])), abs=0.1)


def test_nothing_clips_and_the_gain_is_no_smaller_than_need_be(sounds, played):
    between_fades = max(np.max(np.abs(samples[MIDDLE])) for samples in sounds)
    highest = max(np.max(np.abs(samples)) for samples in sounds)
    assert played.full_scale_db - db(between_fades / 20e-6) >= HEADROOM_DB
    assert played.full_scale_db - db(highest / 20e-6) < HEADROOM_DB + 1.0
    assert all(np.max(np.abs(heard(mp3))) < 1.0 for mp3 in played.mp3)


def test_bands_keep_their_levels(sounds, played):
    for samples, mp3 in zip((sounds[0], sounds[2]), (played.mp3[0], played.mp3[2]), strict=True):
        powers = [np.abs(np.fft.rfft(one[MIDDLE])) ** 2 for one in (samples, heard(mp3))]
        frequency = np.fft.rfftfreq(T[MIDDLE].size, 1.0 / RATE)
        gain = db(np.sqrt(powers[1].sum() / powers[0].sum()))
        for low, high in ((50, 200), (200, 1000), (1000, 4000), (4000, 10000)):
            inside = (frequency >= low) & (frequency < high)
            assert db(np.sqrt(powers[1][inside].sum() / powers[0][inside].sum())) - gain == pytest.approx(0.0, abs=0.3)


def test_a_line_keeps_its_frequency(played):
    out = heard(played.mp3[1])[MIDDLE]
    power = np.abs(np.fft.rfft(out * np.hanning(out.size), 8 * out.size))
    assert np.argmax(power) * RATE / (8 * out.size) == pytest.approx(437.3, abs=0.05)


def test_sounds_begin_and_end_in_silence(played):
    edge = round(0.1 * FADE_S * RATE)
    for mp3 in played.mp3:
        out = heard(mp3)
        assert max(np.max(np.abs(out[:edge])), np.max(np.abs(out[-edge:]))) < 0.1 * np.max(np.abs(out))


def test_the_same_sound_gives_the_same_bytes(sounds, played):
    again = played_alike(list(zip(sounds, (0.0, 6.0, 0.0), ("whole", "tone", "whole"), strict=True)), RATE)
    assert again == played


def test_a_second_takes_few_bytes(played):
    whole, alone, quiet = (len(mp3) / SECONDS for mp3 in played.mp3)
    assert max(whole, quiet) < 13_000 and alone < 8_000


def test_silence_is_refused():
    with pytest.raises(ReportError, match="silent"):
        played_alike([(np.zeros(3200), 0.0, "whole")], RATE)


# ---------------------------------------------------------------- the strip and the page


def test_the_strip_shows_a_line_where_it_is():
    sweep = np.sin(2.0 * np.pi * (200.0 * T + 0.5 * 100.0 * T**2))  # 200 to 500 Hz
    strip = strip_of(sweep, RATE, 1000.0)
    rows, columns = strip.level_db.shape
    assert 80 <= rows <= 300 and 100 <= columns <= 700
    for part in (0.1, 0.5, 0.9):
        loudest = np.argmax(strip.level_db[:, int(part * columns)])
        assert loudest * 1000.0 / (rows - 1) == pytest.approx(200.0 + 300.0 * part, abs=25.0)
    assert strip_png(strip).startswith(b"\x89PNG") and len(strip_png(strip)) < 60_000


def strip(times=(), frequency=(), label=""):
    return SoundStrip(np.zeros((4, 5)), 2.0, 1000.0, times, frequency, label)


def test_marks_lie_beside_the_line():
    block = Sound("a", "A", "", [SoundTrack("All", b"x")], strip((0.0, 1.0, 2.0), (250.0, 500.0, math.nan), "mesh"))
    _, view = sound_view(block, 1, 10**6)
    upper, lower = ([tuple(map(float, p.split(","))) for p in points.split()] for points in view["strip"]["marks"])
    assert [x for x, _ in upper] == [0.0, 50.0] == [x for x, _ in lower]
    assert [0.5 * (a + b) for (_, a), (_, b) in zip(upper, lower, strict=True)] == pytest.approx([75.0, 50.0])


def test_a_full_page_says_what_it_leaves_out():
    blocks = [Sound(f"s{n}", f"S {n}", "", [SoundTrack("All", bytes(900_000))]) for n in range(14)]
    page = render_html(Document("R", "", "measured", sections=[Section("one", "One", blocks)]))
    assert page.count("<audio") == 12 and page.count("the page holds no more sounds") == 2  # 1.2 MB each of 15
    assert len(page) <= 15_000_000 and "2 sounds are left out: the page holds no more." in page


def test_the_page_plays_data_alone_and_names_are_text():
    block = Sound("a", '<b>"A"</b>', "<i>", [SoundTrack('"><script>', b"x", "<u>")], strip(), "synthetic")
    page = render_html(Document("R", "", "measured", sections=[Section("one", "One", [block])]))
    assert "media-src data:;" in page and "default-src 'none'" in page
    assert '"><script>' not in page and "<b>" not in page and "<u>" not in page
    assert "(synthetic)" in page and 'class="chip origin-synthetic"' in page


def test_two_sounds_of_a_document_have_two_names():
    blocks = [Sound("a", "A", "", [SoundTrack("All", b"x")])] * 2
    with pytest.raises(ReportError, match="sounds are named a"):
        Document("R", "", "measured", sections=[Section("one", "One", blocks)])
    with pytest.raises(ReportError, match="nothing to play"):
        Sound("a", "A", "", [])
