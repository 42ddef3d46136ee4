"""UFF 58 and 58b: layouts, names, refusals, malformed endings, truncation; pyuff as the oracle."""

import numpy as np
import pytest
import pyuff
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_makers import signals, uff_ascii, uff_binary

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan

X = signals()[0]


@pytest.fixture
def log_of(tmp_path):
    def write(blob):
        (tmp_path / "log.uff").write_bytes(blob)
        return scan(tmp_path / "log.uff")

    return write


def values(log, column=0, block=100):
    n = log.channels[column].raster.n_samples
    return np.concatenate([part[0] for part in log.reader.blocks([column], 0, n, block)])


@pytest.mark.parametrize(
    ("name", "rate", "raw", "n", "unit", "start"),
    [
        (
            "mosqito_emotor_vibration/electric_motor_vibration_signal",
            51200.0,
            51200.131,
            181504,
            "m/s²",
            "2021-07-28T10:28:51",
        ),
        ("pyuff_microphone/Sample_UFF58_ascii", 65536.0, 65535.953, 79292, "Pa", "2016-04-18T13:49:58"),
        ("pyuff_microphone/Sample_UFF58b_bin", 65536.0, 65535.953, 79292, "Pa", "2016-04-18T13:49:58"),
    ],
)
def test_real_recordings_against_pyuff(recordings, name, rate, raw, n, unit, start):
    path = recordings / f"{name}.uff"
    log = scan(path)
    (channel,) = log.channels
    assert channel.name == ("ch1" if "mosqito" in name else "Mic 01")
    assert (channel.raster.sample_rate_hz, channel.raster.n_samples, channel.unit) == (rate, n, unit)
    assert channel.raster.sample_rate_raw_hz == pytest.approx(raw, abs=1e-3)
    assert channel.quantity == ("acceleration" if "mosqito" in name else "sound_pressure")
    assert log.start_time == start and log.flags == () and channel.flags == ()
    assert np.array_equal(values(log, block=9999), pyuff.UFF(str(path)).read_sets()["data"])


def test_ascii_and_binary_of_one_record_agree(recordings):
    ascii_log = scan(recordings / "pyuff_microphone" / "Sample_UFF58_ascii.uff")
    binary_log = scan(recordings / "pyuff_microphone" / "Sample_UFF58b_bin.uff")
    np.testing.assert_allclose(values(ascii_log), values(binary_log), rtol=5.1e-6)  # six printed digits


@pytest.mark.parametrize("n", [1, 5, 6, 7, 12, 1003])
@pytest.mark.parametrize("width", [13, 20])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_ascii_lengths(log_of, tmp_path, n, width, end):
    log = log_of(uff_ascii(X[:n], width, end))
    np.testing.assert_allclose(values(log), X[:n], rtol=6e-6 if width == 13 else 1e-12, atol=1e-300)
    if end == b"\n":
        assert np.array_equal(values(log), pyuff.UFF(str(tmp_path / "log.uff")).read_sets()["data"])


@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", ">f8"])
def test_binary_types(log_of, dtype):
    assert np.array_equal(values(log_of(uff_binary(X, dtype))), X.astype(dtype).astype(np.float64))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.floats(-1e12, 1e12), min_size=2, max_size=40), st.sampled_from(["%20.12e", "%20.11E", "%20.5f"]))
def test_printed_numbers_come_back_as_python_reads_them(log_of, numbers, form):
    rows = [numbers[at : at + 4] for at in range(0, len(numbers), 4)]
    body = b"".join("".join(form % v for v in row).encode() + b"\n" for row in rows)
    whole = uff_ascii(np.zeros(len(numbers)), 20)
    head = whole[: whole.index(b"  0.000000000000e+00")]
    log = log_of(head + body + b"    -1\n")
    assert np.array_equal(values(log), [float(form % v) for v in numbers])


def test_values_without_a_blank_between(log_of):
    x = np.array([-1e-100, -2e-101, 3e100, -4e-200, 5.0, -6e-300, -7.0])
    assert np.array_equal(values(log_of(uff_ascii(x))), x)


