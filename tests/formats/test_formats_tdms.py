"""TDMS: the real DAQmx log, layouts, scalings, rasters, names; npTDMS is the oracle throughout."""

import shutil
import time

import numpy as np
import pytest
from makers_tdms import DAQMX, NONE, SAME, daqmx, linear, plain, segment, text, two, wave

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan
from tdacoustic.formats.tdms.layouts import RAW
from tdacoustic.formats.tdms.paths import split_path
from tdacoustic.formats.tdms.scalings import ScalingError, limits_of, read_scaling

SECOND = 3564686121  # 2016-12-15 22:35:21 UTC
X = np.round(1000.0 * np.random.default_rng(7).normal(size=(2, 40)))


def read(log, column=0, block=333):
    n = log.channels[column].raster.n_samples
    return np.concatenate([b[0] for b in log.reader.blocks([column], 0, n, block)])


def by_name(log):
    return {channel.name: channel for channel in log.channels}


def written(tmp_path, *parts, name="a.tdms"):
    path = tmp_path / name
    path.write_bytes(b"".join(parts))
    return path


def by_nptdms(path):
    from nptdms import TdmsFile

    file = TdmsFile.read(path)
    return {channel.name: channel.data for group in file.groups() for channel in group.channels()}


def f8(values):
    return np.asarray(values, dtype="<f8").tobytes()


# the real recording


def test_the_real_daqmx_log(recordings):
    log = scan(recordings / "nptdms_daqmx" / "raw1.tdms")
    assert [channel.name for channel in log.channels][:2] == ["First  Channel", "Second Chan"]
    assert len(log.channels) == 7 and log.flags == ()
    assert log.start_time == "2016-12-15T22:35:21+00:00"
    assert {(c.raster.sample_rate_hz, c.raster.n_samples, c.raster.start_s, c.unit) for c in log.channels} == {
        (50000.0, 2000, 0.0, "Volts")  # the file's starts differ by 2849 ticks of 2**-64 s: one raster all the same
    }
    slope = 0.0003051850947599719  # NI_Scale[1]_Linear_Slope: 10 V / 32767
    assert log.channels[0].limits == pytest.approx((-32768 * slope, 32767 * slope), rel=1e-15)
    assert log.metadata == (("name", "Raw Layer_00001"),)


def test_the_real_log_is_read_as_npTDMS_reads_it_and_as_its_bytes_say(recordings, conformance):
    path = recordings / "nptdms_daqmx" / "raw1.tdms"
    log = scan(path)
    values = np.concatenate(list(log.reader.blocks(range(7), 0, 2000, 333)), axis=1)
    for row, (name, wanted) in enumerate(by_nptdms(path).items()):
        assert log.channels[row].name == name
        apart = float(np.abs(values[row] - wanted).max())
        conformance(f"DAQmx log raw1.tdms, {name}: largest difference", 0.0, apart, 0.0, "V", "program: npTDMS")
    counts = np.frombuffer(path.read_bytes()[4737 : 4737 + 28000], "<i2").reshape(
        2000, 7
    )  # the one segment with values
    assert np.array_equal(values, counts.T * 0.0003051850947599719)


# layouts, by a random walk over what the format allows


def random_log(rng):
    """A valid file: contiguous, interleaved or DAQmx, in chunks, with lists reused, in both byte orders."""
    kinds = ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f8"]
    types = [str(rng.choice(kinds)) for _ in range(rng.integers(1, 5))]
    layout = rng.choice(["contiguous", "interleaved", "daqmx"])
    parts, previous = [], None
    for _ in range(rng.integers(2, 9)):
        chunks = int(rng.integers(1, 4))
        if previous is not None and rng.random() < 0.4:
            objects, size, order = previous
            body = rng.bytes(size * chunks)
            if rng.random() < 0.5:
                parts.append(segment([], body, metadata=False, order=order, interleaved=layout == "interleaved"))
            else:
                same = [(path, SAME, {}) for path, _, _ in objects]
                again = bool(rng.integers(2))
                parts.append(segment(same, body, new_list=again, order=order, interleaved=layout == "interleaved"))
            continue
        order = "<>"[rng.integers(2)]
        present = [n for n in range(len(types)) if rng.random() < 0.8] or [0]
        n = int(rng.integers(1, 40))
        sizes = [int(types[k][1:]) for k in present]
        if layout == "daqmx":
            at = np.cumsum([0, *sizes])
            objects = [
                (f"/'g'/'c{k}'", daqmx(n, [(types[k], 0, int(at[i]), 0)], [int(at[-1])], order), linear(0.5, k))
                for i, k in enumerate(present)
            ]
            size = n * int(at[-1])
        else:
            lengths = [n if layout == "interleaved" else n + i for i in range(len(present))]
            objects = [
                (f"/'g'/'c{k}'", plain(types[k], length, order=order), {})
                for k, length in zip(present, lengths, strict=True)
            ]
            size = sum(length * width for length, width in zip(lengths, sizes, strict=True))
        parts.append(segment(objects, rng.bytes(size * chunks), order=order, interleaved=layout == "interleaved"))
        previous = (objects, size, order)
    return parts


