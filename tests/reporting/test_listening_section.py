"""The section to listen to: what is played, what is said of it, and when there is none."""

import io
import re

import numpy as np
import pytest
import soundfile

from tdacoustic.campaign import load_campaign
from tdacoustic.measured.listening import ConditionSound, Excerpt, ExtractedOrder, Listening, MarkedOrder
from tdacoustic.reporting.document import Alternatives, Details, Notice, Sentences, Sound, Table, walk
from tdacoustic.reporting.sections import listening as module
from tdacoustic.reporting.sections.listening import listening
from tdacoustic.results import Analysis

RATE = 32000
SECONDS = 4.0
T = np.arange(round(RATE * SECONDS)) / RATE
LINE_HZ = 437.3
HEAD = 'schema = "tdacoustic-campaign/1"\nname = "Made up"\norigin = "{origin}"\n'
STATED = '[[level]]\ncondition = "50"\nlevel_db = 80.0\ndistance_m = 4.0\norigin = "a book"\n'


def sound(condition="50", line_rms=0.1, floor_rms=0.2, seed=1, order=True, **keys):
    line = np.sqrt(2.0) * line_rms * np.sin(2.0 * np.pi * LINE_HZ * T)
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal(T.size))
    spectrum /= np.sqrt(np.maximum(np.fft.rfftfreq(T.size, 1.0 / RATE), 30.0))
    floor = np.fft.irfft(spectrum, T.size)
    whole = (floor_rms / floor.std() * floor + line).astype(np.float32)
    times = np.linspace(0.0, SECONDS, 20)
    extracted = ExtractedOrder(line.astype(np.float32), times, np.full(20, LINE_HZ), 2.0) if order else None
    keys = {"no_order": None if order else "it was not known", **keys}
    excerpt = Excerpt("mic_1", float(RATE), 1.5, whole, 14400.0, order=extracted, **keys)
    marked = MarkedOrder("mesh x1", 31.0, "gearbox", LINE_HZ, line_rms)
    return ConditionSound(condition, f"run {condition}", excerpt, marked, False, ("why",))


@pytest.fixture
def analysis(tmp_path):
    def make(*sounds, origin="measured", left_out=()):
        path = tmp_path / "campaign.toml"
        path.write_text(HEAD.format(origin=origin) + STATED, encoding="utf-8")
        nothing = ((),) * 2
        found = Listening(tuple(sounds), tuple(left_out))
        return Analysis(load_campaign(path), (), *nothing, {}, (), (), (), listening=found)

    return make


def blocks_of(section, kind):
    return [block for block in walk(section.blocks) if isinstance(block, kind)]


def heard(mp3):
    return soundfile.read(io.BytesIO(mp3), dtype="float64")[0]


def line_level(samples):
    """Rms of the line by a plain Fourier sum."""
    weights = np.hanning(samples.size)
    carrier = np.exp(-2j * np.pi * LINE_HZ * np.arange(samples.size) / RATE)
    return np.sqrt(2.0) * abs(np.sum(weights * samples * carrier)) / weights.sum()


def test_three_versions_of_the_same_seconds(analysis):
    (block,) = blocks_of(listening(analysis(sound())), Sound)
    assert [track.label for track in block.tracks] == ["As recorded", "mesh x1 alone", "mesh x1 off and on"]
    whole, alone, switched = (heard(track.mp3) for track in block.tracks)
    assert whole.size == alone.size == switched.size == T.size
    power = np.abs(np.fft.rfft(alone * np.hanning(alone.size)))
    assert np.argmax(power) * RATE / alone.size == pytest.approx(LINE_HZ, abs=0.25)
    on, off = slice(round(0.1 * RATE), round(0.9 * RATE)), slice(round(1.1 * RATE), round(1.9 * RATE))
    assert line_level(switched[on]) == pytest.approx(line_level(whole[on]), rel=0.03)
    assert line_level(switched[off]) < 0.1 * line_level(whole[off])


