from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.campaign import CampaignChannel, CampaignRun, WrittenPath
from tdacoustic.errors import CampaignError, FormatError, UnitError
from tdacoustic.ingest import Bound, Refusal, bind_log, bind_run, check_coverage
from tdacoustic.ingest.cut import cut_raster
from tdacoustic.recording import Log, LogChannel, Raster, Recording

PA = {"unit": "Pa"}


@dataclass
class ArrayReader:
    """A log in memory."""

    data: np.ndarray = field(repr=False)

    def blocks(self, columns, start, stop, block_size):
        for first in range(start, stop, block_size):
            yield self.data[list(columns), first : min(first + block_size, stop)]


@pytest.fixture
def make_log():
    def made(*channels, path="a.wav", n_samples=1000, rate=100.0, start_s=0.0, data=None, **keys):
        raster = Raster(rate, n_samples, start_s)
        channels = tuple(
            channel if isinstance(channel, LogChannel) else LogChannel(raster=raster, **channel) for channel in channels
        )
        data = np.arange(n_samples, dtype=float) * np.ones((len(channels), 1)) if data is None else data
        return Log(Path(path), "audio", channels, ArrayReader(data), **keys)

    return made


@pytest.fixture
def make_run():
    def made(*names, **keys):
        logs = tuple(WrittenPath(name, Path(name)) for name in names or ("a.wav",))
        return CampaignRun(**{"name": "1", "condition": "1", "logs": logs, **keys})

    return made


@pytest.fixture
def make_channel():
    return lambda name="mic_1", **keys: CampaignChannel(name=name, **keys)


def reason(bound):
    (refusal,) = bound.refused
    assert (refusal.run, refusal.reason.split(" (")[0]) == ("1", f"channel {refusal.channel!r}")
    return refusal.reason


def test_a_recording_is_named_scaled_and_described(make_log, make_run, make_channel):
    log = make_log({"name": "V1", "unit": "V", "limits": (-5.0, 5.0), "flags": ("odd",)}, {"name": "n", "unit": "rpm"})
    mic = make_channel(
        "mic",
        source="V1",
        sensitivity="50 mV/Pa",
        role="receiver",
        distance_m=4.0,
        position_m=(0.0, 4.0, 0.0),
        direction="y",
    )
    speed = make_channel("speed", source=2, component="motor", shaft="motor", drive="2")
    bound = bind_run([mic, speed], make_run(), [log])
    assert (bound.refused, bound.warnings) == ((), ())
    found = bound.recording["mic"]
    assert (found.quantity, found.si_symbol, found.component, found.role) == ("sound_pressure", "Pa", "air", "receiver")
    assert (found.distance_m, found.position_m, found.direction) == (4.0, (0.0, 4.0, 0.0), "y")
    assert found.limits == pytest.approx((-100.0, 100.0))
    assert found.flags == ("odd",)
    assert np.allclose(bound.recording.samples("mic"), np.arange(1000) * 20.0, rtol=1e-12)
    second = bound.recording["speed"]
    assert (second.si_symbol, second.shaft, second.component, second.drive) == ("1/s", "motor", "motor", "2")
    assert bound.recording.name == "1"


def test_a_refused_channel_does_not_stop_the_others(make_log, make_run, make_channel):
    log = make_log({"name": "a", "unit": "V"}, {"name": "b", "unit": "Pa"}, path="x.wav")
    bound = bind_run(
        [make_channel("mic_1", source="a", quantity="sound_pressure"), make_channel("b")], make_run(), [log]
    )
    assert reason(bound) == (
        "channel 'mic_1' (run 1, x.wav): sound_pressure in V needs a sensitivity, "
        'add sensitivity = "... V/Pa" to its [[channel]]'
    )
    assert [channel.name for channel in bound.recording.channels] == ["b"]


