"""The rows of a large text are placed without reading it: the same rows as counting them one by one gives."""

import numpy as np
import pytest

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan
from tdacoustic.formats.delimited import placing, reader

N = 20_000
RATE_HZ = 51200.0


@pytest.fixture
def looks(monkeypatch):
    """Every text counts as large, and is looked at in steps that fit one of half a megabyte."""
    for name, value in {"LARGE_BYTES": 1000, "HEAD_BYTES": 8192, "LOOK_BYTES": 2048, "LEAST_APART": 16384}.items():
        monkeypatch.setattr(placing, name, value)
    monkeypatch.setattr(reader, "END_ROWS", 64)


@pytest.fixture
def never_counted(monkeypatch):
    def count_rows(path, layout):
        pytest.fail("all rows were counted")

    monkeypatch.setattr(reader, "count_rows", count_rows)


VALUES = np.random.default_rng(3).normal(size=(N, 2)).round(6)


def rows_of(times="%.6f", mark=",", values=VALUES):
    numbers = np.column_stack([np.arange(len(values)) / RATE_HZ, values])
    return [mark.join((times % t, f"{a:.6f}", f"{b:.6f}")) for t, a, b in numbers]


def write(path, rows, heading="Time [s],a [Pa],b [Pa]", end="\n"):
    path.write_bytes((heading + end + end.join(rows) + end).encode())
    return path


def values_of(log, start=0, stop=None):
    stop = log.channels[0].raster.n_samples if stop is None else stop
    return np.concatenate(list(log.reader.blocks([0, 1], start, stop, 777)), axis=1).T