@pytest.mark.parametrize("seed", range(60))
def test_any_layout_is_read_as_npTDMS_reads_it(tmp_path, seed):
    rng = np.random.default_rng(seed)
    path = written(tmp_path, *random_log(rng))
    log, wanted = scan(path), by_nptdms(path)
    for column, channel in enumerate(log.channels):
        whole = np.asarray(wanted[channel.name], dtype=np.float64)
        assert channel.raster.n_samples == len(whole)
        assert np.array_equal(read(log, column, int(rng.integers(1, 60))), whole, equal_nan=True)
        start = int(rng.integers(0, len(whole)))
        stop = int(rng.integers(start + 1, len(whole) + 1))
        parts = list(log.reader.blocks([column], start, stop, 17))
        assert np.array_equal(np.concatenate(parts, axis=1)[0], whole[start:stop], equal_nan=True)
    missing = set(wanted) - {channel.name for channel in log.channels}
    assert len(missing) == sum(flag.count("'g/") - flag.count("values of 'g/") for flag in log.flags)


def test_a_digital_line_is_a_bit(tmp_path):
    stored = np.random.default_rng(0).integers(0, 256, size=40, dtype=np.uint8)
    objects = [
        (f"/'g'/'line{bit}'", daqmx(40, [("u1", 0, bit, 0)], [1], code=5, line=True), wave("V")) for bit in (0, 5)
    ]
    log = scan(written(tmp_path, segment(objects, stored.tobytes(), flags=DAQMX)))
    assert np.array_equal(read(log, 0), stored & 1)
    assert np.array_equal(read(log, 1), stored >> 5 & 1)
    assert log.channels[0].limits is None


@pytest.mark.parametrize(("kind", "sign"), [("Add", 1.0), ("Subtract", -1.0)])
def test_several_stored_numbers_of_one_channel_are_added_or_subtracted(tmp_path, kind, sign):
    rows = np.zeros(40, dtype=[("coarse", "<i2"), ("fine", "<i4")])
    rows["coarse"], rows["fine"] = X[0], X[1]
    described = {
        **linear(10.0, index=2, source=0, count=5),
        **linear(0.001, index=3, source=1, count=5),
        "NI_Scale[4]_Scale_Type": kind,
        f"NI_Scale[4]_{kind}_Left_Operand_Input_Source": 2,
        f"NI_Scale[4]_{kind}_Right_Operand_Input_Source": 3,
    }
    index = daqmx(40, [("i2", 0, 0, 0), ("i4", 0, 2, 1)], [6])
    path = written(tmp_path, segment([("/'g'/'a'", index, {**wave(), **described})], rows.tobytes()))
    assert np.array_equal(read(scan(path)), by_nptdms(path)["a"])
    np.testing.assert_allclose(read(scan(path)), sign * 10.0 * X[0] + 0.001 * X[1], rtol=1e-12)  # right less left