def test_fortran_d_exponents_and_short_lines(log_of):
    blob = uff_ascii(np.array([1.5, -2.5, 3.5, 4.5]), 20)
    assert np.array_equal(values(log_of(blob.replace(b"e+00", b"D+00"))), [1.5, -2.5, 3.5, 4.5])
    head = blob[: blob.index(b"  1.5")]
    loose = log_of(head + b"1.5 -2.5\n 3.5\n4.5\n    -1\n")
    assert np.array_equal(values(loose, block=3), [1.5, -2.5, 3.5, 4.5])


def test_several_records_and_other_data_sets(log_of):
    other = b"    -1\n   151\nmodel\n\n  1 2 3\n    -1\n    -1\n   164\n 1 SI\n    -1\n"
    blob = other + uff_ascii(X, entity="motor") + other + uff_binary(X[:500], ">f4", entity="mic") + other
    log = log_of(blob)
    assert [c.name for c in log.channels] == ["motor", "mic"]
    assert [c.raster.n_samples for c in log.channels] == [1003, 500]
    assert np.array_equal(values(log, 1), X[:500].astype("f4"))


@pytest.mark.parametrize(
    ("records", "names"),
    [
        ([("a", "x", 0), ("b", "x", 0)], ["a", "b"]),
        ([("a", "left", 0), ("a", "right", 0)], ["left", "right"]),
        ([("a", "x", 1), ("a", "x", 2)], ["a:1:", "a:2:"]),
        ([("NONE", "NONE", 7)], ["ch1"]),
        ([("NONE", "title", 7)], ["title"]),
        ([("a", "x", 0), ("a", "x", 0)], ["a", "a#2"]),
        ([("None", "NONE", 0), ("NONE", "none", 0)], ["ch1", "ch2"]),
    ],
)
def test_names(log_of, records, names):
    log = log_of(b"".join(uff_ascii(X[:9], entity=entity, id1=id1, node=node) for entity, id1, node in records))
    assert [channel.name for channel in log.channels] == names
    assert any("a#2" in flag for flag in log.channels[-1].flags) == (names[-1] == "a#2")


@pytest.mark.parametrize(
    ("ordinate", "unit", "quantity"),
    [
        ((12, "Acc", b"m/s\xb2"), "m/s²", "acceleration"),
        ((12, "Acc", "m/s²".encode()), "m/s²", "acceleration"),
        ((12, "Acc", b"NONE"), None, "acceleration"),
        ((21, "P", b"Pa"), "Pa", "sound_pressure"),
        ((21, "P", b"NONE"), None, None),
        ((15, "P", b"V"), "V", "voltage"),
        ((19, "n", b"NONE"), None, "speed"),
        ((13, "F", b"NONE"), None, "force"),
        ((11, "v", b"mm/s"), "mm/s", "other"),
        ((0, "?", b"NONE"), None, None),
    ],
)
def test_units_and_quantities(log_of, ordinate, unit, quantity):
    (channel,) = log_of(uff_ascii(X[:9], ordinate=ordinate)).channels
    assert (channel.unit, channel.quantity, channel.full_scale) == (unit, quantity, None)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({"function": 2, "abscissa": (18, "Frequency", "Hz")}, "data set 58 holds an auto spectrum, not a time signal"),
        ({"function": 4, "abscissa": (18, "Frequency", "Hz")}, "frequency response function"),
        ({"function": 12}, "data set 58 holds a spectrum, not a time signal"),
        ({"function": 1, "abscissa": (18, "Frequency", "Hz")}, "not a time signal"),
        ({"function": 0, "abscissa": (0, "Index", "NONE")}, "abscissa is not time"),
        ({"function": 1, "abscissa": (1, "Angle", "deg")}, "'deg', not a time"),
        ({"even": 0}, "unevenly spaced"),
        ({"data_type": 5}, "complex"),
        ({"function": 27}, "order function"),
        ({"function": 99}, "function type 99"),
    ],
)
def test_what_is_no_time_signal(log_of, header, message):
    with pytest.raises(FormatError, match=message):
        log_of(uff_ascii(X, **header))
    log = log_of(uff_ascii(X, **header) + uff_ascii(X, entity="good"))
    assert [c.name for c in log.channels] == ["good"]
    assert any("record 1" in flag and "left out" in flag for flag in log.flags)


