"""ATFX: the layouts of public examples, base names instead of a vendor's, scaling, axes, starts, changed files."""

import os
import pickle

import numpy as np
import pytest
from faults_atfx import component, inline, single
from log_makers import RATE_HZ, signals
from makers_atfx import SHORT_NAMES, Atfx, make_atfx_components, make_atfx_inline, make_atfx_interleaved, numbers

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan

X = signals(200)[0]
VALUES = f"<A_FLOAT64>{numbers(X)}</A_FLOAT64>"


def values(log, column=0, block=64):
    n = log.channels[column].raster.n_samples
    return np.concatenate([part[0] for part in log.reader.blocks([column], 0, n, block)])


def test_what_is_said_of_a_log(tmp_path):
    log = scan(make_atfx_interleaved(tmp_path).path)
    assert (log.format, log.start_time) == ("atfx", "2014-10-07T17:14:40.250000")
    assert log.companions == (tmp_path / "data" / "run.bda",)
    assert dict(log.metadata) == {
        "exporter": "a maker",
        "base model version": "asam31",
        "measurement": "drive 1",
        "measurement_begin": "20141007171440250 (time zone not stated)",
    }
    assert [channel.quantity for channel in log.channels] == ["acceleration", "acceleration"]
    assert scan(make_atfx_inline(tmp_path).path).companions == ()


def test_two_submatrices_of_one_quantity_each_with_its_own_start(tmp_path):
    """As IPETRONIK's: the time of both is one measurement quantity, and begins at 9.48E-05 s and at 0."""
    atfx = Atfx(files=[("BinaryDataFile", "run.bda")])
    measurement = atfx.add("AoMeasurement", "71.iad")
    seconds, volts = atfx.unit("s", time=True), atfx.unit("V")
    quantity = atfx.add("AoMeasurementQuantity", "1.X", unit=seconds)
    (tmp_path / "run.bda").write_bytes(
        b"".join(np.array([(v, 15)], [("v", "<f8"), ("f", "<i2")]).tobytes() for v in (*X, *-X))
    )
    for number, start in enumerate(("9.48E-05", "0")):
        matrix = atfx.add("AoSubmatrix", f"71.iad({number})", number_of_rows=len(X), measurement=measurement)
        atfx.add("AoLocalColumn", "1.X", global_flag=15, independent=1, measurement_quantity=quantity, submatrix=matrix,
                 generation_parameters=f"{start} 0.0002", sequence_representation="implicit_linear")  # fmt: skip
        layout = {"start": number * 2000, "block": 10, "per_block": 1}
        inner = atfx.component("values", "BinaryDataFile", "ieeefloat8", len(X), **layout)
        inner += atfx.component("flags", "BinaryDataFile", "dt_short", len(X), **(layout | {"offset": 8}))
        atfx.column(matrix, f"c{number}", volts, inner, global_flag=None)
    log = scan(atfx.write(tmp_path / "log.atfx"))
    assert [(c.name, c.raster.sample_rate_hz, c.raster.start_s) for c in log.channels] == [
        ("c0", 5000.0, 9.48e-05),
        ("c1", 5000.0, 0.0),
    ]
    assert np.array_equal(values(log, 0), X) and np.array_equal(values(log, 1), -X)
    assert log.start_time is None and log.flags == ()


def test_relations_that_only_the_other_side_states(tmp_path):
    atfx = Atfx(names=SHORT_NAMES)
    unit = atfx.unit("Pa")
    column = atfx.add(
        "AoLocalColumn", "mic", atfx.array("values", VALUES), independent=0, sequence_representation="explicit"
    )
    quantity = atfx.add("AoMeasurementQuantity", "mic", local_columns=column)
    atfx.add("AoUnit", "V", measurement_quantities=quantity)
    atfx.add("AoSubmatrix", "sm", number_of_rows=200, local_columns=column)
    log = scan(atfx.write(tmp_path / "log.atfx"))
    assert (log.channels[0].name, log.channels[0].unit, unit) == ("mic", "V", 2)
    assert log.channels[0].raster.sample_rate_hz is None


