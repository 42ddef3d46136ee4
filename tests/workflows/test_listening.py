"""Which sound of a campaign is cut: run, microphone, seconds and order; and when there is none."""

import h5py
import numpy as np
import pytest
from level_campaigns import mic, pascal, run_of
from small_campaigns import HEAD, RATE_HZ, small_campaign, table, write_log

from tdacoustic import analyze
from tdacoustic.campaign import load_campaign
from tdacoustic.steps import Store
from tdacoustic.workflows import listening

SECONDS = 12.0
T = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
SPEED = table("channel", name="n", quantity="speed", shaft="motor", unit="rpm")


def noise(level_db, seed):
    return pascal(level_db) * np.random.default_rng(seed).standard_normal(T.size)


def line(level_db, frequency_hz):
    return np.sqrt(2.0) * pascal(level_db) * np.sin(2.0 * np.pi * frequency_hz * T)


def analysed(folder, logs, channels, text="", runs=None):
    folder.mkdir(parents=True, exist_ok=True)
    for name, held in logs.items():
        write_log(folder / f"{name}.h5", {channel: (values, unit) for channel, (values, unit) in held.items()})
    runs = runs or [run_of(name, name) for name in logs]
    path = folder / "campaign.toml"
    path.write_text(HEAD + channels + "".join(runs) + text, encoding="utf-8")
    return analyze(load_campaign(path), Store(folder / "store"), jobs=1)


def level_db(rms):
    return 20.0 * np.log10(rms / 20e-6)


def stretch(folder, run, channel, sound):
    """The log's own samples of an excerpt."""
    with h5py.File(folder / f"{run}.h5") as file:
        first = round(sound.excerpt.first_s * RATE_HZ)
        held = file[channel][first : first + round(sound.excerpt.duration_s * RATE_HZ)]
    return held - held.mean()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("listening")


@pytest.fixture(scope="module")
def two(folder):
    """Two conditions, two receivers; the strongest line is at the quieter one, the record is louder for 3 s."""
    loud = np.where(T < 3.0, 2.0, 1.0)
    logs = {
        "a": {"left": (noise(80.0, 1), "Pa"), "right": (loud * noise(60.0, 2) + line(70.0, 333.3), "Pa")},
        "b": {"left": (noise(80.0, 3), "Pa"), "right": (noise(60.0, 4) + line(74.0, 250.5), "Pa")},
    }
    return analysed(folder, logs, mic("left", distance_m=4.0) + mic("right", distance_m=4.0))


def test_the_microphone_is_that_of_the_strongest_line(two, folder):
    assert [(sound.condition, sound.run, sound.excerpt.channel) for sound in two.listening.sounds] == [
        ("a", "a", "right"),
        ("b", "b", "right"),
    ]
    assert two.listening.left_out == ()
    for sound, frequency, level in zip(two.listening.sounds, (333.3, 250.5), (70.0, 74.0), strict=True):
        truth = stretch(folder, sound.run, "right", sound)
        assert level_db(sound.excerpt.rms) == pytest.approx(level_db(np.std(truth)), abs=0.1)
        assert sound.marked.frequency_hz == pytest.approx(frequency, abs=0.1)
        assert level_db(sound.marked.rms) == pytest.approx(level, abs=0.2)
        assert level_db(sound.excerpt.order.rms) == pytest.approx(level, abs=0.3)
        assert not sound.sweeps and sound.excerpt.duration_s == pytest.approx(6.0, abs=0.001)


def test_the_stretch_is_as_loud_as_the_record(two, folder):
    sound = two.listening.sounds[0]
    whole = pascal(70.0) ** 2 + pascal(60.0) ** 2 * (4.0 * 3.0 + 9.0) / 12.0
    assert level_db(sound.excerpt.rms) == pytest.approx(10.0 * np.log10(whole / 20e-6**2), abs=0.3)
    assert 1.0 <= sound.excerpt.first_s <= 5.0


def test_the_step_is_among_the_records_and_found_again(two, folder):
    steps = [record for _, record in two.records if record.step == "listening"]
    assert [record.label for record in steps] == ["run a", "run b"]
    computed = []
    again = analyze(
        load_campaign(folder / "campaign.toml"), Store(folder / "store"), 1, lambda what, *_: computed.append(what)
    )
    assert not any(what.startswith("Excerpts") for what in computed)
    for one, other in zip(two.listening.sounds, again.listening.sounds, strict=True):
        assert np.array_equal(one.excerpt.samples, other.excerpt.samples)
        assert np.array_equal(one.excerpt.order.samples, other.excerpt.order.samples)