def test_warnings_name_the_channel_and_stay_with_it(make_log, make_run, make_channel):
    bound = bind_run([make_channel("a", unit="Pa")], make_run(), [make_log({"name": "a", "full_scale": 1.0})])
    (warning,) = bound.warnings
    assert warning.startswith("channel 'a' (run 1, a.wav): numbers are fractions of full scale; 1.0 is taken as 1 Pa")
    assert bound.recording["a"].flags == (warning.partition("): ")[2],)


# ---- sources


def test_a_name_is_found_with_or_without_the_root(make_log, make_run, make_channel):
    log = make_log({"name": "data/mic", **PA})
    assert bind_run([make_channel(source="/data/mic")], make_run(), [log]).warnings == ()
    log = make_log({"name": "/data/mic", **PA})
    assert bind_run([make_channel(source="data/mic")], make_run(), [log]).warnings == ()


def test_case_and_spaces_are_forgiven_with_a_warning(make_log, make_run, make_channel):
    log = make_log({"name": "Mic 1", **PA}, {"name": "mic 2", **PA})
    bound = bind_run([make_channel(source="mic1")], make_run(), [log])
    assert bound.recording["mic_1"].column == 0
    assert "source 'mic1' is not in the log, 'Mic 1' is taken" in bound.warnings[0]


def test_an_exact_name_wins_over_a_near_one(make_log, make_run, make_channel):
    log = make_log({"name": "MIC", **PA}, {"name": "mic", **PA})
    bound = bind_run([make_channel(source="mic")], make_run(), [log])
    assert (bound.recording["mic_1"].column, bound.warnings) == (1, ())


@pytest.mark.parametrize(
    ("source", "match"),
    [
        ("Mic1", r"2 channels of a\.wav could be source 'Mic1'; say which by number, source = 1, 2"),
        ("Motr", r"\(run 1, a\.wav\): source 'Motr' is not in a\.wav; the nearest are 'Motor'"),
        ("zzz", r"source 'zzz' is not in a\.wav; there are 'MIC 1', 'mic1', 'Motor'"),
        (4, r"source = 4, but a\.wav has 3 channels"),
    ],
)
def test_sources_that_are_not_there(make_log, make_run, make_channel, source, match):
    log = make_log({"name": "MIC 1", **PA}, {"name": "mic1", **PA}, {"name": "Motor", **PA})
    with pytest.raises(AssertionError, match=match):
        raise AssertionError(reason(bind_run([make_channel(source=source)], make_run(), [log])))


def test_a_source_in_two_logs_names_both(make_log, make_run, make_channel):
    logs = [make_log({"name": "m", **PA}, path="a.h5"), make_log({"name": "m", **PA}, path="b.h5")]
    run = make_run("a.h5", "b.h5")
    with pytest.raises(
        CampaignError, match=r"run '1': channel 'mic_1': source 'm' is in a\.h5 and in b\.h5; add log = 1 or"
    ):
        bind_run([make_channel(source="m")], run, logs)
    with pytest.raises(CampaignError, match=r"source = 1 could be in any of a\.h5, b\.h5; add log = 1 \.\.\. 2"):
        bind_run([make_channel(source=1)], run, logs)
    assert bind_run([make_channel(source="m", log=2)], run, logs).recording["mic_1"].log_index == 1
    assert bind_run([make_channel(source=1, log=2)], run, logs).recording["mic_1"].log_index == 1
    assert "log = 3, but the run has 2 logs" in reason(bind_run([make_channel(source="m", log=3)], run, logs))


def test_a_source_in_the_second_log_is_found(make_log, make_run, make_channel):
    logs = [make_log({"name": "m", **PA}, path="a.h5"), make_log({"name": "n", **PA}, path="b.h5")]
    assert bind_run([make_channel(source="n")], make_run("a.h5", "b.h5"), logs).recording["mic_1"].log_index == 1


def test_logs_that_began_at_other_times_are_warned_of(make_log, make_run, make_channel):
    logs = [
        make_log({"name": "m", **PA}, path="a.h5", start_time="2026-05-01T10:00:00Z"),
        make_log({"name": "n", **PA}, path="b.h5", start_time="2026-05-01T10:00:02Z"),
    ]
    (warning,) = bind_run([make_channel(source="n")], make_run("a.h5", "b.h5"), logs).warnings
    assert "start at different times (a.h5 at 2026-05-01T10:00:00Z, b.h5 at 2026" in warning


