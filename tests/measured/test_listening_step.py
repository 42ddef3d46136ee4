"""Excerpts: the log's own stretch at another rate, the order in it by itself, and nothing else read."""

import tracemalloc

import h5py
import numpy as np
import pytest
import soxr

from tdacoustic.errors import AnalysisError
from tdacoustic.measured.listening_step import (
    LISTENING,
    PLAYED_HZ,
    ListeningSettings,
    OrderToTrack,
    cut_excerpt,
    margin_s,
)
from tdacoustic.measured.results import RunSpeed
from tdacoustic.recording import Channel
from tdacoustic.speed import SpeedProfile
from tdacoustic.steps import log_file
from tdacoustic.steps.codec import decode, encode

NO_SPEED = RunSpeed((), ())


def log_of(path, columns, rate):
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name, values in columns.items():
            dataset = file.create_dataset(name, data=np.asarray(values, dtype=np.float32), track_times=False)
            dataset.attrs["sample_rate_hz"] = rate
            dataset.attrs["unit"] = "Pa"
    return (log_file(path),)


def channel_of(column, rate, first, count, name="m", **keys):
    return Channel(name, "sound_pressure", "Pa", 0, column, rate, first, count, start_s=first / rate, **keys)


def cut(logs, rate, n, begin_s, length_s, order=None, column=0, speed=NO_SPEED, margin=None):
    """An excerpt as the workflow cuts it: on whole samples, with a margin."""
    margin = round((margin_s(None if order is None else order.bandwidth_hz) if margin is None else margin) * rate)
    start, count = round(begin_s * rate), round(length_s * rate)
    low, high = max(0, start - margin), min(n, start + count + margin)
    channel = channel_of(column, rate, low, high - low)
    return cut_excerpt(ListeningSettings(channel, start / rate, (start + count) / rate, order), logs, speed)


def coloured(rate, seconds, seed):
    """Noise that falls by 6 dB an octave from 500 Hz on and is zero above 0.4 of the rate."""
    n = round(rate * seconds)
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1.0 / rate)
    spectrum /= np.sqrt(1.0 + (frequency / 500.0) ** 2)
    spectrum[(frequency > 0.4 * min(rate, PLAYED_HZ)) | (frequency < 20.0)] = 0.0
    return np.fft.irfft(spectrum, n)


@pytest.mark.parametrize(
    ("rate", "begin_s"),
    [(8192.0, 1.25), (25600.0, 1.25), (44100.0, 1.25), (51200.0, 1.25), (20000.0 / 3.0, 1.2), (48000.0, 0.0)],
)
def test_an_excerpt_is_the_logs_own_stretch(tmp_path, rate, begin_s):
    """The right channel from the right instant on, as another program resamples it."""
    left, right = coloured(rate, 4.0, 1), coloured(rate, 4.0, 2)
    logs = log_of(tmp_path / "log.h5", {"left": left, "right": right}, rate)
    excerpt = cut(logs, rate, right.size, begin_s, 1.5, column=1)
    assert excerpt.first_s == pytest.approx(begin_s, abs=1e-9)
    whole = soxr.resample(right - right.mean(), rate, PLAYED_HZ, quality="VHQ")
    first = round(begin_s * PLAYED_HZ)
    expected = whole[first : first + excerpt.samples.size][200:-200]
    got = excerpt.samples[200:-200]
    assert 20.0 * np.log10(np.std(got) / np.std(expected)) == pytest.approx(0.0, abs=0.05)
    assert np.std(got - expected) < 0.01 * np.std(expected)
    assert excerpt.samples.size == pytest.approx(1.5 * PLAYED_HZ, abs=5)


def test_a_line_by_itself_has_its_frequency_and_level(tmp_path):
    rate, seconds = 8192.0, 8.0
    t = np.arange(round(rate * seconds)) / rate
    sound = 0.1 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 437.3 * t + 0.4) + 0.2 * coloured(rate, seconds, 3)
    sound += 0.1 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 462.0 * t)
    logs = log_of(tmp_path / "log.h5", {"m": sound}, rate)
    excerpt = cut(logs, rate, t.size, 2.0, 4.0, OrderToTrack(None, 437.3, 2.0))
    order = excerpt.order
    assert order.samples.size == excerpt.samples.size
    power = np.abs(np.fft.rfft(order.samples * np.hanning(order.samples.size))) ** 2
    frequency = np.fft.rfftfreq(order.samples.size, 1.0 / PLAYED_HZ)
    assert frequency[np.argmax(power)] == pytest.approx(437.3, abs=0.25)
    assert 20.0 * np.log10(order.rms / 0.1) == pytest.approx(0.0, abs=0.25)
    times = excerpt.first_s + np.arange(order.samples.size) / PLAYED_HZ
    put_in = 0.1 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 437.3 * times + 0.4)
    assert np.std(order.samples - put_in) < 0.2 * np.std(put_in)  # in phase: it can be taken out of the whole