@pytest.mark.parametrize("times", ["%.6f", "%.9g", "%.6e", "%.12f"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_by_the_time_column(tmp_path, looks, never_counted, times, end):
    log = scan(write(tmp_path / "a.csv", rows_of(times), end=end))
    assert not log.reader.reader.rows.checked and len(log.reader.reader.rows.checkpoints) > 10
    assert (log.channels[0].raster.n_samples, log.channels[0].raster.sample_rate_hz) == (N, RATE_HZ)
    assert log.flags == ()
    assert np.array_equal(values_of(log), VALUES)
    for start, stop in ((0, 1), (1, 2), (4999, 5001), (7_321, 15_002), (N - 1, N)):
        assert np.array_equal(values_of(log, start, stop), VALUES[start:stop])


def test_every_row_that_is_placed_begins_where_it_is_said_to(tmp_path, looks, never_counted):
    path = write(tmp_path / "a.csv", rows_of())
    content = path.read_bytes()
    for row, offset in scan(path).reader.reader.rows.checkpoints:
        assert content[:offset].count(b"\n") == row + 1


def test_by_line_ends_without_a_time(tmp_path, looks, never_counted):
    rows = [row.partition(",")[2] for row in rows_of()]
    for blanks in ("", "\n\n", "\n  \n"):
        path = write(tmp_path / "a.csv", rows, "a,b")
        path.write_text(path.read_text() + blanks)
        log = scan(path)
        assert log.channels[0].raster.n_samples == N
        assert np.array_equal(values_of(log), VALUES)
        assert np.array_equal(values_of(log, 12_345, 12_400), VALUES[12_345:12_400])


def test_line_ends_over_many_pieces(tmp_path, looks, never_counted, monkeypatch):
    monkeypatch.setattr(placing, "CHUNK_BYTES", 61)
    rows = [row.partition(",")[2] for row in rows_of(values=VALUES[:2000])]
    path = write(tmp_path / "a.csv", rows, "a,b")
    path.write_bytes(path.read_bytes()[:-1] + b"\n" * 200)
    log = scan(path)
    assert log.channels[0].raster.n_samples == 2000
    for row, offset in log.reader.reader.rows.checkpoints:
        assert path.read_bytes()[:offset].count(b"\n") == row + 1
    assert np.array_equal(values_of(log, 1500, 2000), VALUES[1500:2000])


def test_decimal_commas_and_dates(tmp_path, looks, never_counted):
    german = [row.replace(".", ",") for row in rows_of(mark=";")]
    assert np.array_equal(values_of(scan(write(tmp_path / "a.csv", german, "Zeit [s];a;b"))), VALUES)
    moments = np.datetime64("2026-11-23T10:00:00.000000000") + (np.arange(N) * 1e9 / 5000.0).astype("timedelta64[ns]")
    dated = [f"{moment},{row.partition(',')[2]}" for moment, row in zip(moments, rows_of(), strict=True)]
    log = scan(write(tmp_path / "b.csv", dated, "Timestamp,a,b"))
    assert (log.channels[0].raster.n_samples, log.channels[0].raster.sample_rate_hz) == (N, 5000.0)
    assert np.array_equal(values_of(log), VALUES)


def test_times_too_coarse_to_tell_rows_are_not_used(tmp_path, looks, never_counted):
    log = scan(write(tmp_path / "a.csv", rows_of("%.5f")))
    assert log.channels[0].raster.n_samples == N
    assert np.array_equal(values_of(log), VALUES)


@pytest.mark.parametrize("with_time", [True, False])
@pytest.mark.parametrize(
    ("broken", "says"),
    [
        ("0.195312,1.0", "line 10002"),
        ("0.195312,1.0,2.0,3.0", "line 10002"),
        ("0.195312,1.0,abc", "line 10002"),
        ("", "line 10002|not equidistant|the file ends at row"),
    ],
)
def test_a_broken_row_is_refused(tmp_path, looks, never_counted, with_time, broken, says):
    rows = rows_of()
    rows[10_000] = broken
    heading = "Time [s],a,b"
    if not with_time:
        rows, heading = [row.partition(",")[2] for row in rows], "a,b"
    with pytest.raises(FormatError, match=says):
        values_of(scan(write(tmp_path / "a.csv", rows, heading)))


@pytest.mark.parametrize("missing", [1, 3, 10, 5000])
def test_missing_rows_are_refused_by_the_time(tmp_path, looks, missing):
    rows = rows_of()
    del rows[9_000 : 9_000 + missing]
    with pytest.raises(FormatError, match="line 9002: the time column is not equidistant"):
        values_of(scan(write(tmp_path / "a.csv", rows)))


def test_rows_said_twice_are_refused_by_the_time(tmp_path, looks):
    rows = rows_of()
    rows[9_000:9_000] = rows[8_990:9_000]
    with pytest.raises(FormatError, match="the time column is not equidistant"):
        values_of(scan(write(tmp_path / "a.csv", rows)))


def test_a_clock_that_jitters_is_not_relied_on(tmp_path, looks):
    jitter = np.random.default_rng(5).uniform(-0.2, 0.2, N) / RATE_HZ
    times = np.arange(N) / RATE_HZ + jitter
    rows = [f"{t:.9f},{row.partition(',')[2]}" for t, row in zip(times, rows_of(), strict=True)]
    log = scan(write(tmp_path / "a.csv", rows))
    assert log.channels[0].raster.n_samples == N
    assert np.array_equal(values_of(log), VALUES)


def test_a_row_cut_off_at_the_end_is_refused(tmp_path, looks):
    path = write(tmp_path / "a.csv", rows_of())
    path.write_bytes(path.read_bytes()[:-14])
    with pytest.raises(FormatError, match=rf"line {N + 1} has 2 fields"):
        scan(path)


def test_quoted_texts_are_counted(tmp_path, looks, monkeypatch):
    counted = []
    count_rows = reader.count_rows
    monkeypatch.setattr(reader, "count_rows", lambda *given: counted.append(given) or count_rows(*given))
    log = scan(write(tmp_path / "a.csv", ['"' + row.replace(",", '","') + '"' for row in rows_of()]))
    assert counted and np.array_equal(values_of(log), VALUES)