def test_as_many_logs_as_the_run_names(make_run, make_channel):
    with pytest.raises(CampaignError, match=r"run '1' has 1 logs, got 0"):
        bind_run([make_channel()], make_run(), [])


# ---- rates and cuts


def test_the_rate_is_the_logs_else_the_runs(make_log, make_run, make_channel):
    silent = make_log({"name": "mic_1", **PA}, rate=None)
    text = reason(bind_run([make_channel()], make_run(), [silent]))
    assert "the log states no sampling rate, add sample_rate_hz = ... to its [[run]]" in text
    bound = bind_run([make_channel()], make_run(sample_rate_hz=50.0), [silent])
    assert bound.recording["mic_1"].sample_rate_hz == 50.0


def test_a_rate_that_contradicts_the_logs_is_an_error(make_log, make_run, make_channel):
    log = make_log({"name": "mic_1", **PA}, rate=51200.0)
    with pytest.raises(CampaignError, match=r"run '1': sample_rate_hz = 51206, but a\.wav says 51200"):
        bind_run([make_channel()], make_run(sample_rate_hz=51206.0), [log])
    assert (
        bind_run([make_channel()], make_run(sample_rate_hz=51205.0), [log]).recording["mic_1"].sample_rate_hz == 51200.0
    )


def test_a_stated_rate_is_the_silent_logs(make_log, make_run, make_channel):
    logs = [make_log({"name": "a", **PA}, path="a.h5"), make_log({"name": "b", **PA}, path="b.csv", rate=None)]
    bound = bind_run([make_channel("a"), make_channel("b")], make_run("a.h5", "b.csv", sample_rate_hz=10.0), logs)
    assert [channel.sample_rate_hz for channel in bound.recording.channels] == [100.0, 10.0]


def test_a_cut_takes_its_samples_and_keeps_the_time_axis(make_log, make_run, make_channel):
    log = make_log({"name": "mic_1", **PA}, start_s=0.5)
    recording = bind_run([make_channel()], make_run(start_s=1.0, end_s=3.0), [log]).recording
    assert recording.samples("mic_1")[[0, -1]].tolist() == [50.0, 249.0]
    assert recording.times_s("mic_1")[[0, -1]] == pytest.approx([1.0, 2.99])


def test_cuts_beyond_the_log(make_log, make_run, make_channel):
    log = make_log({"name": "mic_1", **PA}, start_s=0.5)
    bound = bind_run([make_channel()], make_run(start_s=0.0, end_s=20.0), [log])
    assert bound.recording["mic_1"].n_samples == 1000
    assert "start_s = 0, but the samples begin at 0.5 s" in bound.warnings[0]
    assert "end_s = 20, but the samples end at 10.5 s" in bound.warnings[1]
    text = reason(bind_run([make_channel()], make_run(start_s=11.0, end_s=20.0), [log]))
    assert "no sample between 11 s and 20 s; the log holds 10 s of it" in text
    empty = make_log({"name": "mic_1", **PA}, n_samples=0)
    assert "no sample between 0 s and the end" in reason(bind_run([make_channel()], make_run(), [empty]))


@given(
    rate=st.sampled_from([8192.0, 44100.0, 51200.0, 3.7]),
    first=st.integers(0, 5000),
    n=st.integers(1, 5000),
    offset=st.sampled_from([0.0, 0.25, -1.5]),
)
def test_a_cut_at_samples_instants_takes_exactly_these(rate, first, n, offset):
    cut = cut_raster(Raster(rate, 10000, offset), rate, offset + first / rate, offset + (first + n) / rate)
    assert (cut.start_sample, cut.n_samples, cut.warnings) == (first, n, ())
    assert cut.start_s == pytest.approx(offset + first / rate)


