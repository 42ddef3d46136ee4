"""Times that count from a date: the log's start out of them, its channels' own times after it, whatever the format."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest
from makers_matlab import level5, level73, matlab_dataset, numbers

from tdacoustic.formats import scan
from tdacoustic.formats.starts import from_the_start
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.workflows.info import describe_log

RATE_HZ = 8192.0
T = np.arange(500) / RATE_HZ
BEGIN, INSTANT = 1700000000.25, "2023-11-14T22:13:20.250000+00:00"
FORMATS = ("text", "matlab", "matlab 7.3", "hdf5")


def write(folder, kind, times):
    """A log of one channel over some times, as each format has it."""
    if kind == "text":
        (folder / "a.csv").write_text("Time [s],x [Pa]\n" + "".join(f"{t:.7f},1.5\n" for t in times))
        return folder / "a.csv"
    if kind == "hdf5":
        with h5py.File(folder / "a.h5", "w") as file:
            file["time"], file["x"] = times, np.full(times.size, 1.5)
        return folder / "a.h5"
    columns = {"t": times[:, None], "x": np.full((times.size, 1), 1.5)}
    if kind == "matlab":
        (folder / "a.mat").write_bytes(level5(*(numbers(name, values) for name, values in columns.items())))
        return folder / "a.mat"
    return level73(folder / "a.mat", lambda file: [matlab_dataset(file, *column) for column in columns.items()])


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize(
    ("begin", "start_time", "start_s"),
    [
        (BEGIN, INSTANT, 0.0),
        (1000000000.0, "2001-09-09T01:46:40.000000+00:00", 0.0),
        (0.0, None, 0.0),
        (5.25, None, 5.25),
        (-2.0, None, -2.0),
        (864000.5, None, 864000.5),
        (50000000.0, None, 0.0),
        (999999999.0, None, 0.0),
        (3782844800.25, None, 0.0),
    ],
)
def test_where_times_begin(tmp_path, kind, begin, start_time, start_s):
    path = write(tmp_path, kind, begin + T)
    log = scan(path)
    (channel,) = log.channels
    assert (log.start_time, channel.raster.start_s, channel.raster.sample_rate_hz) == (start_time, start_s, RATE_HZ)
    assert len(log.flags) == (abs(begin) > 3.2e7) and channel.flags == ()
    (described,) = describe_log(path).channels
    assert described.start == start_time


def test_tomorrow_is_no_start_of_a_recording(tmp_path):
    begin = (datetime.now(UTC) + timedelta(days=3)).timestamp()
    log = scan(write(tmp_path, "hdf5", begin + T))
    assert log.start_time is None and log.channels[0].raster.start_s == 0.0
    assert "since what date is not known" in log.flags[0]


def test_times_of_several_groups_keep_their_distance(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for group, late in (("b", 0.5), ("a", 0.0), ("c", 3.0)):
            file[f"{group}/t"], file[f"{group}/x"] = BEGIN + late + T, np.zeros(T.size)
    log = scan(tmp_path / "a.h5")
    assert log.start_time == INSTANT
    assert {channel.name: channel.raster.start_s for channel in log.channels} == {"a/x": 0.0, "b/x": 0.5, "c/x": 3.0}


def log_of(*starts, start_time=None):
    channels = tuple(LogChannel(f"x{n}", Raster(RATE_HZ, 500, start)) for n, start in enumerate(starts))
    return from_the_start(Log(Path("a.h5"), "hdf5", channels, None, start_time))


def starts_of(log):
    return [channel.raster.start_s for channel in log.channels]


def test_a_start_that_the_log_states_with_a_zone_stays_where_others_count_from_it():
    log = log_of(0.0, BEGIN, start_time="2023-11-14T23:13:20+01:00")
    assert (log.start_time, starts_of(log)) == ("2023-11-14T23:13:20+01:00", [0.0, 0.25])
    assert all(channel.flags == () for channel in log.channels)


def test_a_start_that_agrees_is_made_finer_without_a_doubt():
    log = log_of(BEGIN, start_time="2023-11-14T22:13:20Z")
    assert (log.start_time, starts_of(log)) == (INSTANT, [0.0])
    assert "not 2023" not in log.flags[0]


@pytest.mark.parametrize("stated", [None, "2023-11-12T22:13:20Z", "2023-11-14T22:13:20", "yesterday"])
def test_others_are_taken_to_start_with_the_first_and_say_so(stated):
    log = log_of(1.5, BEGIN + 2.0, BEGIN, start_time=stated)
    assert (log.start_time, starts_of(log)) == (INSTANT, [1.5, 2.0, 0.0])
    assert [len(channel.flags) for channel in log.channels] == [1, 0, 0]
    assert (f"not {stated}" in log.flags[0]) == (stated is not None)


def test_dates_of_unknown_origin_keep_their_distance_and_the_stated_start():
    log = log_of(6e7, 6e7 + 2.0, start_time="2024-01-01T00:00:00")
    assert (log.start_time, starts_of(log)) == ("2024-01-01T00:00:00", [0.0, 2.0])


def test_a_log_whose_times_count_from_its_start_is_left_alone():
    channel = LogChannel("x", Raster(RATE_HZ, 500, 12.0))
    log = Log(Path("a.h5"), "hdf5", (channel,), None, "2024-01-01T00:00:00")
    assert from_the_start(log) is log
