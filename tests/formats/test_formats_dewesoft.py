"""Dewesoft: the reader against a stand-in for the library's Python side; the real one meets `faults_dewesoft`."""

import os
import pickle
import re
import sys
import tempfile
import time
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from dewesoft_stand_in import install, write

from tdacoustic.errors import FormatError, MissingPackageError
from tdacoustic.formats import scan
from tdacoustic.formats.dewesoft import reader

N = 5000
MOTOR = {"name": "motor", "unit": "m/s2", "rate": 51200.0, "number_of_samples": N, "start": 0.25, "gain": 2.0}
MIC = {"name": "mic", "unit": "Pa", "rate": 25600.0, "number_of_samples": N // 2}


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch)
    return tmp_path / "a.dxd"


def read(log, columns, start=0, stop=N, block=1000):
    return np.concatenate(list(log.reader.blocks(columns, start, stop, block)), axis=1)


def test_channels_rates_units_and_starts(stand_in):
    days = 46_000.5
    log = scan(write(stand_in, [MOTOR, MIC], start=days))
    motor, mic = log.channels
    assert (motor.name, motor.unit, motor.quantity) == ("motor", "m/s2", "acceleration")
    assert (motor.raster.sample_rate_hz, motor.raster.n_samples, motor.raster.start_s) == (51200.0, N, 0.25)
    assert (mic.raster.sample_rate_hz, mic.raster.n_samples, mic.quantity) == (25600.0, N // 2, "sound_pressure")
    assert datetime.fromisoformat(log.start_time) == datetime(1899, 12, 30, tzinfo=UTC) + timedelta(days)
    assert log.flags == (reader.UNVERIFIED,)


@pytest.mark.parametrize(("start", "stop", "block"), [(0, N, 1000), (0, N, 7 * N), (17, 18, 5), (1234, 4321, 999)])
def test_samples_are_those_asked_for_in_the_order_asked(stand_in, start, stop, block):
    other = {**MOTOR, "name": "other", "gain": 1.0}
    log = pickle.loads(pickle.dumps(scan(write(stand_in, [MOTOR, other]))))
    wanted = np.sin(0.01 * np.arange(start, stop))
    assert np.array_equal(read(log, [1, 0], start, stop, block), [wanted, 2 * wanted])


def test_steps_begin_at_the_sample_they_should(stand_in, monkeypatch):
    """The library cuts time * rate to a whole number: 0.29 * 100 would be 28."""
    monkeypatch.setattr(reader, "STEP_VALUES", 1)
    log = scan(write(stand_in, [{**MIC, "rate": 100.0, "number_of_samples": 300}]))
    assert np.array_equal(read(log, [0], 0, 300)[0], np.sin(0.01 * np.arange(300)))


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ({"array_size": 30}, "they are arrays: 'x'"),
        ({"channel_type": 1}, "they are asynchronous"),
        ({"channel_type": 2}, "they are single values"),
        ({"kind": "complex"}, "they are complex"),
        ({"kind": "binary"}, "no numeric type"),
        ({"number_of_samples": 0}, "they hold no samples"),
        ({"fault": "refused"}, "cannot be read by the maker's library .*CAN channel"),
        ({"rate": -1.0}, "a sampling rate of -1.0 Hz"),
        ({"rate": float("nan")}, "a sampling rate of nan"),
    ],
)
def test_what_cannot_be_a_channel_is_left_out(stand_in, channel, words):
    odd = {"name": "x", "rate": 100.0, "number_of_samples": 50, **channel}
    log = scan(write(stand_in, [odd, MOTOR]))
    assert [found.name for found in log.channels] == ["motor"]
    assert any(re.search(words, flag) for flag in log.flags), log.flags
    assert np.array_equal(read(log, [0]), [2 * np.sin(0.01 * np.arange(N))])
    with pytest.raises(FormatError, match="no channel in it that can be read"):
        scan(write(stand_in, [odd]))


def test_storing_on_a_trigger_is_flagged(stand_in):
    assert any("not stored at full rate" in flag for flag in scan(write(stand_in, [MOTOR], storing=2)).flags)