def test_an_order_is_followed_through_a_sweep(tmp_path):
    rate, seconds = 8192.0, 10.0
    t = np.arange(round(rate * seconds)) / rate
    turns = 10.0 * t + 0.5 * 1.0 * t**2
    sound = 0.1 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 31.0 * turns) + 0.02 * coloured(rate, seconds, 4)
    logs = log_of(tmp_path / "log.h5", {"m": sound}, rate)
    grid = np.linspace(0.0, seconds, 201)
    speed = RunSpeed((SpeedProfile("n", "motor", "1/s", grid, 10.0 + grid),), ())
    excerpt = cut(logs, rate, t.size, 3.0, 5.0, OrderToTrack("n", 31.0, 6.0), speed=speed)
    order = excerpt.order
    assert order.frequency_hz[[0, -1]] == pytest.approx([31.0 * 13.0, 31.0 * 18.0], rel=2e-3)
    crossings = np.flatnonzero(np.diff(np.signbit(order.samples)))
    times = excerpt.first_s + crossings / PLAYED_HZ
    heard = 0.5 / np.diff(times)  # of a sine: two crossings a period
    truth = 31.0 * (10.0 + 0.5 * (times[1:] + times[:-1]))
    assert np.median(np.abs(heard / truth - 1.0)) < 0.03
    assert np.mean(heard) == pytest.approx(np.mean(truth), rel=5e-3)
    assert 20.0 * np.log10(order.rms / 0.1) == pytest.approx(0.0, abs=0.2)


def test_only_what_is_needed_is_read(tmp_path):
    rate, n = 51200.0, 40_000_000  # 13 minutes, 160 MB; what is not written is a hole in the file
    path = tmp_path / "long.h5"
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        dataset = file.create_dataset("m", (n,), "f4", chunks=(65536,), fillvalue=np.nan, track_times=False)
        dataset.attrs["sample_rate_hz"] = rate
        dataset.attrs["unit"] = "Pa"
        start = round(400.0 * rate)
        dataset[start - 65536 : start + round(7.0 * rate)] = np.sin(np.arange(65536 + round(7.0 * rate)))
    logs = (log_file(path),)
    tracemalloc.start()
    excerpt = cut(logs, rate, n, 400.0, 6.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert excerpt.n_missing == 0 and excerpt.rms == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert peak < 40e6


def test_missing_samples_are_counted_and_silent(tmp_path):
    rate = 8192.0
    sound = coloured(rate, 4.0, 5)
    sound[10000:10100] = np.nan
    logs = log_of(tmp_path / "log.h5", {"m": sound}, rate)
    excerpt = cut(logs, rate, sound.size, 1.0, 2.0)
    assert excerpt.n_missing == 100 and np.isfinite(excerpt.samples).all()
    assert cut(logs, rate, sound.size, 2.0, 1.5).n_missing == 0
    logs = log_of(tmp_path / "none.h5", {"m": np.full(8192, np.nan)}, rate)
    with pytest.raises(AnalysisError, match=r"'m' has no samples from 0.20 s"):
        cut(logs, rate, 8192, 0.2, 0.5)


def test_an_order_whose_speed_is_not_known_is_not_there_and_says_so(tmp_path):
    rate = 8192.0
    logs = log_of(tmp_path / "log.h5", {"m": coloured(rate, 3.0, 6)}, rate)
    excerpt = cut(logs, rate, 24576, 0.5, 2.0, OrderToTrack("n", 31.0, 4.0))
    assert excerpt.order is None and excerpt.no_order == "channel 'n' gives no speed"
    late = SpeedProfile("n", "motor", "1/s", np.linspace(2.2, 3.0, 20), np.full(20, 10.0))
    excerpt = cut(logs, rate, 24576, 0.5, 2.0, OrderToTrack("n", 31.0, 4.0), speed=RunSpeed((late,), ()))
    assert excerpt.order is None and "not known over most" in excerpt.no_order


def test_the_store_gives_the_same_back(tmp_path):
    rate = 8192.0
    logs = log_of(tmp_path / "log.h5", {"m": coloured(rate, 3.0, 7)}, rate)
    excerpt = cut(logs, rate, 24576, 0.5, 2.0, OrderToTrack(None, 300.0, 4.0))
    arrays = []
    back = decode(encode(excerpt, arrays), arrays)
    assert np.array_equal(back.samples, excerpt.samples) and back.order.bandwidth_hz == 4.0
    assert (LISTENING.name, LISTENING.version) == ("listening", 1)