@pytest.mark.parametrize(
    ("kind", "dtype"),
    [
        *(("dt_byte", "u1"), ("dt_sbyte", "i1"), ("dt_short", "<i2"), ("dt_short_beo", ">i2"), ("dt_ushort", "<u2")),
        *(("dt_long", "<i4"), ("dt_long_beo", ">i4"), ("dt_ulong_beo", ">u4"), ("dt_longlong", "<i8")),
        *(("ieeefloat4", "<f4"), ("ieeefloat4_beo", ">f4"), ("ieeefloat8_beo", ">f8"), ("5", "<f4"), ("11", ">f8")),
    ],
)
def test_value_types_by_name_and_by_number(tmp_path, kind, dtype):
    stored = (np.arange(200) % 100).astype(dtype)
    write = single(stored.tobytes(), component(kind=kind, block=stored.itemsize, per_block=1))
    log = scan(write(tmp_path))
    assert np.array_equal(values(log), stored.astype(np.float64))
    info = np.iinfo(dtype) if stored.dtype.kind in "iu" else None
    assert log.channels[0].limits == (None if info is None else (float(info.min), float(info.max)))


@pytest.mark.parametrize(("block", "per_block"), [(2, 1), (64, 3), (5_000_000, 70), (400, 200), (None, None)])
def test_blocks_of_values(tmp_path, block, per_block):
    """Values of 2 bytes from byte 5 on, `per_block` together, the others between them are 77."""
    stored = np.arange(200, dtype="<i2")
    size, count = (400, 200) if block is None else (block, per_block)
    with (tmp_path / "run.bin").open("wb") as stream:
        for number in range(-(-200 // count)):
            stream.seek(5 + number * size)
            stream.write(stored[number * count : (number + 1) * count].tobytes())
    blob = (tmp_path / "run.bin").read_bytes()
    layout = {"start": 5} if block is None else {"start": 2, "offset": 3, "block": max(block, 5), "per_block": count}
    if block == 2:
        layout = {"start": 5, "offset": 0, "block": 2, "per_block": 1}
    elif block == 400:
        layout = {"start": 5, "offset": 0, "block": 400, "per_block": 200}
    log = scan(single(blob, component(kind="dt_short", **layout))(tmp_path))
    assert np.array_equal(values(log), stored)
    assert np.array_equal(next(log.reader.blocks([0, 0], 33, 190, 1000)), [stored[33:190]] * 2)


@pytest.mark.parametrize(
    ("representation", "parameters", "expected"),
    [
        ("raw_linear", "1.5 0.25", lambda r: 1.5 + 0.25 * r),
        ("4", "1.5 0.25", lambda r: 1.5 + 0.25 * r),
        ("raw_linear_calibrated", "1.5 0.25 -2", lambda r: (1.5 + 0.25 * r) * -2.0),
        ("raw_polynomial", "2 1 -0.5 0.125", lambda r: 1.0 - 0.5 * r + 0.125 * r**2),
        ("explicit", "", lambda r: r),
    ],
)
@pytest.mark.parametrize("external", [False, True])
def test_scaling(tmp_path, representation, parameters, expected, external):
    raw = np.arange(200.0)
    said = {"sequence_representation": representation, "generation_parameters": parameters}
    if external:
        write = single(raw.astype("<i2").tobytes(), component(kind="dt_short", block=2, per_block=1), **said)
    else:
        write = inline(" ".join(f"{value:g}" for value in raw), "A_INT16", **said)
    log = scan(write(tmp_path))
    np.testing.assert_allclose(values(log), expected(raw), rtol=1e-15)
    ends = np.array([-32768.0, 32767.0])
    if "polynomial" not in representation:
        assert log.channels[0].limits == tuple(sorted(expected(ends)))


def test_implicit_channels(tmp_path):
    atfx = Atfx()
    matrix = atfx.matrix(50)
    atfx.time(matrix, atfx.unit("s", time=True))
    for name, kind, parameters in (("c", "implicit_constant", "3"), ("l", "implicit_linear", "1 -0.5")):
        atfx.column(matrix, name, None, sequence_representation=kind, generation_parameters=parameters)
    log = scan(atfx.write(tmp_path / "log.atfx"))
    assert np.array_equal(values(log, 0), np.full(50, 3.0)) and np.array_equal(values(log, 1), 1 - 0.5 * np.arange(50))


@pytest.mark.parametrize(
    ("unit", "factor", "step", "rate"),
    [("ms", 1e-3, 0.5, 2000.0), ("Sekunden!", 1.0, 0.01, 100.0), ("h", 3600.0, 1e-3, 1 / 3.6)],
)
def test_units_of_time_by_name_and_by_factor(tmp_path, unit, factor, step, rate):
    atfx = Atfx()
    matrix = atfx.matrix(200)
    atfx.time(matrix, atfx.unit(unit, factor, time=True), start=2.0, step=step)
    atfx.column(matrix, "mic", atfx.unit("Pa"), atfx.array("values", VALUES))
    (channel,) = scan(atfx.write(tmp_path / "log.atfx")).channels
    assert channel.raster.sample_rate_hz == pytest.approx(rate, rel=1e-12)
    assert channel.raster.start_s == 2.0 * factor and channel.flags == ()


def test_a_written_time_of_single_precision_is_snapped(tmp_path):
    n = 300_000  # longer than what is looked at as a whole
    t = (np.arange(n) / RATE_HZ).astype("<f4")
    (tmp_path / "run.bin").write_bytes(t.tobytes() + np.zeros(n, "<f4").tobytes())
    atfx = Atfx(files=[("B", "run.bin")])
    matrix = atfx.matrix(n)
    atfx.column(matrix, "t", atfx.unit("s", time=True), atfx.component("values", "B", "ieeefloat4", n), independent=1)
    atfx.column(matrix, "mic", None, atfx.component("values", "B", "ieeefloat4", n, start=4 * n))
    (channel,) = scan(atfx.write(tmp_path / "log.atfx")).channels
    assert channel.raster.sample_rate_hz == RATE_HZ and channel.flags == ()
    t[100_000:] += 2.0  # a gap of two seconds far from the ends
    (tmp_path / "run.bin").write_bytes(t.tobytes() + np.zeros(n, "<f4").tobytes())
    with pytest.raises(FormatError, match="unevenly spaced"):
        scan(tmp_path / "log.atfx")


def test_measurements_that_began_at_different_times(tmp_path):
    atfx = Atfx()
    seconds = atfx.unit("s", time=True)
    for begin in ("20260102030405500", "20260102030400"):
        matrix = atfx.matrix(200, begin)
        atfx.time(matrix, seconds)
        atfx.column(matrix, f"from {begin}", None, atfx.array("values", VALUES))
    log = scan(atfx.write(tmp_path / "log.atfx"))
    assert log.start_time == "2026-01-02T03:04:00"
    assert [channel.raster.start_s for channel in log.channels] == [5.5, 0.0]


@pytest.mark.parametrize("how", ["content", "length", "touched", "gone", "link"])
def test_a_component_file_that_changes_between_scan_and_read(tmp_path, how):
    made = make_atfx_components(tmp_path)
    log = pickle.loads(pickle.dumps(scan(made.path)))
    file = tmp_path / "values.btf"
    blob = file.read_bytes()
    if how == "gone":
        file.unlink()
    elif how == "link":
        file.unlink()
        outside = tmp_path.parent / f"{tmp_path.name}.btf"
        outside.write_bytes(blob)
        file.symlink_to(outside)
    else:
        file.write_bytes({"content": blob[::-1], "length": blob + b"\0", "touched": blob}[how])
        os.utime(file, ns=(0, 1_700_000_000_000_000_000))
    with pytest.raises(FormatError, match=r"has changed since|is not there|own folder"):
        list(log.reader.blocks([0], 0, 10, 10))


def test_many_channels_in_one_file_are_read_together(tmp_path):
    n_channels, n = 1500, 40
    data = np.random.default_rng(1).normal(size=(n, n_channels)).astype("<f4")
    (tmp_path / "run.bin").write_bytes(data.tobytes())
    atfx = Atfx(files=[("B", "run.bin")])
    matrix = atfx.matrix(n)
    volts = atfx.unit("V")
    atfx.time(matrix, atfx.unit("s", time=True))
    for number in range(n_channels):
        layout = {"start": 4 * number, "block": 4 * n_channels, "per_block": 1}  # as PAK: the start differs
        atfx.column(matrix, f"c{number}", volts, atfx.component("values", "B", "ieeefloat4", n, **layout))
    log = scan(atfx.write(tmp_path / "log.atfx"))
    columns = np.random.default_rng(2).permutation(n_channels)
    (block,) = log.reader.blocks(columns, 3, n, 1000)
    assert np.array_equal(block, data[3:, columns].T)


@pytest.mark.parametrize("encoding", ["ISO-8859-1", "UTF-8", "UTF-8-SIG", "windows-1252"])
def test_encodings(tmp_path, encoding):
    path = make_atfx_inline(tmp_path).path
    text = path.read_text(encoding="utf-8").replace('"UTF-8"', f'"{encoding.removesuffix("-SIG")}"')
    path.write_bytes(text.replace("drive 1", "Fahrt 1, 20 °C" * 40).encode(encoding))
    log = scan(path)
    assert log.channels[0].unit == "m/s²" and np.array_equal(values(log), signals()[0])


def test_utf_16_is_refused(tmp_path):
    path = make_atfx_inline(tmp_path).path
    path.write_bytes(path.read_text(encoding="utf-8").replace('"UTF-8"', '"UTF-16"').encode("utf-16"))
    with pytest.raises(FormatError, match="no ASAM ODS ATFX file"):
        scan(path)
