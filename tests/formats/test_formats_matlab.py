"""MAT-files against scipy.io.loadmat, real files of MATLAB and of a test rig; rates, units, what unpacking costs."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
from faults_matlab import PACKED_LONG, of_pulse, of_testlab
from log_makers import RATE_HZ
from makers_matlab import (
    cell,
    level4_matrix,
    level5,
    level73,
    matlab_dataset,
    matlab_struct,
    matlab_text,
    numbers,
    packed,
    structure,
    text,
)

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan
from tdacoustic.formats.matlab import storage

OF_MATLAB = sorted((Path(scipy.io.matlab.__file__).parent / "tests" / "data").glob("*.mat"))
X = np.sin(np.arange(500) / 7.0)


def read(log, name):
    names = [channel.name for channel in log.channels]
    n = log.channels[names.index(name)].raster.n_samples
    return np.concatenate(list(log.reader.blocks([names.index(name)], 0, n, 100)), axis=1)[0]


def write(folder, *variables, **options):
    (folder / "a.mat").write_bytes(level5(*variables, **options))
    return scan(folder / "a.mat")


def channel(log, name):
    return next(channel for channel in log.channels if channel.name == name)


def expected_channels(variables, prefix=""):
    """Channels as loadmat's arrays have them: real, numeric, of at least two values and at most two dimensions."""
    found = {}
    for name, value in variables.items():
        path = f"{prefix}{name}"
        if name.startswith("__"):
            continue
        if isinstance(value, scipy.io.matlab.mat_struct):
            found |= expected_channels({field: getattr(value, field) for field in value._fieldnames}, f"{path}.")
        elif not isinstance(value, np.ndarray):
            continue
        elif value.dtype == object:
            if value.size == 1 and isinstance(value.flat[0], scipy.io.matlab.mat_struct):
                found |= expected_channels({name: value.flat[0]}, prefix)
        elif value.dtype.kind in "iufb" and value.ndim == 2 and value.size > 1 and min(value.shape) <= 1024:
            columns = value.T if value.shape[0] >= value.shape[1] else value
            found |= (
                {path: columns[0]}
                if len(columns) == 1
                else {f"{path}[{index + 1}]": column for index, column in enumerate(columns)}
            )
    return found


def assert_is_loadmat(path):
    wanted = expected_channels(scipy.io.loadmat(path, struct_as_record=False))
    if not wanted:
        with pytest.raises(FormatError, match="no array that could be a channel"):
            scan(path)
        return
    log = scan(path)
    assert sorted(channel.name for channel in log.channels) == sorted(wanted)
    for name, values in wanted.items():
        np.testing.assert_array_equal(read(log, name), values.astype(np.float64))


@pytest.mark.parametrize("path", OF_MATLAB, ids=lambda path: path.stem)
def test_files_that_matlab_wrote_are_read_as_loadmat_reads_them(path):
    """MATLAB 4.2 to 8 on five machines, both byte orders; the files of scipy's own tests."""
    if path.stem == "testhdf5_7.4_GLNX86":
        pytest.skip("level 7.3, which loadmat does not read: the next test")
    try:
        scipy.io.loadmat(path, struct_as_record=False)
    except Exception:
        with pytest.raises(FormatError, match=path.name):
            log = scan(path)
            [read(log, channel.name) for channel in log.channels]
        return
    if path.stem == "nasty_duplicate_fieldnames":  # loadmat calls its second fields _1_...
        assert len(scan(path).channels) > 5
        return
    assert_is_loadmat(path)


def test_a_level_73_file_that_matlab_wrote():
    """Its variables are those of scipy's other test files: 0:pi/4:2*pi, matrices, cells, texts, structures."""
    path = next((path for path in OF_MATLAB if path.stem == "testhdf5_7.4_GLNX86"), None)
    if path is None:
        pytest.skip("scipy is installed without its tests' files")
    log = scan(path)
    assert log.format == "matlab"
    np.testing.assert_array_equal(read(log, "testdouble"), np.arange(9) * np.pi / 4)


