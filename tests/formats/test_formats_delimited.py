"""Texts of numbers: dialects, headings, time columns, refusals."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan


@pytest.fixture
def log_of(tmp_path):
    def write(text, encoding="utf-8"):
        path = tmp_path / "log.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return scan(path)

    return write


def values(log):
    n = log.channels[0].raster.n_samples
    return np.concatenate(list(log.reader.blocks(range(len(log.channels)), 0, n, 7)), axis=1)


def names(log):
    return [channel.name for channel in log.channels]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,5;2,5\n3,5;4,5\n", [[1.5, 3.5], [2.5, 4.5]]),
        ("1,5\n3,5\n", [[1, 3], [5, 5]]),
        ("mic\n1,5\n3,5\n", [[1.5, 3.5]]),
        ("1.5\t2.5\n3.5\t4.5\n", [[1.5, 3.5], [2.5, 4.5]]),
        ("1,5\t2,5\n3,5\t4,5\n", [[1.5, 3.5], [2.5, 4.5]]),
        ("1.5|2.5\n3.5|4.5\n", [[1.5, 3.5], [2.5, 4.5]]),
        ("  1.5   2.5\n -3.5  -4.5\n", [[1.5, -3.5], [2.5, -4.5]]),
        ("1,5 2,5\n3,5 4,5\n", [[1.5, 3.5], [2.5, 4.5]]),
        ("1.5, 2.5\n3.5, 4.5\n", [[1.5, 3.5], [2.5, 4.5]]),
        ("1;2,5\n3;4\n", [[1, 3], [2.5, 4]]),
        ("1e3,-2E-3\n.5,+4.\n", [[1000, 0.5], [-0.002, 4]]),
        ('"1,5","2,5"\n"3,5","4,5"\n', [[1.5, 3.5], [2.5, 4.5]]),
        ("1;2;\n3;4;\n", [[1, 3], [2, 4]]),
        ("7\n8\n", [[7, 8]]),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_dialects(log_of, text, expected, end):
    log = log_of(text.replace("\n", end))
    assert names(log) == [f"ch{index}" for index in range(1, len(expected) + 1)] or names(log) == ["mic"]
    assert np.array_equal(values(log), expected)
    assert all(channel.raster.sample_rate_hz is None and channel.full_scale is None for channel in log.channels)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-le-bom", "utf-16-be-bom"])
def test_encodings(log_of, encoding):
    text = "Motor Z [m/s²];Mikrofon Ä (Pa)\n1,5;2\n3;4\n"
    if encoding.endswith("-bom"):
        blob = ("\ufeff" + text).encode(encoding.removesuffix("-bom"))
    else:
        blob = text.encode(encoding)
    log = log_of(blob)
    assert [(c.name, c.unit, c.quantity) for c in log.channels] == [
        ("Motor Z", "m/s²", "acceleration"),
        ("Mikrofon Ä", "Pa", "sound_pressure"),
    ]
    assert np.array_equal(values(log), [[1.5, 3], [2, 4]])


@pytest.mark.parametrize(
    ("heading", "expected"),
    [
        ("a [g],b (Pa)", [("a", "g"), ("b", "Pa")]),
        ("a,b\ng,Pa", [("a", "g"), ("b", "Pa")]),
        ("a,b\n[g],[Pa]", [("a", "g"), ("b", "Pa")]),
        ("a,b\n(g),", [("a", "g"), ("b", None)]),
        ("motor (left),b [xyz]", [("motor (left)", None), ("b", "xyz")]),
        ("# a,b", [("a", None), ("b", None)]),
        ("F / N,a / (m/s²)", [("F", "N"), ("a", "m/s²")]),
        ("a,a", [("a", None), ("a#2", None)]),
        (",b", [("ch1", None), ("b", None)]),
        ('"a, left","b"', [("a, left", None), ("b", None)]),
        ("Logger: X\nOperator = Y\n\na,b", [("a", None), ("b", None)]),
        ("SpeedMotor(W:1234),b", [("SpeedMotor(W:1234)", None), ("b", None)]),
        ("Logger: X", [("ch1", None), ("ch2", None)]),
    ],
)
def test_headings(log_of, heading, expected):
    log = log_of(heading + "\n1,2\n3,4\n5,6\n")
    assert [(c.name, c.unit) for c in log.channels] == [(n, u and u.strip("()")) for n, u in expected]
    assert np.array_equal(values(log), [[1, 3, 5], [2, 4, 6]])


def test_preamble_is_kept_and_its_rate_honoured(log_of):
    log = log_of("Logger: X12\nSample rate: 8192 Hz\nStart time: 2026-03-01 10:00:00\n\na;b\n1;2\n3;4\n")
    assert log.channels[0].raster.sample_rate_hz == 8192.0
    assert log.start_time == "2026-03-01T10:00:00"
    assert ("Logger", "X12") in log.metadata


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Sampling Frequency;51,2 kHz", 51200.0),
        ("fs = 1000", 1000.0),
        ("Abtastrate [Hz]: 2048", 2048.0),
        ("Delta_X\t0.001\t0.001", 1000.0),
        ("dt: 0.5 ms", 2000.0),
        ("Sample rate: 1000 Hz\nSampling rate: 2000 Hz", None),
        ("Sample rate: fast", None),
    ],
)
def test_stated_rates(log_of, line, rate):
    log = log_of(f"{line}\na\tb\n1\t2\n3\t4\n")
    assert log.channels[0].raster.sample_rate_hz == rate
    assert bool(log.flags) == (rate is None)


@pytest.mark.parametrize(
    ("heading", "form", "rate"),
    [
        ("Time [s]", lambda i: f"{i / 8192:.6f}", 8192.0),
        ("t [ms]", lambda i: f"{1000 * i / 8192:.4f}", 8192.0),
        ("Zeit (s)", lambda i: f"{5 + i / 51200:.7f}", 51200.0),
        ("X_Value", lambda i: f"{i / 51200:.7E}", 51200.0),
        ("time_s", lambda i: f"{i * 0.0005:.4f}", 2000.0),
        ("Timestamp", lambda i: f"2026-03-01T10:00:{i / 100:09.6f}", 100.0),
        ("Date", lambda i: f"2026-03-01 10:00:{i / 100:06.3f}".replace(".", "."), 100.0),
    ],
)
def test_time_columns_give_the_rate(log_of, heading, form, rate):
    log = log_of(f"{heading};mic [Pa]\n" + "".join(f"{form(i)};{i}.5\n" for i in range(2000)))
    assert names(log) == ["mic"]
    assert log.channels[0].raster.sample_rate_hz == rate
    assert np.array_equal(values(log)[0], np.arange(2000) + 0.5)
    if heading == "Zeit (s)":
        assert log.channels[0].raster.start_s == 5.0
    if heading in ("Timestamp", "Date"):
        assert log.start_time.startswith("2026-03-01T10:00:00")


def test_x_that_is_no_time_is_a_channel(log_of):
    assert names(log_of("x,y\n1,2\n-3,4\n2,2\n")) == ["x", "y"]


@pytest.mark.parametrize("n", [1000, 30_000])
@pytest.mark.parametrize("at", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("kind", ["one missing", "jump back", "jitter"])
def test_a_time_column_with_a_fault_is_refused(log_of, n, at, kind):
    row = int(at * n)
    index = np.arange(n, dtype=float)
    if kind == "one missing":
        index[row:] += 1
    elif kind == "jump back":
        index[row:] -= 100
    else:
        index[row] += 0.8
    text = "time [s],a\n" + "".join(f"{i / 8192:.7f},1\n" for i in index)
    with pytest.raises(FormatError, match=rf"log\.csv: line {row + 2}: the time column is not equidistant"):
        values(log_of(text))


def test_a_gap_in_a_cut_is_found_when_it_is_read(log_of):
    index = np.arange(30_000.0)
    index[15_000:] += 1
    index[20_000:] -= 1  # the ends agree: a scan cannot see it
    log = log_of("time [s],a\n" + "".join(f"{i / 8192:.7f},{i}\n" for i in index))
    assert np.array_equal(next(log.reader.blocks([0], 0, 1000, 1000))[0], index[:1000])
    with pytest.raises(FormatError, match="line 15002"):
        values(log)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n", "no row of numbers"),
        ("\n\n", "no CSV or TSV"),
        ("hello world\n", "no row of numbers"),
        ("a,b\n1,2\n3,4\n5\n7,8\n", r"line 4 has 1 fields"),
        ("a,b\n1,2\n3,4,5\n5,6\n", r"line 3 has 3 fields"),
        ("a;b;c\n1;2;3\n1;2\n4;5;6\n1;2;3;4\n", r"line 3 has 2 fields"),
        ("1 2 3\n1 2\n4 5 6\n", r"line 2 has 2 fields"),
        ("a,b\n1,2\n\n3,4\n", "line 3 is empty"),
        ("a\n1\n\n3\n", "line 3 is empty"),
        ("a,b\n1,2\n3,x\n5,6\n", "line 3: 'x' in 'b' is no number"),
        ("a,b,c\n1,2\n3,4\n", "line 1 names 3 columns, the rows have 2"),
        ("Number of samples: 5\na,b\n1,2\n3,4\n", "truncated: the heading claims 5 samples, the file holds 2"),
        ("time,a\n1,2\n1,3\n1,4\n", "does not rise"),
        ("a,b\r1,2\r", "CR alone"),
    ],
)
def test_refusals_name_file_and_line(log_of, text, message):
    with pytest.raises(FormatError, match=message) as caught:
        log_of(text)
    assert "log.csv" in str(caught.value)


def test_a_text_far_inside_is_found_when_read(log_of):
    rows = [f"{i},{i}" for i in range(20_000)]
    rows[11_111] = "1,abc"
    log = log_of("a,b\n" + "\n".join(rows) + "\n")
    assert next(log.reader.blocks([0], 0, 20_000, 20_000)).shape == (1, 20_000)
    with pytest.raises(FormatError, match=r"line 11113: 'abc' in 'b' is no number"):
        list(log.reader.blocks([1], 0, 20_000, 1000))


def test_empty_cells_and_nan(log_of):
    assert np.array_equal(
        values(log_of("a;b\n1;2\n;4\nNaN;nan\n5;\n")), [[1, np.nan, np.nan, 5], [2, 4, np.nan, np.nan]], equal_nan=True
    )


def test_text_and_counting_columns_are_skipped(log_of):
    log = log_of("No;state;a\n1;on;5\n2;off;6\n3;on;7\n")
    assert names(log) == ["a"]
    assert np.array_equal(values(log), [[5, 6, 7]])
    assert any("'state' holds text" in flag for flag in log.flags)
    assert any("'No' only counts" in flag for flag in log.flags)


@pytest.mark.parametrize(("tail", "flagged"), [("", True), ("\n", False), ("\n\n\n", False), ("\r\n  \r\n", False)])
def test_the_end_of_the_file(log_of, tail, flagged):
    log = log_of("a,b\n1,2\n3,4" + tail)
    assert log.channels[0].raster.n_samples == 2
    assert bool(log.flags) == flagged


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(st.lists(st.floats(allow_infinity=False), min_size=3, max_size=3), min_size=2, max_size=20),
    dialect=st.sampled_from([(",", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", "."), (" ", ".")]),
)
def test_written_numbers_come_back(log_of, rows, dialect):
    delimiter, decimal = dialect
    text = "\n".join(delimiter.join(repr(v).replace(".", decimal) for v in row) for row in rows)
    log = log_of(delimiter.join("abc") + "\n" + text + "\n")
    assert np.array_equal(values(log), np.array(rows).T, equal_nan=True)


@pytest.mark.parametrize("quoted", [False, True])
def test_rows_over_many_pieces(log_of, quoted, monkeypatch):
    from tdacoustic.formats.delimited import rows

    monkeypatch.setattr(rows, "CHUNK_BYTES", 1000)
    x = np.random.default_rng(0).normal(size=(3000, 2))
    mark = '"' if quoted else ""
    log = log_of("a,b\n" + "".join(f"{mark}{a!r}{mark},{mark}{b!r}{mark}\n" for a, b in x.tolist()) + "\n\n")
    assert len(log.reader.reader.rows.checkpoints) > 50
    assert np.array_equal(values(log), x.T)
    assert np.array_equal(next(log.reader.blocks([1], 2345, 2999, 1000))[0], x[2345:2999, 1])