def test_one_of_many_interleaved_channels_is_read_in_any_stretch(tmp_path):
    stored = np.random.default_rng(1).integers(-30000, 30000, size=(5000, 64)).astype("<i2")
    objects = [(f"/'g'/'c{k}'", plain("i2", 5000), {}) for k in range(64)]
    log = scan(written(tmp_path, segment(objects, stored.tobytes(), interleaved=True)))
    assert np.array_equal(np.concatenate(list(log.reader.blocks([63], 17, 4999, 100)), axis=1)[0], stored[17:4999, 63])
    assert np.array_equal(np.concatenate(list(log.reader.blocks([5, 2], 0, 5000, 999)), axis=1), stored[:, [5, 2]].T)


# scalings


def scales(kind, **numbers):
    numbers = {"Input_Source": RAW, **numbers}
    return {
        "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": kind,
        **{
            f"NI_Scale[0]_{kind}_{name.replace('__', '[') + (']' if '__' in name else '')}": v
            for name, v in numbers.items()
        },
    }


RTD = {"Current_Excitation": 1e-3, "R0_Nominal_Resistance": 100.0, "A": 3.9083e-3, "B": -5.775e-7, "C": -4.183e-12}
STRAIN = {
    "Poisson_Ratio": 0.3,
    "Gage_Resistance": 350.0,
    "Lead_Wire_Resistance": 0.5,
    "Initial_Bridge_Voltage": 1e-4,
    "Gage_Factor": 2.1,
    "Bridge_Shunt_Calibration_Gain_Adjustment": 1.01,
    "Voltage_Excitation": 2.5,
}
THERMISTOR = {
    "Excitation_Type": 10322,
    "Excitation_Value": 2.5,
    "Resistance_Configuration": 3,
    "R1_Reference_Resistance": 5000.0,
    "Lead_Wire_Resistance": 1.0,
    "A": 1.2873851e-3,
    "B": 2.3575235e-4,
    "C": 9.4978060e-8,
    "Temperature_Offset": 273.15,
}
SENSORS = [
    scales("Linear", Slope=0.3, Y_Intercept=-2.0),
    scales("Polynomial", Coefficients_Size=3, Coefficients__0=0.1, Coefficients__1=2.0, Coefficients__2=-0.5),
    scales("Polynomial", Coefficients__0=0.1, Coefficients__1=2.0, Coefficients__2=-0.5, Coefficients__3=0.01),
    scales(
        "Table",
        Pre_Scaled_Values_Size=3,
        Scaled_Values_Size=3,
        **{f"Pre_Scaled_Values__{k}": v for k, v in enumerate((0.3, 0.1, 0.0))},
        **{f"Scaled_Values__{k}": v for k, v in enumerate((7.0, 3.0, 4.0))},
    ),
    scales("AdvancedAPI"),
    *(scales("RTD", Lead_Wire_Resistance=0.2, Resistance_Configuration=wires, **RTD) for wires in (2, 3, 4)),
    *(scales("Strain", Configuration=bridge, **STRAIN) for bridge in (10183, 10184, 10185, 10188, 10189, 10271, 10272)),
    scales("Thermistor", **THERMISTOR),
    scales("Thermocouple", Thermocouple_Type=10073, Scaling_Direction=0),
    scales("Thermocouple", Thermocouple_Type=10047, Scaling_Direction=1),
]


@pytest.mark.filterwarnings("ignore:'where' used without 'out'")  # npTDMS, of the RTD
@pytest.mark.parametrize("properties", SENSORS, ids=lambda p: p["NI_Scale[0]_Scale_Type"])
def test_scalings_are_those_of_npTDMS(tmp_path, properties, request, conformance):
    volts = np.linspace(0.021, 0.3, 40)
    path = written(tmp_path, segment([("/'g'/'a'", plain("f8", 40), {**wave("V"), **properties})], f8(volts)))
    wanted = by_nptdms(path)["a"]
    assert np.isfinite(wanted).all() and np.ptp(wanted) > 0
    # the RTD's quartic is solved to 1e-12 K of 200 K by both
    apart = float(np.max(np.abs(read(scan(path)) - wanted) / (10.0 + np.abs(wanted))))
    what = f"scaling {request.node.callspec.id}, largest difference over 10 + the value"
    conformance(what, 0.0, apart, 1e-12, "1", "program: npTDMS")