def test_the_bearing_of_a_test_rig(recordings, conformance):
    path = recordings / "mfpt_bearing" / "OuterRaceFault_vload_7.mat"
    log = scan(path)
    assert [channel.name for channel in log.channels] == ["bearing.gs"]
    assert log.channels[0].raster.sample_rate_hz == 48828.0
    assert log.channels[0].raster.n_samples == 146484
    assert log.flags == () and log.channels[0].flags == () and log.start_time is None
    assert dict(log.metadata)["sampling rate"] == "48828 Hz, from 'bearing.sr'"
    assert dict(log.metadata)["bearing.rate"] == "25" and dict(log.metadata)["bearing.load"] == "300"
    gs = scipy.io.loadmat(path)["bearing"][0, 0]["gs"]
    apart = float(np.abs(read(log, "bearing.gs") - gs[:, 0]).max())
    conformance("OuterRaceFault_vload_7.mat, largest difference", 0.0, apart, 0.0, "g", "program: scipy.io.loadmat")


@pytest.mark.parametrize("seed", range(8))
def test_trees_of_any_type_are_read_as_loadmat_reads_them(tmp_path, seed):
    rng = np.random.default_rng(seed)
    types = ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4"]

    def tree(depth):
        fields = {}
        for index in range(int(rng.integers(2, 5))):
            shape = [(1, 1), (1, 40), (37, 1), (50, 3), (2, 60), (8, 8)][int(rng.integers(0, 6))]
            fields[f"v{index}"] = (rng.normal(size=shape) * 100).astype(types[int(rng.integers(0, 8))])
        if depth:
            fields |= {"deeper": tree(depth - 1), "words": "sixty"}
        return fields

    path = tmp_path / "a.mat"
    scipy.io.savemat(path, tree(3), do_compression=bool(seed % 2), long_field_names=bool(seed % 3), oned_as="column")
    assert_is_loadmat(path)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("small", [True, False])
@pytest.mark.parametrize(("class_", "stored"), [("f8", "u1"), ("f8", "i2"), ("f8", "f4"), ("i4", "i1"), ("f4", "u2")])
def test_numbers_stored_in_a_smaller_type(tmp_path, order, small, class_, stored):
    """Three values of one byte are a small data element; seven end before their padding."""
    short, long = [[1, 2, 3]], [[7, 6, 5, 4, 3, 2, 1]]
    path = tmp_path / "a.mat"
    for pack in (lambda variable, order: variable, packed):
        blob = [
            pack(numbers(name, v, class_, stored, order, small=small), order)
            for name, v in (("a", short), ("bc", long))
        ]
        path.write_bytes(level5(*blob, order=order))
        assert_is_loadmat(path)
        log = scan(path)
        assert log.channels[0].limits == ((-(2.0**31), 2.0**31 - 1) if class_ == "i4" else None)
        assert log.channels[0].full_scale == (2.0**31 if class_ == "i4" else None)


@pytest.mark.parametrize(
    ("name", "value"),
    [(name, RATE_HZ) for name in ("fs", "Fs", "FS", "sr", "fsamp", "SampleRate", "sampling_rate", "samplingFrequency")]
    + [(name, 1.0 / RATE_HZ) for name in ("dt", "Ts", "deltaT", "increment", "sample_time", "x.increment")],
)
def test_a_rate_beside_the_array(tmp_path, name, value):
    owner, _, field = name.rpartition(".")
    rate = numbers(field, [[value]])
    log = write(tmp_path, numbers("a", X), structure(owner, {field: numbers("", [[value]])}) if owner else rate)
    assert log.channels[0].raster.sample_rate_hz == RATE_HZ
    assert log.channels[0].flags == () and [channel.name for channel in log.channels] == ["a"]
    assert dict(log.metadata)["sampling rate"] == f"8192 Hz, from {name!r}"


def test_a_rate_as_text(tmp_path):
    assert write(tmp_path, numbers("a", X), text("fs", "51200 Hz")).channels[0].raster.sample_rate_hz == 51200.0


@pytest.mark.parametrize("name", ["rate", "n", "f", "speed", "T", "order", "fs_khz"])
def test_names_that_say_no_rate(tmp_path, name):
    assert write(tmp_path, numbers("a", X), numbers(name, [[100.0]])).channels[0].raster.sample_rate_hz is None


