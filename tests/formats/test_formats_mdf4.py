"""MDF 4: fields of any bits, conversions, rasters and starts, held against asammdf or against what was written."""

import tempfile
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from mdf4_parts import RATE_HZ, SIGNAL, TIME, Parts, channel, data_group, group, header, in_columns, one_group, rows

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan
from tdacoustic.formats.mdf4.formula import parse_formula

N = 300
T = np.arange(N) / RATE_HZ


def read(log, column):
    blocks = list(log.reader.blocks([column], 0, log.channels[column].raster.n_samples, 100))
    return np.concatenate(blocks, axis=1)[0]


def of_asammdf(path, name):
    from asammdf import MDF

    with MDF(path) as log:
        return log.get(name, ignore_invalidation_bits=True).samples.astype(np.float64)


def write(path, parts, **options):
    path.write_bytes(parts.made(**options))
    return path


@pytest.mark.parametrize("data_type", [0, 1, 2, 3])
@pytest.mark.parametrize(
    ("bit", "bits"), [(0, 8), (0, 16), (0, 32), (0, 64), (0, 24), (3, 5), (4, 12), (7, 33), (1, 1), (5, 59)]
)
def test_integers_of_any_bits_are_those_of_asammdf(tmp_path, data_type, bit, bits):
    rng = np.random.default_rng(bits)
    raw = np.hstack([np.frombuffer(rows(T), np.uint8).reshape(N, 8), rng.integers(0, 256, (N, 11), dtype=np.uint8)])
    channels = (TIME, ("x", 10, {"data_type": data_type, "bit": bit, "bits": bits}))
    path = write(tmp_path / "a.mf4", one_group(T, None, channels, raw=raw.tobytes(), size=19))
    found = read(scan(path), 0)
    if data_type % 2 and bits % 8:  # the width of the bytes that asammdf swaps is that of the next standard integer
        held = [
            int.from_bytes(row[10 : 10 + (bit + bits + 7) // 8].tobytes(), "big") >> bit & (1 << bits) - 1
            for row in raw
        ]
        wanted = np.array([v - (1 << bits) if data_type == 3 and v >> bits - 1 else v for v in held], dtype=np.float64)
    else:
        wanted = of_asammdf(path, "x")
    assert np.array_equal(found, wanted)


@pytest.mark.parametrize("bits", [16, 32, 64])
@pytest.mark.parametrize("order", "<>")
def test_floats_of_both_orders(tmp_path, bits, order):
    x = np.sin(np.arange(N)).astype(f"{order}f{bits // 8}")
    raw = np.hstack([np.frombuffer(part.tobytes(), np.uint8).reshape(N, -1) for part in (T.astype("<f8"), x)])
    channels = (TIME, ("x", 8, {"data_type": 4 + (order == ">"), "bits": bits}))
    path = write(tmp_path / "a.mf4", one_group(T, None, channels, raw=raw.tobytes(), size=8 + bits // 8))
    assert np.array_equal(read(scan(path), 0), x.astype(np.float64))


CONVERSIONS = {
    "linear": {"kind": 1, "values": (3.0, -0.25)},
    "rational": {"kind": 2, "values": (0.5, 2.0, 1.0, 0.0, 0.1, 7.0)},
    "interpolated": {"kind": 4, "values": (-5.0, 1.0, 0.0, 3.0, 11.0, -2.0)},
    "nearest": {"kind": 5, "values": (-5.0, 1.0, 0.0, 3.0, 11.0, -2.0)},
    "ranges": {"kind": 6, "values": (-10.0, -3.0, 1.0, 2.0, 6.0, 5.0, 8.0, 9.0, 4.0, 99.0)},
    "formula": {"kind": 3, "text": "(X*2+1)/4 - sqrt(X*X)"},
}


def of_ranges(x, whole):
    """What the standard says of a table of ranges, value by value: whole numbers include the upper end."""
    table = CONVERSIONS["ranges"]["values"]
    found = np.full(len(x), table[-1])
    for low, high, value in zip(table[0:-1:3], table[1:-1:3], table[2:-1:3], strict=True):
        found[(x >= low) & ((x <= high) if whole else (x < high))] = value
    return found


@pytest.mark.parametrize("kind", list(CONVERSIONS))
@pytest.mark.parametrize("whole", [True, False])
def test_conversions_are_those_of_asammdf(tmp_path, kind, whole, conformance):
    x = np.round(np.linspace(-14, 14, N)) if whole else np.linspace(-13.7, 13.9, N)
    parts = [T.astype("<f8"), x.astype("<i2" if whole else "<f8")]
    raw = np.hstack([np.frombuffer(part.tobytes(), np.uint8).reshape(N, -1) for part in parts])
    field = {"data_type": 2, "bits": 16} if whole else {}
    channels = (TIME, ("x", 8, {**field, "convert": {**CONVERSIONS[kind], "unit": "Pa"}}))
    path = write(tmp_path / "a.mf4", one_group(T, None, channels, raw=raw.tobytes(), size=10 if whole else 16))
    log = scan(path)
    assert log.channels[0].unit == "Pa" and log.channels[0].quantity == "sound_pressure"
    if kind == "ranges":  # asammdf 8.8 gives whole numbers within a range the default, and those outside a value
        assert np.array_equal(read(log, 0), of_ranges(x, whole))
        assert whole or np.array_equal(of_asammdf(path, "x"), of_ranges(x, whole))
        return
    wanted = of_asammdf(path, "x")
    off = float(np.max(np.abs(read(log, 0) - wanted) / np.maximum(np.abs(wanted), 1e-300)))
    what = f"conversion {kind} of {'integers' if whole else 'floats'}, largest relative difference"
    conformance(what, 0.0, off, 1e-14, "1", "program: asammdf")  # the order of the operations


def test_limits_follow_a_linear_conversion_and_full_scale_stands_without_unit(tmp_path):
    raw = np.zeros((N, 12), np.uint8)
    raw[:, :8] = np.frombuffer(rows(T), np.uint8).reshape(N, 8)
    field = {"data_type": 2, "bits": 16}
    channels = (TIME, ("a", 8, field), ("b", 10, {**field, "convert": {"kind": 1, "values": (1.0, -0.5)}, "unit": "V"}))
    log = scan(write(tmp_path / "a.mf4", one_group(T, None, channels, raw=raw.tobytes(), size=12)))
    assert [channel.limits for channel in log.channels] == [(-32768.0, 32767.0), (-16382.5, 16385.0)]
    assert [channel.full_scale for channel in log.channels] == [32768.0, None]


def test_rasters_of_several_groups_are_kept_apart(tmp_path):
    from asammdf import MDF, Signal

    with MDF(version="4.10") as log:
        log.start_time = datetime(2026, 3, 4, 5, 6, 7, 123456, tzinfo=timezone(timedelta(hours=2)))
        log.append([Signal(np.sin(T), T, name="mic", unit="Pa")], acq_name="noise")
        log.append([Signal(np.cos(T[:50]), 0.25 + np.arange(50) / 100.0, name="rpm", unit="rpm")])
        log.append([Signal(T, 1e-4 + T / 2, name="mic", unit="V")], acq_name="voltage")
        log.save(tmp_path / "a.mf4", overwrite=True)
    log = scan(tmp_path / "a.mf4")
    assert log.start_time == "2026-03-04T05:06:07.123456+02:00"
    assert [channel.name for channel in log.channels] == ["noise/mic", "rpm", "voltage/mic"]
    rasters = [channel.raster for channel in log.channels]
    assert [raster.sample_rate_hz for raster in rasters] == [RATE_HZ, 100.0, 2 * RATE_HZ]
    assert [raster.n_samples for raster in rasters] == [N, 50, N]
    assert [raster.start_s for raster in rasters] == [0.0, 0.25, 1e-4]
    both = np.concatenate(list(log.reader.blocks([2, 0], 10, 40, 7)), axis=1)
    assert np.array_equal(both, [T[10:40], np.sin(T)[10:40]])


@pytest.mark.parametrize(
    ("time_flags", "zone", "wanted"),
    [
        (0, 60, "2026-09-21T14:13:20.123456+00:00"),
        (1, 60, "2026-09-21T14:13:20.123456"),
        (2, 60, "2026-09-21T16:13:20.123456+02:00"),
    ],
)
def test_the_start_has_the_offset_that_the_header_states(tmp_path, time_flags, zone, wanted):
    seconds = datetime(2026, 9, 21, 14, 13, 20, tzinfo=UTC).timestamp()
    made = one_group(T, T, start_ns=int(seconds) * 10**9 + 123_456_000, zone=zone, time_flags=time_flags)
    assert scan(write(tmp_path / "a.mf4", made)).start_time == wanted


def test_groups_in_columns_follow_the_clock_of_another(tmp_path):
    """Against what was written alone: asammdf 8.8 neither writes nor reads lists of columns (it ends in errors)."""
    marks = np.isin(np.arange(N), (7, 150))
    path = write(tmp_path / "a.mf4", in_columns(0.5 + T, np.cos(T), marks), version=b"4.20", number=420)
    (motor,) = scan(path).channels
    assert (motor.raster.sample_rate_hz, motor.raster.start_s, motor.raster.n_samples) == (RATE_HZ, 0.5, N)
    assert motor.flags == ("2 of 300 samples are marked invalid and read as NaN",)
    assert np.array_equal(read(scan(path), 0), np.where(marks, np.nan, np.cos(T)), equal_nan=True)
    with pytest.raises(FormatError, match="299 values on the 300 instants of another group"):
        scan(write(path, in_columns(T, np.cos(T), marks, claimed=N - 1), version=b"4.20"))
    with pytest.raises(FormatError, match="'group 2' claims 301 records of 8 bytes, the file holds 300"):
        scan(write(path, in_columns(T, np.cos(T), marks, claimed=N + 1), version=b"4.20"))
    with pytest.raises(FormatError, match="not even"):
        scan(write(path, in_columns(T + (np.arange(N) > 99), np.cos(T), marks), version=b"4.20"))


def test_a_virtual_master_gives_rate_and_start(tmp_path):
    master = (
        "t",
        0,
        {"kind": 3, "sync": 1, "data_type": 0, "bits": 0, "convert": {"kind": 1, "values": (0.5, 1 / 51200)}},
    )
    path = write(tmp_path / "a.mf4", one_group(T, None, (master, ("x", 0, {})), raw=rows(np.sin(T)), size=8))
    (x,) = scan(path).channels
    assert (x.raster.sample_rate_hz, x.raster.start_s) == (51200.0, 0.5)
    assert np.array_equal(read(scan(path), 0), np.sin(T))


@pytest.mark.parametrize(("dtype", "scale"), [("<f4", 1.0), ("<i8", 1e-9), ("<u4", 1e-6)])
def test_masters_of_other_types_and_their_rounding(tmp_path, dtype, scale):
    times = 3.0 + np.arange(N) / 1000.0
    stored = times.astype(dtype) if dtype == "<f4" else np.round(times / scale).astype(dtype)
    raw = np.hstack([np.frombuffer(part.tobytes(), np.uint8).reshape(N, -1) for part in (stored, T.astype("<f8"))])
    width = stored.dtype.itemsize
    field = {"kind": 2, "sync": 1, "bits": 8 * width, "data_type": {"f": 4, "i": 2, "u": 0}[dtype[1]]}
    if scale != 1.0:
        field["convert"] = {"kind": 1, "values": (0.0, scale)}
    path = write(
        tmp_path / "a.mf4", one_group(T, None, (("t", 0, field), ("x", width, {})), raw=raw.tobytes(), size=width + 8)
    )
    (x,) = scan(path).channels
    assert x.raster.sample_rate_hz == 1000.0
    assert x.raster.start_s == pytest.approx(3.0, abs=1e-9)
    assert np.array_equal(read(scan(path), 0), T)


def test_a_cut_at_the_boundary_of_any_block_is_refused(tmp_path):
    parts = one_group(T, T)
    blob = parts.made()
    for address in [*parts.addresses, len(blob) - 8]:
        (tmp_path / "a.mf4").write_bytes(blob[:address])
        with pytest.raises(FormatError, match="truncated"):
            scan(tmp_path / "a.mf4")


def test_more_channels_than_a_log_may_have_are_refused(tmp_path):
    parts = Parts()
    first = None
    for number in range(20_002):
        first = channel(parts, first, "x", 0, tag=f"c{number}")
    group(parts, [], n=1, size=8)
    parts.blocks[parts.tags["group"]][1][1] = first
    data = parts.add("DT", [], b"\0" * 8)
    made = header(parts, data_group(parts, parts.tags["group"], data))
    with pytest.raises(FormatError, match="more than 10000 channels"):
        scan(write(tmp_path / "a.mf4", made))


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "X.__class__",
        "(lambda: X)()",
        "[X for X in (1,)]",
        "open('a')",
        "X if X else 1",
        "'a'*10**9",
        "pow(X)",
        "X^2",
        "X" + "+X" * 300,
        "-" * 499 + "X",
        "(" * 300 + "X",
        "",
        "1e999*X",
        "sin(x=X)",
        "np.exp(X)",
    ],
)
def test_a_formula_of_anything_but_arithmetic_is_refused(text):
    assert parse_formula(text) is None


def test_a_formula_is_computed():
    x = np.array([0.25, 4.0])
    assert np.allclose(
        parse_formula("2*X**2 - pow(X1, 0.5)/(1+exp(-x))")(x), 2 * x**2 - x**0.5 / (1 + np.exp(-x)), rtol=1e-15
    )
    assert np.array_equal(parse_formula("3")(x), [3.0, 3.0])
    assert np.isnan(parse_formula("log(X-5)")(x)).all()


def test_attachments_stay_where_they_are_and_nothing_is_left_behind(tmp_path, monkeypatch):
    from asammdf import MDF, Signal

    with MDF(version="4.10") as log:
        log.append([Signal(T, T, name="x")])
        log.attach(b"secret" * 100, file_name="picture.bin", embedded=True)
        log.save(tmp_path / "a.mf4", overwrite=True)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    before = sorted(tmp_path.rglob("*"))
    log = scan(tmp_path / "a.mf4")
    assert np.array_equal(read(log, 0), T)
    assert sorted(tmp_path.rglob("*")) == before
    assert not list(Path.cwd().glob("picture.bin"))


def test_a_log_is_read_without_asammdf(tmp_path):
    import subprocess
    import sys

    path = write(tmp_path / "a.mf4", one_group(T, T, (TIME, SIGNAL)))
    code = (
        "import sys; from tdacoustic.formats import scan; log = scan(sys.argv[1])\n"
        "assert sum(b.shape[1] for b in log.reader.blocks([0], 0, 300, 64)) == 300\n"
        "print({'asammdf', 'pandas', 'scipy', 'numexpr'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"