def test_general_function_of_time_and_index(log_of):
    (channel,) = log_of(uff_ascii(X, function=0)).channels
    assert channel.raster.sample_rate_hz == 8192.0
    (channel,) = log_of(uff_ascii(X, abscissa=(0, "Index", "NONE"), step="1.00000e+00")).channels
    assert channel.raster.sample_rate_hz is None and "an index, not a time" in channel.flags[0]
    (channel,) = log_of(uff_ascii(X, abscissa=(17, "Time", "ms"), step="5.00000e-01")).channels
    assert channel.raster.sample_rate_hz == 2000.0


@pytest.mark.parametrize(
    ("closing", "flagged"),
    [
        (b"    -1\r\n", False),
        (b"    -1", False),
        (b"\n    -1\n", False),
        (b"\r\n\r\n    -1" + b" " * 74 + b"\r\n", False),
        (b"", True),
        (b"\n", True),
        (b"\x00\x00\x01garbage\n    -1\n", True),
    ],
)
def test_malformed_endings_of_binary_records(log_of, closing, flagged):
    blob = uff_binary(X, closing=closing, entity="a") + uff_binary(X[:77], entity="b")
    log = log_of(blob)
    assert [c.raster.n_samples for c in log.channels] == [1003, 77]
    assert np.array_equal(values(log), X.astype("f4"))
    assert np.array_equal(values(log, 1), X[:77].astype("f4"))
    assert bool(log.channels[0].flags) == flagged


def test_minus_one_inside_binary_data_is_no_ending(log_of):
    x = np.frombuffer(b"\n    -1\n" * 50, "<f4").astype(np.float64)
    log = log_of(uff_binary(x, entity="a") + uff_binary(x, entity="b"))
    assert np.array_equal(values(log), x) and len(log.channels) == 2


def test_single_precision_that_is_double(log_of):
    """pyuff 2.5.8 writes float64 behind a header that says float32 (its issue 91)."""
    log = log_of(uff_binary(X, "<f8", data_type=2, binary=4 * len(X)))
    assert np.array_equal(values(log), X)
    assert "read as double precision" in log.channels[0].flags[0]


def test_wrong_byte_counts(log_of):
    log = log_of(uff_binary(X, "<f8", data_type=2))
    assert np.array_equal(values(log), X) and "8 are taken" in log.channels[0].flags[0]
    log = log_of(uff_binary(X, binary=0))
    assert np.array_equal(values(log), X.astype("f4")) and "claims 0 bytes" in log.channels[0].flags[0]
    with pytest.raises(FormatError, match="claims 1003 values, but 400 bytes"):
        log_of(uff_binary(X, binary=400))
    with pytest.raises(FormatError, match="byte order"):
        log_of(uff_binary(X, order=7))


@pytest.mark.parametrize("make", [uff_ascii, uff_binary])
@pytest.mark.parametrize("cut", [10, 300, 800, 1500, 3000, 4300])
def test_truncation_names_the_record(log_of, make, cut):
    whole = make(X, entity="first")
    blob = whole + make(X, entity="second")[:cut]
    with pytest.raises(FormatError, match="truncated"):
        log_of(blob)


@pytest.mark.parametrize("n_claimed", [1004, 1009, 5000])
def test_a_record_that_claims_more_than_it_holds(log_of, n_claimed):
    for blob in (uff_ascii(X, entity="one"), uff_ascii(X, entity="one") + uff_ascii(X, entity="two")):
        wrong = blob.replace(f"{2:10d}{1003:10d}".encode(), f"{2:10d}{n_claimed:10d}".encode(), 1)
        with pytest.raises(FormatError, match=rf"record 1 \('one'\) claims {n_claimed} values, the file holds 1003"):
            log_of(wrong)