def test_the_nearest_structure_says_the_rate(tmp_path):
    slow = structure("slow", {"a": numbers("", X), "fs": numbers("", [[100.0]])})
    fast = structure("fast", {"inner": structure("", {"b": numbers("", X)})})
    log = write(tmp_path, slow, fast, numbers("fs", [[5000.0]]), numbers("c", X))
    rates = {channel.name: channel.raster.sample_rate_hz for channel in log.channels}
    assert rates == {"slow.a": 100.0, "fast.inner.b": 5000.0, "c": 5000.0}


@pytest.mark.parametrize("class_", ["f8", "f4"])
def test_a_time_vector(tmp_path, class_):
    t = 2.5 + np.arange(500) / 512.0
    log = write(tmp_path, numbers("t", t[:, None], class_), numbers("a", np.array([X, -X]).T), numbers("b", X[:99]))
    assert [channel.name for channel in log.channels] == ["a[1]", "a[2]", "b"]
    raster = log.channels[1].raster
    assert (raster.sample_rate_hz, raster.start_s, raster.n_samples) == (512.0, 2.5, 500)
    assert log.channels[2].raster.sample_rate_hz is None


def test_a_time_vector_that_agrees_with_the_rate(tmp_path):
    log = write(tmp_path, numbers("time", np.arange(500) / 512.0), numbers("a", X), numbers("fs", [[512.0]]))
    assert [channel.name for channel in log.channels] == ["a"]
    assert log.channels[0].raster.sample_rate_hz == 512.0 and log.channels[0].flags == ()


def test_a_rate_is_snapped(tmp_path):
    raster = write(tmp_path, numbers("a", X), numbers("dt", [[1.953125e-05 * (1 + 2e-6)]])).channels[0].raster
    assert raster.sample_rate_hz == 51200.0
    assert raster.sample_rate_raw_hz == pytest.approx(51200.0 / (1 + 2e-6), rel=1e-12)


def test_integers_have_limits_and_a_full_scale_where_no_unit_is_known(tmp_path):
    with_unit = structure("s", {"a": numbers("", [[1, -2, 3]], "i2"), "unit": text("", "Pa")})
    log = write(tmp_path, numbers("x", [[1, -2, 3]], "i2"), with_unit)
    assert channel(log, "x").full_scale == 32768.0 and channel(log, "x").limits == (-32768.0, 32767.0)
    found = channel(log, "s.a")
    assert (found.unit, found.quantity, found.full_scale) == ("Pa", "sound_pressure", None)
    assert found.limits == (-32768.0, 32767.0)


def test_a_unit_beside_several_arrays_is_not_taken(tmp_path):
    log = write(tmp_path, structure("s", {"a": numbers("", X), "b": numbers("", X), "unit": text("", "Pa")}))
    assert [channel.unit for channel in log.channels] == [None, None]


def test_testlab(tmp_path):
    log = write(tmp_path, of_testlab())
    first = channel(log, "3:Point1")
    assert (first.unit, first.quantity) == ("g", "acceleration")
    assert (first.raster.sample_rate_hz, first.raster.start_s) == (1000.0, 0.5)
    assert dict(log.metadata)["sampling rate"] == "1000 Hz, from 'Signal.x_values.increment'"
    stored = np.sin(np.arange(300) / 7.0) + 0.1
    np.testing.assert_allclose(read(log, "3:Point1") * 9.80665, stored, rtol=1e-14)
    assert write(tmp_path, of_testlab("Pa", 1.0)).channels[0].quantity == "sound_pressure"
    assert write(tmp_path, of_testlab("furlong", 0.5)).channels[0].unit == "furlong"


def test_testlab_without_names(tmp_path):
    names = [channel.name for channel in write(tmp_path, of_testlab(names=("one",))).channels]
    assert names == ["Signal[1]", "Signal[2]"]


