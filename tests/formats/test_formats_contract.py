"""The one test that every format must pass."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
from log_makers import RATE_HZ, N, all_makers

from tdacoustic.errors import FormatError, MissingFileError
from tdacoustic.formats import FORMATS, scan


@pytest.fixture(params=all_makers(), ids=lambda maker: maker.__name__)
def made(request, tmp_path):
    return request.param(tmp_path)


def read(log, columns, start=0, stop=N, block=1 << 20):
    return np.concatenate(list(log.reader.blocks(columns, start, stop, block)), axis=1)


def test_scan_says_what_is_in_the_log(made):
    log = scan(made.path)
    assert log.path == made.path
    assert log.format in {row.name for row in FORMATS}
    assert sorted(channel.name for channel in log.channels) == sorted(made.names)
    for channel in log.channels:
        assert channel.raster.sample_rate_hz == RATE_HZ
        assert channel.raster.n_samples == N
        assert channel.flags == ()
        assert (channel.unit is None) == (channel.quantity is None)
    assert log.flags == ()


def test_values_are_those_written(made):
    log = scan(made.path)
    values = read(log, range(2))
    assert values.dtype == np.float64 and values.shape == (2, N)
    order = [made.names.index(channel.name) for channel in log.channels]
    np.testing.assert_allclose(values, made.values[order], rtol=0, atol=made.tolerance)
    rms = values.std(axis=1)
    assert (rms > 0.1).all() and (rms < 0.5).all()


@pytest.mark.parametrize("block", [1, 7, 256, N - 1, N, 10 * N])
def test_blocks_make_up_the_whole(made, block):
    log = scan(made.path)
    whole = read(log, [0, 1])
    blocks = list(log.reader.blocks([0, 1], 0, N, block))
    assert all(part.shape == (2, block) for part in blocks[:-1])
    assert 1 <= blocks[-1].shape[1] <= block
    assert np.array_equal(np.concatenate(blocks, axis=1), whole)


@pytest.mark.parametrize(("start", "stop"), [(0, 1), (5, 6), (100, 613), (N - 1, N), (17, 17)])
def test_a_cut_is_a_slice_of_the_whole(made, start, stop):
    log = scan(made.path)
    whole = read(log, [0, 1])
    parts = list(log.reader.blocks([0, 1], start, stop, 100))
    if start == stop:
        assert parts == []
    else:
        assert np.array_equal(np.concatenate(parts, axis=1), whole[:, start:stop])


def test_columns_come_in_the_order_asked(made):
    log = scan(made.path)
    whole = read(log, [0, 1])
    assert np.array_equal(read(log, [1, 0, 1]), whole[[1, 0, 1]])
    assert np.array_equal(read(log, [1]), whole[[1]])


def test_a_log_can_be_pickled(made):
    log = pickle.loads(pickle.dumps(scan(made.path)))
    assert np.array_equal(read(log, [0]), read(scan(made.path), [0]))


@pytest.mark.parametrize(
    ("start", "stop", "block"), [(0, N + 1, 100), (N, N + 5, 100), (-1, 5, 100), (5, 4, 1), (0, 5, 0)]
)
def test_reading_outside_the_log_is_refused(made, start, stop, block):
    with pytest.raises(FormatError, match=made.path.name):
        list(scan(made.path).reader.blocks([0], start, stop, block))


def test_a_file_cut_after_the_scan_is_noticed(made):
    log = scan(made.path)
    blob = made.path.read_bytes()
    made.path.write_bytes(blob[: len(blob) // 3])
    with pytest.raises(FormatError):
        list(log.reader.blocks([0, 1], 0, N, 100))


@pytest.mark.parametrize("fraction", np.linspace(0.02, 0.97, 13))
def test_a_truncated_file_never_gives_fewer_samples_silently(made, fraction):
    blob = made.path.read_bytes()
    made.path.write_bytes(blob[: int(len(blob) * fraction)])
    try:
        log = scan(made.path)
        samples = [read(log, [column], 0, channel.raster.n_samples) for column, channel in enumerate(log.channels)]
    except FormatError as error:
        assert made.path.name in str(error)
        return
    # (a universal file cut exactly between two records is whole in itself: no such cut is among these)
    # a text may end anywhere: nothing in it says how long it was; but it is then flagged, unless cut at a line's end
    assert log.format == "delimited"
    assert all(values.shape[1] < N for values in samples)
    assert log.flags or made.path.suffix == ".tsv" or made.path.read_bytes().endswith(b"\n")


def test_missing_and_foreign_files(tmp_path):
    with pytest.raises(MissingFileError, match="no such file"):
        scan(tmp_path / "none.wav")
    (tmp_path / "a.wav").write_bytes(b"")
    with pytest.raises(FormatError, match="empty"):
        scan(tmp_path / "a.wav")
    (tmp_path / "a.uff").write_bytes(b"hello\nworld\n")
    with pytest.raises(FormatError, match="no UFF"):
        scan(tmp_path / "a.uff")
    (tmp_path / "a.xyz").write_bytes(b"\x01\x02\x03\x04")
    with pytest.raises(FormatError, match="not known"):
        scan(tmp_path / "a.xyz")


def test_content_decides_over_the_suffix(made):
    other = made.path.with_suffix(".dat")
    other.write_bytes(made.path.read_bytes())
    if scan(made.path).format == "delimited":
        with pytest.raises(FormatError, match="not known"):
            scan(other)
    else:
        assert "the suffix is .dat" in scan(other).flags[0]


def test_importing_the_table_is_light():
    code = "import sys, tdacoustic.formats; print({'pandas', 'h5py', 'soundfile', 'pyuff'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"


@pytest.mark.parametrize("seed", range(4))
def test_flipped_bits_end_in_a_log_or_in_one_clear_error(made, seed):
    if made.path.name == "a.h5":
        pytest.skip("libhdf5 itself loops for ever over a damaged heap of texts (its H5HG code)")
    rng = np.random.default_rng(seed)
    blob = bytearray(made.path.read_bytes())
    for _ in range(25):
        spoiled = bytearray(blob)
        spoiled[int(rng.integers(0, min(4096, len(blob))))] ^= 1 << int(rng.integers(0, 8))
        made.path.write_bytes(spoiled)
        try:
            log = scan(made.path)
            for column, channel in enumerate(log.channels):
                read(log, [column], 0, channel.raster.n_samples)
        except FormatError as error:
            assert made.path.name in str(error)