def test_a_platinum_thermometer_by_the_standard(conformance):
    """IEC 60751, Pt100: -100 degrees C are 60.26 ohm, 0 are 100, 100 are 138.51 (rounded to 0.01 ohm there)."""
    scaling = read_scaling(
        [scales("RTD", Lead_Wire_Resistance=0.0, Resistance_Configuration=4, **RTD)], frozenset([RAW])
    )
    celsius = scaling.apply({RAW: np.array([60.26, 100.0, 138.51, np.nan, -1e9]) * 1e-3})
    for ohm, printed, got in zip((60.26, 100.0, 138.51), (-100.0, 0.0, 100.0), celsius[:3], strict=True):
        # 0.005 ohm are 0.013 K
        conformance(f"Pt100 of {ohm:g} ohm", printed, got, 0.015, "°C", "standard: IEC 60751, table of the Pt100")
    assert np.isnan(celsius[3:]).all()


def test_two_scales_in_a_row_and_one_of_the_group(tmp_path):
    properties = {**linear(0.5, 1.0, index=1, source=0, count=3), **linear(-4.0, index=2, source=1, count=3)}
    counts = np.arange(-20, 20, dtype="<i2")
    objects = [("/'g'", NONE, properties), ("/'g'/'a'", daqmx(40, [("i2", 0, 0, 0)], [2]), wave("Pa"))]
    path = written(tmp_path, segment(objects, counts.tobytes()))
    log = scan(path)
    assert np.array_equal(read(log), (counts * 0.5 + 1.0) * -4.0)
    assert np.array_equal(read(log), by_nptdms(path)["a"])
    assert log.channels[0].limits == ((32767 * 0.5 + 1.0) * -4.0, (-32768 * 0.5 + 1.0) * -4.0)


def test_values_already_scaled_are_not_scaled_again(tmp_path):
    properties = {**wave("Pa"), **linear(2.0, index=0, source=RAW, count=1), "NI_Scaling_Status": "scaled"}
    log = scan(written(tmp_path, segment([("/'g'/'a'", plain("f8", 40), properties)], f8(X[0]))))
    assert np.array_equal(read(log), X[0])


def test_single_precision_is_scaled_in_double(tmp_path):
    stored = np.array([1.0, 16777216.0, 3.3], "<f4")
    properties = {**wave("Pa"), **linear(1.0 / 3.0, 0.1, index=0, source=RAW, count=1)}
    log = scan(written(tmp_path, segment([("/'g'/'a'", plain("f4", 3), properties)], stored.tobytes())))
    assert np.array_equal(read(log), stored.astype(np.float64) * (1.0 / 3.0) + 0.1)


def test_limits_of_a_scaling_that_turns_back_are_not_known():
    bent = read_scaling([scales("Polynomial", Coefficients_Size=3, Coefficients__0=0.0, Coefficients__1=0.0,
                                Coefficients__2=1.0)], frozenset([RAW]))  # fmt: skip
    assert limits_of(bent, "<i2") is None
    assert limits_of(None, "<i2") == (-32768.0, 32767.0)


def test_a_bridge_that_is_not_known_is_said():
    with pytest.raises(ScalingError, match=r"Strain scaling cannot be used .*9999"):
        read_scaling([scales("Strain", Configuration=9999, **STRAIN)], frozenset([RAW]))


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "u1", "u2", "i8", "f4", "f8"])
def test_number_types(tmp_path, dtype):
    stored = np.arange(100).astype("<" + dtype)
    log = scan(written(tmp_path, segment([("/'g'/'a'", plain(dtype, 100), {})], stored.tobytes())))
    (channel,) = log.channels
    assert np.array_equal(read(log), stored.astype(np.float64))
    assert channel.raster.sample_rate_hz is None
    assert [("offset binary" in flag) for flag in channel.flags] == [True] * (dtype[0] == "u")
    if dtype[0] == "f":
        assert (channel.full_scale, channel.limits) == (None, None)
    else:
        info = np.iinfo(dtype)
        assert (channel.full_scale, channel.limits) == (2.0 ** (info.bits - 1), (float(info.min), float(info.max)))


def test_a_tdm_header_is_answered_with_the_way_out(tmp_path):
    path = written(
        tmp_path, b'<?xml version="1.0"?><usi:tdm xmlns:usi="http://www.ni.com/Schemas/USI/1_0">', name="a.tdm"
    )
    with pytest.raises(FormatError, match="TDMS"):
        scan(path)