def test_pulse(tmp_path):
    log = write(tmp_path, *of_pulse("65536"))
    assert [(channel.name, channel.unit) for channel in log.channels] == [("Mic", "Pa"), ("Motor", "Pa")]
    assert {channel.raster.sample_rate_hz for channel in log.channels} == {65536.0}
    assert dict(log.metadata)["Channel_1_Header.SignalName"] == "Mic"


def test_lists_of_texts_are_shown(tmp_path):
    log = write(tmp_path, numbers("a", X), cell("labels", [text("", "motor"), text("", "gear")]))
    assert dict(log.metadata)["labels"] == "motor, gear" and log.flags == ()


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("stored", range(6))
def test_level_4_of_every_type(tmp_path, order, stored):
    values = np.array([[1, 2, 3, 200], [5, 6, 7, 8], [4, 3, 2, 1]])
    path = tmp_path / "a.mat"
    path.write_bytes(level4_matrix("fs", [[100.0]], order=order) + level4_matrix("v", values, stored, order))
    log = scan(path)
    assert [channel.raster.sample_rate_hz for channel in log.channels] == [100.0] * 3
    for row, wanted in enumerate(values):
        np.testing.assert_array_equal(read(log, f"v[{row + 1}]"), wanted)
    np.testing.assert_array_equal(scipy.io.loadmat(path)["v"], values)


def test_level_73_has_its_dimensions_the_other_way_round(tmp_path):
    tall = np.arange(60.0).reshape(20, 3)

    def fill(file):
        outer = matlab_struct(file, "run")
        matlab_dataset(outer, "tall", tall, chunks=(2, 7), compression="gzip", shuffle=True)
        matlab_dataset(outer, "wide", -tall.T)
        matlab_dataset(outer, "counts", np.arange(9, dtype="i2")[None], "int16")
        matlab_dataset(outer, "on", np.array([[0, 1, 1]], "u1"), "logical")
        matlab_dataset(matlab_struct(outer, "x"), "increment", [[0.5]])
        matlab_text(outer, "place", "Köln")

    log = scan(level73(tmp_path / "a.mat", fill))
    assert log.format == "matlab"
    for column in range(3):
        np.testing.assert_array_equal(read(log, f"run.tall[{column + 1}]"), tall[:, column])
        np.testing.assert_array_equal(read(log, f"run.wide[{column + 1}]"), -tall[:, column])
    np.testing.assert_array_equal(read(log, "run.counts"), np.arange(9))
    assert channel(log, "run.counts").limits == (-32768.0, 32767.0)
    assert channel(log, "run.on").flags == ("logical values: 0 and 1",)
    assert {channel.raster.sample_rate_hz for channel in log.channels} == {2.0}
    assert dict(log.metadata)["run.place"] == "Köln"
    assert log.flags == ()


