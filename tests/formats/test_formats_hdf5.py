"""HDF5: the documented layout, foreign files, trust, truncation."""

import os
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest
from faults_hdf5 import foreign_filter

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan


@pytest.fixture
def path(tmp_path):
    return tmp_path / "log.h5"


def values(log, column=0):
    n = log.channels[column].raster.n_samples
    return np.concatenate([block[0] for block in log.reader.blocks([column], 0, n, 333)])


def by_name(log):
    return {channel.name: channel for channel in log.channels}


def test_our_layout(path):
    stored = np.array([-32768, 0, 1, 32767], dtype=np.int16)
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        file.attrs["start_time"] = "2026-03-01T10:00:00+01:00"
        dataset = file.create_dataset("axle 1/motor_z", data=stored)
        dataset.attrs.update(sample_rate_hz=51200.0, unit="m/s^2", scale=0.01, offset=-1.0, start_s=0.5)
        tacho = file.create_dataset("tacho", data=np.zeros(7))
        tacho.attrs.update(sample_rate_hz=102400, unit="V", quantity="tacho", description="60 pulses")
    log = scan(path)
    motor, pulses = by_name(log)["axle 1/motor_z"], by_name(log)["tacho"]
    assert log.start_time == "2026-03-01T10:00:00+01:00"
    assert (motor.unit, motor.quantity, motor.full_scale) == ("m/s^2", "acceleration", None)
    assert (motor.raster.sample_rate_hz, motor.raster.start_s) == (51200.0, 0.5)
    assert motor.limits == pytest.approx((-32768 * 0.01 - 1, 32767 * 0.01 - 1))
    assert (pulses.quantity, pulses.raster.n_samples, pulses.limits) == ("tacho", 7, None)
    column = [c.name for c in log.channels].index("axle 1/motor_z")
    np.testing.assert_allclose(values(log, column), stored * 0.01 - 1.0)
    with pytest.raises(FormatError, match="the file holds 4"):
        list(log.reader.blocks([0, 1], 0, 7, 10))


@pytest.mark.parametrize("dtype", ["i1", "<i2", ">i2", "i4", "i8", "u2", "f4", ">f8", "f2"])
def test_number_types(path, dtype):
    stored = np.arange(100).astype(dtype)
    with h5py.File(path, "w") as file:
        file["x"] = stored
    (channel,) = scan(path).channels
    assert np.array_equal(values(scan(path)), stored.astype(np.float64))
    if np.dtype(dtype).kind == "f":
        assert (channel.full_scale, channel.limits) == (None, None)
    else:
        info = np.iinfo(dtype)
        assert channel.full_scale == 2.0 ** (info.bits - 1)
        assert channel.limits == (float(info.min), float(info.max))
    assert channel.raster.sample_rate_hz is None


def test_integers_with_unit_but_no_scale_are_in_the_unit(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.arange(5, dtype="i2")).attrs["units"] = np.bytes_(b"Pa")
    (channel,) = scan(path).channels
    assert (channel.unit, channel.full_scale, channel.limits) == ("Pa", None, (-32768.0, 32767.0))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sample_rate_hz", 8192.0),
        ("Sampling Rate", "8192 Hz"),
        ("sampling_frequency", np.array([8192])),
        ("sample_freq", 8192),
        ("fs", np.float32(8192)),
        ("samplerate", b"8192"),
        ("dt", 1 / 8192),
        ("wf_increment", 0.0001220703125),
    ],
)
@pytest.mark.parametrize("place", ["a/b/x", "a/b", "/"])
def test_rates_under_the_usual_names(path, name, value, place):
    with h5py.File(path, "w") as file:
        file["a/b/x"] = np.zeros(10)
        file[place].attrs[name] = value
    assert scan(path).channels[0].raster.sample_rate_hz == 8192.0


@pytest.mark.parametrize("value", ["fast", np.zeros(3), float("nan"), h5py.Empty("f8")])
def test_a_rate_that_is_none_is_not_taken(path, value):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.zeros(10)).attrs["fs"] = value
    assert scan(path).channels[0].raster.sample_rate_hz is None