def test_a_record_that_holds_more_than_it_claims(log_of):
    wrong = uff_ascii(X).replace(f"{2:10d}{1003:10d}".encode(), f"{2:10d}{1000:10d}".encode())
    with pytest.raises(FormatError, match="claims 1000 values, but 1003"):
        log_of(wrong)


def test_damaged_values_and_headers(log_of):
    blob = uff_ascii(X)
    at = len(blob) // 2 // 79 * 79 + 30
    log = log_of(blob[:at] + b"xx" + blob[at + 2 :])
    with pytest.raises(FormatError, match="no number"):
        values(log)
    with pytest.raises(FormatError, match="header of record 1 is damaged"):
        log_of(blob.replace(b"     1003", b"    1o03", 1).replace(b"    1o03", b"     1o03", 1))


def test_no_data_set_58(log_of):
    with pytest.raises(FormatError, match="no data set 58"):
        log_of(b"    -1\n   151\nmodel\n    -1\n")


@pytest.mark.parametrize("columns_of", ["bytes", "characters"])
@pytest.mark.parametrize("filled", [67, 80])
def test_a_unit_behind_a_label_in_utf_8(log_of, columns_of, filled):
    blob = uff_binary(X, ordinate=(12, "Beschl", b"mm/s2"))
    label, unit = "Größe in µm", "µm/s²"
    if columns_of == "bytes":
        fields = label.encode().ljust(20) + b" " + unit.encode().ljust(20)
        line = (f"{12:10d}{0:5d}{0:5d}{0:5d} ".encode() + fields).ljust(filled)
    else:
        line = f"{12:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}".ljust(filled).encode()
    lines = blob.split(b"\n", 12)
    lines[10] = line
    (channel,) = log_of(b"\n".join(lines)).channels
    assert channel.unit == unit


def test_a_name_that_is_longer_than_its_field_moves_the_node(log_of):
    log = log_of(uff_ascii(X[:9], entity="PF-I-0301y+", node=17) + uff_ascii(X[:9], entity="PF-I-0301y+", node=18))
    assert [channel.name for channel in log.channels] == ["PF-I-0301y+:17:", "PF-I-0301y+:18:"]


@pytest.mark.parametrize("closing", [b"    -1\n", b"\n    -1\n", b"\r\n    -1\r\n"])
@pytest.mark.parametrize("dtype", ["<f4", ">f8"])
def test_binary_records_as_pyuff_reads_them(log_of, tmp_path, closing, dtype, conformance):
    log = log_of(uff_binary(X, dtype, closing=closing))
    theirs = pyuff.UFF(str(tmp_path / "log.uff")).read_sets()["data"][: len(X)]
    what = f"UFF 58b of {dtype}, closed with {closing!r}: largest difference"
    conformance(what, 0.0, float(np.abs(values(log) - theirs).max()), 0.0, "1", "program: pyuff")


def test_more_records_than_a_process_may_open_files(log_of):
    log = log_of(b"".join(uff_binary(X[:5], entity=f"c{i}") for i in range(1500)))
    (block,) = log.reader.blocks(range(1500), 0, 5, 100)
    assert block.shape == (1500, 5) and np.array_equal(block[1499], X[:5].astype("<f4"))


@pytest.mark.parametrize(("kind", "exponents", "flagged"), [(11, (0, 0), True), (1, (1, 0), True), (1, (0, 0), False)])
def test_units_of_data_set_164_by_the_exponents_of_the_ordinate(log_of, kind, exponents, flagged):
    factors = "".join(f"{factor:25.17E}" for factor in (1000.0, 1000.0, 1.0))
    units = f"    -1\n   164\n         5mm (milli newton)            2\n{factors}\n    -1\n".encode()
    blob = uff_binary(X, ordinate=(kind, "v", b"m/s"))
    lines = blob.split(b"\n", 12)
    lines[10] = lines[10][:10] + f"{exponents[0]:5d}{exponents[1]:5d}".encode() + lines[10][20:]
    (channel,) = log_of(units + b"\n".join(lines)).channels
    assert channel.unit == "m/s" and bool(channel.flags) == flagged