# rasters, starts, names


def test_several_rates_and_starts(tmp_path):
    half = 1 << 63
    objects = [
        ("/'g'/'a'", plain("f8", 40), wave("Pa", 51200.0, wf_start_time=(SECOND, half))),
        ("/'g'/'b'", plain("f8", 10), wave("V", 100.0, wf_start_time=(SECOND, 0), wf_start_offset=0.25)),
        ("/'g'/'c'", plain("f8", 10), wave("V", 100.0)),
    ]
    log = scan(written(tmp_path, segment(objects, bytes(480))))
    rasters = {name: channel.raster for name, channel in by_name(log).items()}
    assert log.start_time == "2016-12-15T22:35:21.250000+00:00"
    assert (rasters["a"].sample_rate_hz, rasters["a"].start_s) == (51200.0, 0.25)
    assert (rasters["b"].sample_rate_hz, rasters["b"].start_s, rasters["b"].n_samples) == (100.0, 0.0, 10)
    assert "states no start time and others do" in by_name(log)["c"].flags[0]


def test_the_first_start_time_counts_and_a_later_one_that_fits_is_no_gap(tmp_path):
    parts = [
        segment([("/'g'/'a'", plain("f8", 40), wave("Pa", 40.0, wf_start_time=(SECOND + k, 1000 * k)))], f8(X[0]))
        for k in range(5)
    ]
    log = scan(written(tmp_path, *parts))
    assert log.start_time == "2016-12-15T22:35:21+00:00"
    assert log.channels[0].raster.n_samples == 200 and log.channels[0].flags == ()


def test_a_start_that_is_set_with_the_values_replaces_an_unset_one(tmp_path):
    path = written(
        tmp_path,
        segment([("/'g'/'a'", NONE, {"wf_start_time": (0, 0), **wave()})]),
        segment([("/'g'/'a'", plain("f8", 40), {"wf_start_time": (SECOND, 0)})], f8(X[0])),
    )
    assert scan(path).start_time == "2016-12-15T22:35:21+00:00" and scan(path).flags == ()


def test_channels_written_one_after_the_other_begin_together(tmp_path):
    parts = [segment([(f"/'g'/'{name}'", plain("f8", 40), wave())], f8(X[0])) for name in ("a", "b", "a", "b", "a")]
    log = scan(written(tmp_path, *parts))
    assert [c.raster.n_samples for c in log.channels] == [120, 80]
    assert "where the others are missing the file does not say" in log.channels[1].flags[0]


def test_a_later_channel_with_a_start_time_is_kept(tmp_path):
    objects, values = two(X, wf_start_time=(SECOND, 0))
    late = ("/'log'/'late'", plain("f8", 40), wave("Pa", wf_start_time=(SECOND + 2, 0)))
    log = scan(written(tmp_path, segment(objects, values), segment([*objects, late], values + f8(X[0]))))
    assert by_name(log)["late"].raster.start_s == 2.0 and log.flags == ()


@pytest.mark.parametrize("time", [("when", "time", 16), ("Time", "f8", 8)])
def test_a_column_of_instants_beside_channels_without_a_rate_is_said(tmp_path, time):
    name, dtype, width = time
    objects = [("/'g'/'a'", plain("f8", 4), {}), (f"/'g'/'{name}'", plain(dtype, 4), {})]
    objects.append(("/'g'/'timed'", plain("f8", 4), wave()))
    log = scan(written(tmp_path, segment(objects, bytes(64 + 4 * width))))
    assert f"no rate is given, and 'g/{name}' may hold its instants" in by_name(log)["a"].flags[0]
    assert by_name(log)["timed"].flags == ()


@pytest.mark.parametrize("unit", ["unit_string", "NI_UnitDescription"])
def test_units(tmp_path, unit):
    objects = [("/'g'/'a'", plain("f8", 1), {unit: "m/s²"}), ("/'g'/'b'", plain("f8", 1), {unit: ""})]
    objects.append(("/'g'/'c'", plain("f8", 1), {unit: "m/s²".encode("latin-1")}))  # of an older program
    log = scan(written(tmp_path, segment(objects, bytes(24))))
    assert [(c.unit, c.quantity) for c in log.channels] == [
        ("m/s²", "acceleration"),
        (None, None),
        ("m/s²", "acceleration"),
    ]


