"""Sounds in a real browser: they play, and what its own decoder makes of them is what was put in.

Needs what `test_in_browser` needs.
"""

import base64

import numpy as np
import pytest
from test_in_browser import chromium, opened  # noqa: F401

from tdacoustic.reporting import Document, Section
from tdacoustic.reporting.document import Sound, SoundTrack
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.played import played_alike
from tdacoustic.reporting.sound_strip import strip_of

RATE = 32000
SECONDS = 3.0
T = np.arange(round(RATE * SECONDS)) / RATE
LINE = 0.3 * np.sin(2.0 * np.pi * 437.3 * T)
WHOLE = LINE + 0.1 * np.random.default_rng(1).standard_normal(T.size)
PLAYED = played_alike([(WHOLE, 0.0, "whole"), (LINE, 0.0, "tone")], RATE)

DECODE = """async (index) => {
  const audio = document.querySelectorAll('audio')[index];
  const bytes = Uint8Array.from(atob(audio.src.split(',')[1]), (c) => c.charCodeAt(0));
  const held = await new OfflineAudioContext(1, 1, 32000).decodeAudioData(bytes.buffer);
  const values = new Uint8Array(held.getChannelData(0).buffer);
  let text = '';
  for (let at = 0; at < values.length; at += 8192) text += String.fromCharCode(...values.subarray(at, at + 8192));
  return [held.sampleRate, held.numberOfChannels, btoa(text)];
}"""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    times = np.linspace(0.0, SECONDS, 20)
    strip = strip_of(WHOLE, RATE, 1100.0, (times, np.full(20, 437.3)), "mesh x1, 437 Hz")
    tracks = [SoundTrack("As recorded", PLAYED.mp3[0], "80 dB"), SoundTrack("mesh x1 alone", PLAYED.mp3[1], "77 dB")]
    blocks = [
        Sound("one", "Condition 50", "A caption.", tracks, strip, "measured"),
        Sound("two", "Condition 80", "A caption.", tracks[:1], None, "synthetic"),
    ]
    path = tmp_path_factory.mktemp("sound") / "report.html"
    page = render_html(Document("R", "", "measured", sections=[Section("listening", "To listen to", blocks)]))
    path.write_text(page, encoding="utf-8", newline="\n")
    return path.as_uri()


def state(page, index):
    return page.evaluate(
        "(i) => { const a = document.querySelectorAll('audio')[i]; return [a.paused, a.currentTime, a.duration]; }",
        index,
    )


def play(page, index):
    page.evaluate("(i) => document.querySelectorAll('audio')[i].play()", index)
    page.wait_for_function("(i) => document.querySelectorAll('audio')[i].currentTime > 0.1", arg=index)


def test_a_sound_plays_one_at_a_time_and_keeps_its_place(chromium, address):  # noqa: F811
    with opened(chromium, address) as page:
        page.wait_for_function("() => [...document.querySelectorAll('audio')].every((a) => a.readyState >= 1)")
        assert [state(page, index)[2] for index in range(3)] == pytest.approx([SECONDS] * 3, abs=0.1)
        page.evaluate("document.querySelector('audio').currentTime = 1.0")
        play(page, 0)
        page.wait_for_function("() => document.querySelector('audio').currentTime > 1.2")
        play(page, 1)
        paused, reached, _ = state(page, 0)
        assert paused and not state(page, 1)[0]
        assert state(page, 1)[1] >= reached - 0.1
        assert page.locator("#sound-one .cursor").is_visible()
        play(page, 2)  # of another condition: from its own beginning
        assert state(page, 1)[0] and state(page, 2)[1] < 1.0


def test_the_cursor_follows_and_a_click_moves_it(chromium, address):  # noqa: F811
    with opened(chromium, address) as page:
        page.wait_for_function("() => document.querySelector('audio').readyState >= 1")
        box = page.locator("#sound-one .strip").bounding_box()
        page.locator("#sound-one .strip").click(position={"x": 0.5 * box["width"], "y": 20})
        page.wait_for_function("() => Math.abs(document.querySelector('audio').currentTime - 1.5) < 0.1")
        cursor = page.locator("#sound-one .cursor").bounding_box()
        assert cursor["x"] - box["x"] == pytest.approx(0.5 * box["width"], abs=0.05 * box["width"])


def test_the_browsers_decoder_hears_what_was_put_in(chromium, address):  # noqa: F811
    """Chromium decodes with FFmpeg, which has no code of the encoder's."""
    full_scale_pa = 20e-6 * 10.0 ** (PLAYED.full_scale_db / 20.0)
    with opened(chromium, address) as page:
        for index, put_in in enumerate((WHOLE, LINE)):
            rate, channels, text = page.evaluate(DECODE, index)
            out = np.frombuffer(base64.b64decode(text), dtype=np.float32).astype(float) * full_scale_pa
            assert (rate, channels) == (RATE, 1)
            middle = out[3000 : T.size - 3000]
            power = np.abs(np.fft.rfft(middle * np.hanning(middle.size), 8 * middle.size))
            assert np.argmax(power) * RATE / (8 * middle.size) == pytest.approx(437.3, abs=0.05)
            low = np.fft.rfftfreq(middle.size, 1.0 / RATE) < 14000.0
            levels = [
                10.0 * np.log10(np.sum(np.abs(np.fft.rfft(one))[low] ** 2)) for one in (middle, put_in[3000:-3000])
            ]
            assert levels[0] == pytest.approx(levels[1], abs=0.1)
            assert np.max(np.abs(out)) < full_scale_pa


def test_players_have_names_and_paper_has_none(chromium, address):  # noqa: F811
    with opened(chromium, address, viewport={"width": 360, "height": 740}) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        names = page.eval_on_selector_all("audio", "all => all.map((one) => one.getAttribute('aria-label'))")
        assert names == [
            "Condition 50: As recorded (measured)",
            "Condition 50: mesh x1 alone (measured)",
            "Condition 80: As recorded (synthetic)",
        ]
        assert page.locator("#sound-one .strip img").get_attribute("alt").endswith("marked: mesh x1, 437 Hz")
        page.emulate_media(media="print")
        assert not page.locator("#sound-one audio").first.is_visible()
        assert page.locator("#sound-one .on-paper").is_visible()
