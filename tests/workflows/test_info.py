"""`info` of logs that are too large to be read whole."""

import struct
import sys
import time

import h5py
import numpy as np
import pytest

from tdacoustic.workflows import info
from tdacoustic.workflows.info import describe_log, info_text

RATE_HZ = 1000.0
N = 100_000
SECONDS = 10.0
"""Allowed on a file of 100 GB. It takes 0.1 s and a program's start; a machine that does much else may take longer, but
reading 100 GB takes a minute on any."""


@pytest.fixture
def small_limits(monkeypatch):
    monkeypatch.setattr(info, "WHOLE_VALUES", 30_000)


def write_log(path, columns, rates=None):
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name, values in columns.items():
            dataset = file.create_dataset(name, data=values)
            dataset.attrs["sample_rate_hz"] = (rates or {}).get(name, RATE_HZ)
            dataset.attrs["unit"] = "Pa"
    return path


def ramp(n):
    return np.arange(n, dtype=np.float64)


def test_a_small_log_is_read_whole(tmp_path):
    (channel,) = describe_log(write_log(tmp_path / "a.h5", {"x": ramp(N)})).channels
    assert (channel.n_read, channel.n_samples, channel.flags) == (N, N, ())
    assert (channel.min, channel.max, channel.mean) == (0.0, N - 1, pytest.approx(0.5 * (N - 1), rel=1e-12))


def test_a_large_log_is_read_in_stretches_from_end_to_end(tmp_path, small_limits):
    (channel,) = describe_log(write_log(tmp_path / "a.h5", {"x": ramp(N)})).channels
    assert channel.n_samples == N
    assert channel.n_read == 30_000 // info.STRETCHES * info.STRETCHES
    assert (channel.min, channel.max) == (0.0, N - 1)  # its first sample and its last are among them
    # of a straight line, stretches spread evenly have the mean of the whole, up to the rounding of their places
    assert channel.mean == pytest.approx(0.5 * (N - 1), rel=1e-5)
    assert channel.rms == pytest.approx(np.sqrt(np.mean(ramp(N) ** 2)), rel=0.02)
    (flag,) = channel.flags
    assert f"{channel.n_read} of {N} samples" in flag and "--all" in flag


def test_every_sample_where_it_is_asked_for(tmp_path, small_limits):
    path = write_log(tmp_path / "a.h5", {"x": ramp(N)})
    (channel,) = describe_log(path, every_sample=True).channels
    assert (channel.n_read, channel.flags) == (N, ())
    assert channel.mean == pytest.approx(0.5 * (N - 1), rel=1e-12)


def test_a_short_raster_of_a_large_log_is_read_whole(tmp_path, small_limits):
    path = write_log(tmp_path / "a.h5", {"x": ramp(N), "slow": ramp(500)}, {"slow": 5.0})
    x, slow = sorted(describe_log(path).channels, key=lambda item: -item.n_samples)
    assert x.n_read < x.n_samples and len(x.flags) == 1
    assert slow.n_read == slow.n_samples == 500 and slow.flags == ()


def test_of_many_channels_no_more_is_read_than_of_few(tmp_path, small_limits):
    one = write_log(tmp_path / "one.h5", {"x": ramp(N)})
    ten = write_log(tmp_path / "ten.h5", {f"x{index}": ramp(N) for index in range(10)})
    (alone,), many = describe_log(one).channels, describe_log(ten).channels
    assert sum(channel.n_read for channel in many) <= alone.n_read


def test_no_numbers_are_counted_among_what_was_read(tmp_path, small_limits):
    values = np.full(N, np.nan)
    (channel,) = describe_log(write_log(tmp_path / "a.h5", {"x": values})).channels
    assert (channel.mean, channel.rms, channel.min, channel.max) == (None,) * 4
    assert any(f"{channel.n_read} of {channel.n_read} samples are no numbers" in flag for flag in channel.flags)


def test_a_note_on_every_channel_is_one_line(tmp_path, small_limits):
    log = describe_log(write_log(tmp_path / "a.h5", {"x": ramp(N), "y": ramp(N)}))
    notes = [line for line in info_text(log).splitlines() if "note:" in line]
    assert len(notes) == 1 and "all channels" in notes[0]


def sparse_rf64(path, n_bytes):
    """A file of zeros that takes no room on disk; its very last sample is half of full scale."""
    n_bytes = n_bytes // 16 * 16
    fmt = struct.pack("<HHIIHH", 1, 8, 51200, 51200 * 16, 16, 16)
    sizes = struct.pack("<QQQI", n_bytes + 72, n_bytes, n_bytes // 16, 0)
    head = b"RF64\xff\xff\xff\xffWAVEds64" + struct.pack("<I", 28) + sizes + b"fmt " + struct.pack("<I", 16) + fmt
    with path.open("wb") as stream:
        stream.write(head + b"data\xff\xff\xff\xff")
        stream.seek(n_bytes - 2, 1)
        stream.write(struct.pack("<h", 1 << 14))


def sparse_hdf5(path, n_bytes):
    n = n_bytes // 32
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for index in range(8):
            kind = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            kind.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
            kind.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
            h5py.h5d.create(file.id, f"ch{index + 1}".encode(), h5py.h5t.IEEE_F32LE, h5py.h5s.create_simple((n,)), kind)
            dataset = file[f"ch{index + 1}"]
            dataset.attrs["sample_rate_hz"] = 51200.0
            dataset.attrs["unit"] = "V"
            dataset[n - 1] = 0.5


@pytest.mark.skipif(sys.platform == "win32", reason="files have no holes there unless asked for one by one")
@pytest.mark.parametrize(("name", "make"), [("a.wav", sparse_rf64), ("a.h5", sparse_hdf5)])
def test_100_gb_are_described_at_once(tmp_path, name, make):
    path = tmp_path / name
    try:
        make(path, 100_000_000_000)
    except OSError as error:
        pytest.skip(f"no file of 100 GB with holes here: {error}")
    if path.stat().st_blocks * 512 > 1e9:
        path.unlink()
        pytest.skip("this file system fills holes")
    start = time.monotonic()
    log = describe_log(path)
    seconds = time.monotonic() - start
    path.unlink()
    assert seconds < SECONDS
    assert len(log.channels) == 8
    last = log.channels[-1]
    assert last.n_samples == 100_000_000_000 // (16 if name == "a.wav" else 32)
    assert last.max == 0.5