def test_names(tmp_path):
    paths = ["/'it''s'/'x'", "/'b'/'x'", "/'b'/'y/z'", "/'b'/''", "/'b/y'/'z'"]
    log = scan(written(tmp_path, segment([(path, plain("f8", 1), {}) for path in paths], bytes(40))))
    assert [c.name for c in log.channels] == ["it's/x", "b/x", "y/z", "b/", "z"]


@pytest.mark.parametrize("path", ["x", "/x", "/'a", "/'a'x", "'a'/'b'", "//'a'"])
def test_paths_that_are_none(path):
    with pytest.raises(ValueError, match="not of the form"):
        split_path(path)


def test_a_name_of_several_lines_stays_on_one_in_messages(tmp_path):
    path = written(tmp_path, segment([("/'g'/'two\nlines'", plain("text", 1, 6), {})], b"\2\0\0\0ab"))
    with pytest.raises(FormatError, match=r"two\\nlines") as caught:
        scan(path)
    assert "\n" not in str(caught.value)


# the file itself


def test_an_index_is_answered_with_the_log_beside_it(tmp_path):
    one = segment(*two(X))
    written(tmp_path, one)
    index = written(tmp_path, b"TDSh" + one[4:], name="a.tdms_index")
    with pytest.raises(FormatError, match=r"without its values: open 'a\.tdms', which lies beside"):
        scan(index)


def test_an_index_beside_a_log_is_not_believed(tmp_path):
    path = written(tmp_path, segment(*two(X)))
    written(tmp_path, b"TDSh" + segment(*two(X[:, :7]))[4:], name="a.tdms_index")
    assert scan(path).channels[0].raster.n_samples == 40


def test_a_file_that_became_shorter(tmp_path):
    path = written(tmp_path, segment(*two(X)))
    log = scan(path)
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(FormatError, match="had 863 when it was scanned"):
        read(log)


def test_values_are_found_where_a_file_is_copied_to(tmp_path):
    (tmp_path / "b").mkdir()
    shutil.copy(written(tmp_path, segment(*two(X))), tmp_path / "b" / "odd name.TDMS")
    assert np.array_equal(read(scan(tmp_path / "b" / "odd name.TDMS"), 1), X[1])


def test_very_many_small_segments_are_scanned_quickly(tmp_path):
    """30 000 segments of which each states a new start time: 0.3 s here, bound for a busy machine ten times that."""
    head = segment([("/'g'/'a'", plain("f8", 10), wave("Pa", 10.0, wf_start_time=(SECOND, 0)))], bytes(80))
    at = head.index(text("wf_start_time")) + 17 + 4 + 8
    parts = [head[:at] + (SECOND + k).to_bytes(8, "little") + head[at + 8 :] for k in range(30_000)]
    path = written(tmp_path, *parts)
    begin = time.perf_counter()
    log = scan(path)
    assert time.perf_counter() - begin < 3.0
    assert log.channels[0].raster.n_samples == 300_000 and log.channels[0].flags == ()
    assert len(log.reader.reader.tracks[0].positions) == 1  # one run: read in long stretches


def test_a_list_that_grows_with_every_segment_is_bounded(tmp_path):
    many = [(f"/'g'/'{k}'", plain("i1", 1), {}) for k in range(2000)]
    grow = [segment([(f"/'g'/'x{k}'", plain("i1", 1), {})], bytes(2001 + k), new_list=False) for k in range(400)]
    with pytest.raises(FormatError, match="the list of channels changes too often"):
        scan(written(tmp_path, segment(many, bytes(2000)), *grow))


def test_a_number_of_properties_beyond_reason_is_refused(tmp_path):
    blob = segment([("/'g'/'a'", plain("f8", 1), {"x": 1})], bytes(8))
    at = blob.index(text("x")) - 4
    with pytest.raises(FormatError, match="'g/a' lists 4294967295 properties; at most"):
        scan(written(tmp_path, blob[:at] + b"\xff" * 4 + blob[at + 4 :]))