def test_the_gain_is_stated_and_the_same_for_all(analysis):
    sounds = sound("50"), sound("80", 0.4, 0.8, 2)
    section = listening(analysis(*sounds))
    text = " ".join(block.text for block in section.blocks if hasattr(block, "text"))
    full_scale = 20e-6 * 10.0 ** (float(re.search(r"a peak of (\d+) dB", text)[1]) / 20.0)
    for block, put_in in zip(blocks_of(section, Sound), sounds, strict=True):
        for track in block.tracks[:2]:
            stated = float(re.match(r"([\d.]+) dB", track.text)[1])
            played = 20.0 * np.log10(np.std(heard(track.mp3)[2000:-2000]) * full_scale / 20e-6)
            assert played == pytest.approx(stated, abs=0.2)
        whole = line_level(heard(block.tracks[0].mp3)) * full_scale
        assert whole == pytest.approx(line_level(put_in.excerpt.samples), rel=0.012)  # 0.1 dB


def test_an_order_far_below_is_raised_and_that_is_said(analysis):
    section = listening(analysis(sound(line_rms=0.002)))
    (block,) = blocks_of(section, Sound)
    assert "played 24 dB louder than the others" in block.tracks[1].text
    text = " ".join(one.text for one in section.blocks if hasattr(one, "text"))
    full_scale = 20e-6 * 10.0 ** (float(re.search(r"a peak of (\d+) dB", text)[1]) / 20.0)
    got = 20.0 * np.log10(line_level(heard(block.tracks[1].mp3)) * full_scale / 0.002)
    assert got == pytest.approx(24.0, abs=0.3)


def test_what_is_said_of_an_excerpt(analysis):
    held = sound(n_missing=12)
    held = ConditionSound(
        held.condition, held.run, held.excerpt, held.marked, False, ("why",), ("clipping: 4 samples",)
    )
    section = listening(analysis(held))
    (block,) = blocks_of(section, Sound)
    for words in (
        "Run run 50, mic_1, 1.50 to 5.50 s",
        "Listen for mesh x1 (order 31), given to the gearbox, 437 Hz: 7.0 dB below the whole sound",
        "12 samples are missing",
        "The checks say of this channel: clipping: 4 samples",
    ):
        assert words in block.caption
    (table,) = blocks_of(section, Table)
    row = dict(zip((column.key for column in table.columns), table.rows[0], strict=True))
    assert (row["condition"], row["channel"], row["order"], row["source"]) == ("50", "mic_1", "mesh x1", "gearbox")
    assert row["chosen"] == "why"
    assert row["order_level_db"] == pytest.approx(20.0 * np.log10(0.1 / 20e-6), abs=0.01)
    assert row["lowest_hz"] == row["highest_hz"] == pytest.approx(LINE_HZ)


def test_whose_sound_it_is(analysis):
    (notice,) = blocks_of(listening(analysis(sound())), Notice)
    assert "recordings of mic_1" in notice.text and "sound_excerpts = false" in notice.text
    section = listening(analysis(sound(), origin="synthetic"))
    (notice,) = blocks_of(section, Notice)
    assert notice.kind == "synthetic" and "No microphone recorded them" in notice.text
    assert all(block.origin == "synthetic" for block in blocks_of(section, Sound))


def test_an_order_that_could_not_be_extracted(analysis):
    (block,) = blocks_of(listening(analysis(sound(order=False))), Sound)
    assert [track.label for track in block.tracks] == ["As recorded"]
    assert "it could not be extracted: it was not known" in block.caption


def test_what_is_left_out_is_named(analysis):
    left_out = [("60", "full"), ("70", "full"), ("80", "no microphone")]
    (block,) = blocks_of(listening(analysis(sound(), left_out=left_out)), Sentences)
    assert block.items == ("Without an excerpt: 60 and 70 (full).", "Without an excerpt: 80 (no microphone).")


def test_conditions_to_choose_from_and_many_that_are_left_out(analysis):
    sounds = [sound(str(number)) for number in range(5)]
    section = listening(analysis(*sounds, left_out=[(f"c{number}", "full") for number in range(40)]))
    (choice,) = blocks_of(section, Alternatives)
    assert [name for name, _ in choice.views] == ["0", "1", "2", "3", "4"]
    assert len({block.name for block in blocks_of(section, Sound)}) == 5
    assert "40 conditions without an excerpt" in [block.summary for block in blocks_of(section, Details)]


def test_nothing_to_listen_to_is_no_section(analysis):
    assert listening(analysis()) is None
    assert listening(analysis(left_out=[("50", "no recording")])) is None


def test_a_library_without_mp3_says_so(analysis, monkeypatch):
    monkeypatch.setattr(module, "can_encode", lambda: False)
    section = listening(analysis(sound()))
    assert blocks_of(section, Sound) == [] and "writes no MP3" in blocks_of(section, Notice)[0].text