def test_hdf5_without_matlabs_header_is_hdf5(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["x"] = X
    log = scan(tmp_path / "a.mat")
    assert log.format == "hdf5" and "the suffix is .mat" in log.flags[0]


@pytest.fixture
def unpacked(monkeypatch):
    """Counts the bytes that are unpacked; nothing is known of any file at the start."""
    storage._KNOWN.clear()
    count = [0]
    piece = storage._Unpacking.piece

    def counted(self, most):
        data = piece(self, most)
        count[0] += len(data)
        return data

    monkeypatch.setattr(storage._Unpacking, "piece", counted)
    return count


N_LONG = 1_000_000


@pytest.fixture(scope="module")
def long_file(tmp_path_factory):
    values = (np.arange(8 * N_LONG) % 997).reshape(8, N_LONG).T.astype("f8")
    path = tmp_path_factory.mktemp("packed") / "long.mat"
    path.write_bytes(level5(packed(numbers("x", values), level=1), packed(numbers("fs", [[100.0]]))))
    return path, values


def test_scanning_a_packed_matrix_unpacks_its_head(long_file, unpacked):
    log = scan(long_file[0])
    assert len(log.channels) == 8 and unpacked[0] < 10_000


def test_what_reading_columns_of_a_packed_matrix_costs(long_file, unpacked):
    """All columns: one unpacking to find their places, one to read them. Later readings begin near their place."""
    path, values = long_file
    log = scan(path)
    order = [5, 0, 7, 1, 2, 6, 4, 3]
    unpacked[0] = 0
    at = 0
    for block in log.reader.blocks(order, 0, N_LONG, 100_000):
        np.testing.assert_array_equal(block, values[at : at + block.shape[1], order].T)
        at += block.shape[1]
    assert at == N_LONG
    assert unpacked[0] < 2.3 * values.nbytes
    unpacked[0] = 0
    part = np.concatenate(list(log.reader.blocks([7, 3], 900_000, 900_100, 64)), axis=1)
    np.testing.assert_array_equal(part, values[900_000:900_100, [7, 3]].T)
    assert unpacked[0] < 2 * (storage.SPACING + storage.PIECE_BYTES)


def test_damage_behind_what_is_read_is_noticed_once(tmp_path, unpacked):
    flipped = bytearray(PACKED_LONG)
    flipped[-2] ^= 1
    path = tmp_path / "a.mat"
    path.write_bytes(level5(bytes(flipped)))
    log = scan(path)
    with pytest.raises(
        FormatError, match=r"a\.mat: variable 'x': its packed data are damaged \(incorrect data check\)"
    ):
        list(log.reader.blocks([0], 0, 1000, 100))
    path.write_bytes(level5(PACKED_LONG))
    log = scan(path)
    for _ in range(3):
        list(log.reader.blocks([0], 0, 1000, 100))
    assert unpacked[0] < 3 * 200_000 * 8


def test_the_states_of_unpacking_that_are_kept_are_few(long_file, monkeypatch):
    storage._KNOWN.clear()
    monkeypatch.setattr(storage, "SPACING", 1 << 16)
    monkeypatch.setattr(storage, "MAX_STATES", 50)
    log = scan(long_file[0])
    list(log.reader.blocks(range(8), 0, N_LONG, 100_000))
    assert 10 < sum(len(known.states) for known in storage._KNOWN.values()) <= 50


def test_a_structure_that_unpacks_to_more_than_recordings_do(tmp_path, monkeypatch):
    from tdacoustic.formats.matlab import level5 as walker

    monkeypatch.setattr(walker, "UNPACKED_ALWAYS", 1 << 20)
    bomb = structure("s", {"a": numbers("", np.zeros((1, 1_000_000))), "fs": numbers("", [[1.0]])})
    with pytest.raises(FormatError, match="made to exhaust the memory"):
        write(tmp_path, packed(bomb))


def test_memory_of_a_claim(tmp_path):
    """A header's claim costs nothing before it is held against the file."""
    import tracemalloc

    (tmp_path / "a.mat").write_bytes(level5(numbers("x", [[1, 2]], shape=(2**30, 1))))
    tracemalloc.start()
    with pytest.raises(FormatError, match="claims 1073741824 x 1 values of 8 bytes, it holds 16 bytes"):
        scan(tmp_path / "a.mat")
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()


def test_metadata_are_bounded(tmp_path):
    variables = [numbers(f"n{index}", [[float(index)]]) for index in range(300)]
    log = write(tmp_path, *variables, numbers("a", X))
    assert len(log.metadata) < 100


def test_the_text_and_the_number_of_a_level_73_file_that_would_cost_much_are_not_read(tmp_path):
    """A chunk is unpacked whole: one of 64 MB for one number is left alone."""

    def fill(file):
        matlab_dataset(file, "a", X[:, None])
        matlab_dataset(file, "fs", [[7.0]], maxshape=(None, None), chunks=(2**13, 2**10), compression="gzip")

    log = scan(level73(tmp_path / "a.mat", fill))
    assert log.channels[0].raster.sample_rate_hz is None
    assert any("fs" in flag for flag in log.flags)


def test_more_variables_than_are_read(tmp_path, monkeypatch):
    from tdacoustic.formats.matlab import level5 as walker

    monkeypatch.setattr(walker, "MAX_ELEMENTS", 50)
    log = write(tmp_path, *[numbers(f"x{index}", X[:5]) for index in range(100)])
    assert len(log.channels) == 49 and "more than 50 elements: the rest is not read" in log.flags