def test_no_start_is_no_date(stand_in):
    assert scan(write(stand_in, [MOTOR])).start_time is None


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ({"fault": "crash"}, "library crashed .exit status"),
        ({"fault": "short"}, "999 came|samples from .* on were asked for"),
        ({"fault": "gap"}, "not evenly sampled: sample 2501 is at"),
    ],
)
def test_what_goes_wrong_while_reading_is_one_clear_error(stand_in, monkeypatch, channel, words):
    monkeypatch.setattr(reader, "STEP_VALUES", 1000)
    log = scan(write(stand_in, [{**MOTOR, **channel}]))
    with pytest.raises(FormatError, match=words):
        read(log, [0])


@pytest.mark.skipif(os.name == "nt", reason="Windows bounds no memory here")
def test_its_memory_is_bounded(stand_in, monkeypatch):
    monkeypatch.setattr(reader, "MOST_BYTES", 2_000_000_000)
    with pytest.raises(FormatError, match="library refuses it"):
        read(scan(write(stand_in, [{**MOTOR, "fault": "memory"}])), [0])


def test_a_crash_and_a_hang_while_opening_are_answered(stand_in, monkeypatch):
    with pytest.raises(FormatError, match="library crashed"):
        scan(write(stand_in, [], fault="crash"))
    monkeypatch.setattr(reader, "MOST_S", 3.0)
    begin = time.monotonic()
    with pytest.raises(FormatError, match="more than 3 s and was ended"):
        scan(write(stand_in, [], fault="hang"))
    assert time.monotonic() - begin < 20.0


def test_a_file_that_changed_after_the_scan_is_noticed(stand_in):
    log = scan(write(stand_in, [MOTOR]))
    write(stand_in, [{**MOTOR, "number_of_samples": N + 1}])
    with pytest.raises(FormatError, match="holds 5001 samples, it held 5000"):
        read(log, [0])
    stand_in.write_bytes(stand_in.read_bytes()[:80])
    with pytest.raises(FormatError, match="refuses it: File is corrupted"):
        read(log, [0])


@pytest.mark.parametrize(("start", "stop", "block"), [(0, N + 1, 100), (-1, 5, 100), (5, 4, 1), (0, 5, 0)])
def test_reading_outside_the_log_is_refused(stand_in, start, stop, block):
    with pytest.raises(FormatError, match=r"a\.dxd"):
        list(scan(write(stand_in, [MOTOR])).reader.blocks([0], start, stop, block))


def test_a_reader_left_early_leaves_nothing_behind(stand_in, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    blocks = scan(write(stand_in, [MOTOR])).reader.blocks([0], 0, N, 10)
    next(blocks)
    assert list((tmp_path / "temporary").iterdir())
    blocks.close()
    assert not list((tmp_path / "temporary").iterdir())


def test_what_the_child_sends_is_not_believed(stand_in, monkeypatch):
    write(stand_in, [MOTOR])
    begin = "import sys, os; send = lambda b: os.write(1, b); "
    for code, words in [
        ("send(b'J' + b'\\xff' * 8)", "crashed"),
        ("send(b'S' + bytes(8))", "0 bytes that were not asked for"),
        ("send(b'J' + (2).to_bytes(8, 'little') + b'{}')", "makes no sense"),
        ("send(b'J' + (4).to_bytes(8, 'little') + b'[[[[')", "makes no sense"),
    ]:
        monkeypatch.setattr(reader, "_CODE", begin + code)
        with pytest.raises(FormatError, match=words):
            scan(stand_in)


def test_without_the_package_its_name_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(reader, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=r"dwdatareader.*tdacoustic\[dewesoft\]"):
        scan(write(tmp_path / "a.dxd", [MOTOR]))


def test_on_a_platform_without_the_library_it_is_said(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch)
    source = tmp_path / "stand_in" / "dwdatareader" / "__init__.py"
    source.write_text("raise NotImplementedError('Unsupported platform: Plan9 64bit')")
    with pytest.raises(MissingPackageError, match=r"not there .for this platform: Unsupported platform: Plan9"):
        scan(write(tmp_path / "a.dxd", [MOTOR]))


def test_the_library_is_never_loaded_here():
    assert "dwdatareader" not in sys.modules