def test_a_negative_rate_is_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.zeros(10)).attrs["fs"] = -1.0
    with pytest.raises(FormatError, match=r"dataset 'x': sample_rate_hz must be > 0"):
        scan(path)


@pytest.mark.parametrize("options", [{}, {"chunks": (7, 1)}, {"chunks": True, "compression": "gzip", "shuffle": True}])
@pytest.mark.parametrize("transposed", [False, True])
def test_two_dimensions(path, options, transposed):
    x = np.random.default_rng(0).normal(size=(500, 3))
    if transposed and "chunks" in options and options["chunks"] is not True:
        options = {"chunks": (1, 7)}
    with h5py.File(path, "w") as file:
        file.create_dataset("g/x", data=x.T if transposed else x, **options)
    log = scan(path)
    assert [c.name for c in log.channels] == ["g/x[1]", "g/x[2]", "g/x[3]"]
    blocks = list(log.reader.blocks([2, 0], 11, 490, 100))
    assert np.array_equal(np.concatenate(blocks, axis=1), x[11:490, [2, 0]].T)


def test_an_attribute_names_the_time_axis(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.arange(6.0).reshape(2, 3)).attrs["time_axis"] = 0
        file["square"] = np.zeros((4, 4))
    log = scan(path)
    assert by_name(log)["x[3]"].raster.n_samples == 2
    assert "time is taken along the first axis" in by_name(log)["square[1]"].flags[0]


def test_a_time_vector_gives_the_rate_and_is_no_channel(path):
    with h5py.File(path, "w") as file:
        file["run/time"] = 2.0 + np.arange(5000) / 51200
        file["run/mic"] = np.zeros(5000)
        file["run/other"] = np.zeros(40)
        file["time"] = np.arange(3.0)
    log = scan(path)
    channels = by_name(log)
    assert set(channels) == {"run/mic", "run/other", "time"}
    assert channels["run/mic"].raster.sample_rate_hz == 51200.0
    assert channels["run/mic"].raster.start_s == 2.0
    assert channels["run/other"].raster.sample_rate_hz is None


@pytest.mark.parametrize("gap_at", [3, 2500, 4990])
def test_what_is_over_a_time_vector_with_a_gap_is_left_out(path, gap_at):
    t = np.arange(5000) / 51200
    t[gap_at:] += 3 / 51200
    with h5py.File(path, "w") as file:
        file["t"], file["mic"], file["both"], file["longer"] = t, np.zeros(5000), np.zeros((2, 5000)), np.zeros(5001)
    log = scan(path)
    assert list(by_name(log)) == ["longer"]
    (flag,) = log.flags
    assert "2 skipped" in flag and "'t' is called a time but is not equidistant" in flag and "both, mic" in flag


def test_contradicting_rates_are_flagged(path):
    with h5py.File(path, "w") as file:
        file["t"], file["mic"] = np.arange(100) / 1000, np.zeros(100)
        file["mic"].attrs["fs"] = 2000
    (channel,) = scan(path).channels
    assert channel.raster.sample_rate_hz == 2000
    assert "'t' says 1000 Hz" in channel.flags[0]


def test_what_is_no_channel_is_skipped_and_flagged(path):
    with h5py.File(path, "w") as file:
        file["x"] = np.zeros(10)
        file["text"] = "hello"
        file["texts"] = ["a", "b"]
        file["state"] = np.zeros(10, h5py.enum_dtype({"OFF": 0, "ON": 1, "FAULT": 2}, "i1"))
        file["compound"] = np.zeros(10, dtype=[("a", "f8"), ("b", "i4")])
        file["complex"] = np.zeros(10, complex)
        file["scalar"] = 3.0
        file["cube"] = np.zeros((3, 4, 5))
        file["empty"] = np.zeros(0)
        file["refs"] = np.array([file["x"].ref], dtype=h5py.ref_dtype)
    log = scan(path)
    assert [c.name for c in log.channels] == ["x"]
    text = " ".join(log.flags)
    assert all(name in text for name in ("text", "state", "compound", "complex", "scalar", "cube", "empty", "refs"))