@given(st.floats(-5, 25), st.floats(0, 25))
def test_a_cut_never_leaves_the_log(start_s, length_s):
    cut = cut_raster(Raster(100.0, 1000), 100.0, start_s, start_s + length_s)
    assert 0 <= cut.start_sample <= cut.start_sample + cut.n_samples <= 1000


def test_a_tacho_that_only_the_log_knows_needs_its_pulses(make_log, make_run, make_channel):
    log = make_log({"name": "t", "quantity": "tacho"})
    assert "add pulses_per_rev = ... to its [[channel]]" in reason(bind_run([make_channel("t")], make_run(), [log]))
    assert bind_run([make_channel("t", pulses_per_rev=60.0)], make_run(), [log]).recording["t"].pulses_per_rev == 60.0


# ---- coverage


def bound_with(run, *refused):
    refusals = tuple(Refusal(run, name, f"channel {name!r} (run {run}, a.wav): why") for name in refused)
    return Bound(Recording(run, (), ()), refusals)


def test_coverage(make_channel):
    channels = [make_channel("a"), make_channel("b"), make_channel("c")]
    assert check_coverage([], channels) == ()
    warnings = check_coverage([bound_with("1", "a"), bound_with("2")], channels)
    assert warnings == ("channel 'a' cannot be used in 1 of 2 runs (1): channel 'a' (run 1, a.wav): why",)
    with pytest.raises(CampaignError) as caught:
        check_coverage([bound_with("1", "a", "b"), bound_with("2", "a", "b", "c")], channels)
    assert str(caught.value).splitlines() == [f"channel {name!r} (run 1, a.wav): why" for name in "ab"]


# ---- one log alone


def test_a_log_alone_is_in_si_as_far_as_it_says(make_log):
    recording = bind_log(
        make_log({"name": "m", "unit": "g"}, {"name": "w", "full_scale": 1.0}, {"name": "m"}, path="d/log.wav")
    )
    assert recording.name == "log.wav"
    known, raw, twin = recording.channels
    assert (known.name, known.si_symbol, known.flags) == ("m", "m/s^2", ())
    assert (raw.quantity, raw.si_symbol, raw.gain) == ("other", "1", 1.0)
    assert "that the log does not state, add full_scale" in raw.flags[0]
    assert (twin.name, twin.column) == ("m#2", 2)
    assert np.array_equal(recording.samples("w"), np.arange(1000.0))


def test_a_log_alone_with_units_stated(make_log):
    log = make_log({"name": "w", "full_scale": 1.0})
    stated = bind_log(log, {"w": {"full_scale": "10 V", "sensitivity": "50 mV/Pa"}})["w"]
    assert (stated.quantity, stated.gain) == ("sound_pressure", pytest.approx(200.0))


@pytest.mark.parametrize(
    ("units", "match"),
    [
        ({"x": {}}, r"units names channel 'x', which a\.wav does not have; it has w"),
        (
            {"w": {"fullscale": "1 Pa"}},
            r"units\['w'\] has key 'fullscale'; known are quantity, unit, sensitivity, full_scale",
        ),
        ({"w": {"quantity": "force"}}, r"channel 'w' \(a\.wav\): .* add full_scale = .* to units\['w'\]"),
        ({"w": {"unit": "xx"}}, r"channel 'w' \(a\.wav\): unit 'xx' is not known"),
    ],
)
def test_units_that_do_not_help(make_log, units, match):
    with pytest.raises(UnitError, match=match):
        bind_log(make_log({"name": "w", "full_scale": 1.0}), units)


def test_a_log_alone_needs_a_rate(make_log):
    log = make_log(LogChannel("w", Raster(None, 10), unit="Pa"))
    with pytest.raises(
        FormatError, match=r"channel 'w' \(a\.wav\): the log states no sampling rate; give sample_rate_hz"
    ):
        bind_log(log)
    assert bind_log(log, sample_rate_hz=8.0)["w"].sample_rate_hz == 8.0