def test_a_run_up_sweeps_and_its_order_is_marked(tmp_path):
    seconds = 20.0
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    turns_hz = np.where(t < 8.0, 10.0, 10.0 + (t - 8.0))
    phase = 2.0 * np.pi * np.cumsum(turns_hz) / RATE_HZ
    sound = np.sqrt(2.0) * pascal(75.0) * np.sin(31.0 * phase)
    sound += pascal(60.0) * np.random.default_rng(7).standard_normal(t.size)
    runs = [run_of("up", "up", train_speed_km_h=None).replace("train_speed_km_h = null\n", "")]
    text = "\n[analysis]\norders = [31.0]\n"
    held = {"up": {"m": (sound, "Pa"), "n": (60.0 * turns_hz, "rpm")}}
    found = analysed(tmp_path, held, mic("m", distance_m=4.0) + SPEED, text, runs)
    (heard,) = found.listening.sounds
    assert heard.sweeps and heard.marked.order == 31.0 and heard.marked.name == "order 31"
    assert heard.excerpt.first_s >= 4.9 and heard.excerpt.duration_s == pytest.approx(10.0, abs=0.01)
    order = heard.excerpt.order
    known = np.isfinite(order.frequency_hz)
    truth = 31.0 * (10.0 + np.maximum(heard.excerpt.first_s + order.times_s[known] - 8.0, 0.0))
    assert order.frequency_hz[known] == pytest.approx(truth, rel=5e-3)
    assert level_db(order.rms) == pytest.approx(75.0, abs=0.5)


def test_a_channel_that_is_bad_is_not_played(tmp_path):
    logs = {"a": {"left": (np.zeros(T.size), "Pa"), "right": (noise(60.0, 1), "Pa")}}
    found = analysed(tmp_path, logs, mic("left", distance_m=4.0) + mic("right", distance_m=4.0))
    (sound,) = found.listening.sounds
    assert sound.excerpt.channel == "right" and sound.doubts == ()


def test_a_channel_that_clips_is_played_or_not_as_the_checks_say(tmp_path):
    sound = noise(60.0, 1) + line(75.0, 100.0)
    little = sound.copy()
    for start in range(5000, 45000, 5000):
        little[start : start + 6] = pascal(90.0)
    found = analysed(tmp_path / "little", {"a": {"left": (little, "Pa")}}, mic("left", distance_m=4.0))
    (held,) = found.listening.sounds
    assert any(doubt.startswith("clipping: ") for doubt in held.doubts)
    much = np.clip(10.0 * sound, -pascal(86.0), pascal(86.0))
    found = analysed(tmp_path / "much", {"a": {"left": (much, "Pa")}}, mic("left", distance_m=4.0))
    assert found.listening.left_out == (("a", "no microphone is in order"),)


def test_a_campaign_without_microphones_has_nothing_to_listen_to(tmp_path):
    channels = table("channel", name="motor", component="motor", quantity="acceleration")
    path = small_campaign(tmp_path, channels=channels, conditions=("a",))
    found = analyze(path, tmp_path / "store", jobs=1)
    assert found.listening.sounds == () and found.listening.left_out == (("a", "no microphone is in order"),)


def test_it_is_switched_off(tmp_path):
    path = small_campaign(tmp_path, conditions=("a",), text="\n[analysis]\nsound_excerpts = false\n")
    found = analyze(path, tmp_path / "store", jobs=1)
    assert found.listening is None
    assert not any(record.step == "listening" for _, record in found.records)


def test_of_many_conditions_some_are_left_out_and_named(tmp_path, monkeypatch):
    monkeypatch.setattr(listening, "MOST_CONDITIONS", 2)
    path = small_campaign(tmp_path, conditions=("a", "b", "c", "d"))
    found = analyze(path, tmp_path / "store", jobs=1)
    assert [sound.condition for sound in found.listening.sounds] == ["a", "d"]
    assert [condition for condition, _ in found.listening.left_out] == ["b", "c"]
    assert all("2 conditions" in why for _, why in found.listening.left_out)


def test_a_check_cuts_nothing(tmp_path):
    path = small_campaign(tmp_path, conditions=("a",))
    assert analyze(path, tmp_path / "store", jobs=1, deeper=False).listening is None