def test_nothing_outside_the_file_is_read(path, tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["x"] = np.ones(10)
    (tmp_path / "secret.bin").write_bytes(np.ones(10).tobytes())
    with h5py.File(path, "w") as file:
        file["own"] = np.zeros(10)
        file["ext"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/x")
        file["soft"] = h5py.SoftLink("/own")
        file["dangling"] = h5py.SoftLink("/none")
        layout = h5py.VirtualLayout(shape=(10,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "secret.h5"), "x", shape=(10,))
        file.create_virtual_dataset("virtual", layout)
        file.create_dataset("raw", (10,), "f8", external=[(str(tmp_path / "secret.bin"), 0, 80)])
    log = scan(path)
    assert [c.name for c in log.channels] == ["own"]
    text = " ".join(log.flags)
    assert all(name in text for name in ("ext", "soft", "dangling", "virtual", "raw"))


def test_loops_of_groups_end(path):
    with h5py.File(path, "w") as file:
        file["a/x"] = np.zeros(10)
        file["a/up"] = file["/"]
        file["a/again"] = file["a/x"]
    log = scan(path)
    assert len(log.channels) == 1
    assert any("second names" in flag for flag in log.flags)


def test_what_was_never_written_is_flagged(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("all", (100,), "f8")
        file.create_dataset("part", (100,), "f8", chunks=(10,))[:35] = 1.0
    channels = by_name(scan(path))
    assert "never written" in channels["all"].flags[0]
    assert "6 of 10 chunks were never written" in channels["part"].flags[0]


@pytest.mark.parametrize("fraction", [0.05, 0.3, 0.7, 0.99])
def test_truncated(path, fraction):
    with h5py.File(path, "w") as file:
        file["x"] = np.random.default_rng(0).normal(size=10_000)
    blob = path.read_bytes()
    path.write_bytes(blob[: int(len(blob) * fraction)])
    with pytest.raises(FormatError, match=r"log\.h5: truncated HDF5 file"):
        scan(path)


def test_damaged_chunk(path):
    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("x", data=np.random.default_rng(0).normal(size=5000), compression="gzip")
        offset = dataset.id.get_chunk_info(0).byte_offset
    blob = bytearray(path.read_bytes())
    blob[offset : offset + 200] = b"\xff" * 200
    path.write_bytes(blob)
    with pytest.raises(FormatError, match="damaged HDF5"):
        values(scan(path))


def test_no_channels(path):
    with h5py.File(path, "w") as file:
        file["text"] = "hello"
    with pytest.raises(FormatError, match="no numeric dataset"):
        scan(path)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("told", ["HDF5_PLUGIN_PATH", "nothing"])
def test_no_program_is_loaded_from_a_folder_of_plugins(tmp_path, told):
    """A filter with the number 32015 lies where HDF5 looks for it, and leaves a mark when it is loaded."""
    source = tmp_path / "filter.c"
    source.write_text(
        "#include <stdio.h>\n#include <stdlib.h>\n__attribute__((constructor)) static void loaded(void)\n"
        '{ FILE *mark = fopen(getenv("MARK"), "w"); if (mark) fclose(mark); }\n'
        "int H5PLget_plugin_type(void) { return 0; }\nconst void *H5PLget_plugin_info(void) { return 0; }\n"
    )
    plugins = tmp_path / "plugins"
    plugins.mkdir()
    subprocess.run(["cc", "-shared", "-fPIC", "-o", plugins / "libfilter.so", source], check=True)
    log = foreign_filter(tmp_path)
    environment = {**os.environ, "HDF5_PLUGIN_PATH": str(plugins), "MARK": str(tmp_path / "mark")}
    code = (
        "import h5py, sys\nwith h5py.File(sys.argv[1]) as f:\n    try: f['packed'][:]\n    except OSError: pass\n"
        if told == "nothing"
        else "import sys\nfrom tdacoustic.formats import scan\nlog = scan(sys.argv[1])\n"
        "assert [c.name for c in log.channels] == ['mic'], log\n"
        "list(log.reader.blocks([0], 0, 600, 100))\n"
    )
    subprocess.run([sys.executable, "-c", code, str(log)], env=environment, check=True)
    assert (tmp_path / "mark").exists() == (told == "nothing")  # without us it is loaded: the test can fail
