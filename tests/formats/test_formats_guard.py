"""The process that looks at HDF5 files first: what the library does to it must not be done to us."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan
from tdacoustic.formats.hdf5 import guard
from tdacoustic.isolation import PYTHON

ROOT = Path(__file__).resolve().parents[2]
POSIX = pytest.mark.skipif(os.name != "posix", reason="signals")

HANGS = [(2105, 0), (2232, 6), (2256, 5), (2297, 2)]
"""Byte and bit of `whole_log` with which libhdf5 2.0 (h5py 3.16) runs for ever."""

ENDS = [(849, 2), (1049, 3), (1761, 1)]
"""Byte and bit with which it ends the process."""

SPIN = "import collections, itertools\ndef scan(path):\n    collections.deque(itertools.repeat(0), maxlen=0)\n"
"""Holds the interpreter for ever, as a library does that runs for ever."""

OTHER_SCAN = "from tdacoustic.formats.hdf5 import child; child.SCANS['hdf5'] = ('other_scan', 'scan'); child.serve()"


@pytest.fixture(autouse=True)
def child(monkeypatch):
    """A guard of the test's own, with little patience."""
    made = guard._Child()
    monkeypatch.setattr(guard, "_CHILD", made)
    monkeypatch.setattr(guard, "MOST_S", 1.0)
    monkeypatch.setenv(guard.FOUND_GOOD, "")
    yield made
    made.end()


@pytest.fixture
def whole_log(tmp_path):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name in ("mic", "acc", "gyro"):
            dataset = file.create_dataset(name, data=np.arange(8.0), track_times=False)
            dataset.attrs["unit"] = "Pa"
            dataset.attrs["sample_rate_hz"] = 1000.0
            dataset.attrs["description"] = "a text of some length"
    return path


def stand_in(monkeypatch, tmp_path, source):
    """Let the child run another scan, given as the source of a module."""
    (tmp_path / "other_scan.py").write_text(source)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(guard, "_CODE", OTHER_SCAN)


def is_alive(pid):
    """Whether a process runs; a zombie does not."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return not Path("/proc/self").exists()


def ended_within(pid, most_s):
    until = time.monotonic() + most_s
    while is_alive(pid) and time.monotonic() < until:
        time.sleep(0.02)
    return not is_alive(pid)


@pytest.mark.parametrize(("at", "bit"), HANGS + ENDS)
def test_a_wrong_bit_that_the_library_cannot_bear_is_refused(whole_log, at, bit):
    """Where another version of the library bears it, the log is read or refused as any other."""
    damaged = bytearray(whole_log.read_bytes())
    damaged[at] ^= 1 << bit
    whole_log.write_bytes(damaged)
    began = time.monotonic()
    try:
        log = scan(whole_log)
    except FormatError as error:
        text = str(error)
        assert text.startswith(f"{whole_log}: ") and "\n" not in text
        if tuple(map(int, h5py.version.hdf5_version.split(".")[:2])) == (2, 0) and h5py.__version__.startswith("3.16"):
            assert "damaged: the HDF5 library" in text
    else:
        assert log.channels
    assert time.monotonic() - began < guard.MOST_S + 5.0


def test_what_runs_for_ever_is_refused_and_the_next_log_is_read(whole_log, monkeypatch, tmp_path, child):
    with monkeypatch.context() as patch:
        stand_in(patch, tmp_path, SPIN)
        with pytest.raises(FormatError, match=r"log\.h5: damaged: the HDF5 library did not come to an end within 1"):
            scan(whole_log)
    assert child._process is None
    assert len(scan(whole_log).channels) == 3


@pytest.mark.parametrize("end", ["os.abort()", "os._exit(0)", "os.write(3, b'x'); os.close(1); os._exit(1)"])
def test_what_ends_the_process_is_refused_and_the_next_log_is_read(whole_log, monkeypatch, tmp_path, end):
    with monkeypatch.context() as patch:
        stand_in(patch, tmp_path, f"import os\ndef scan(path):\n    {end}\n")
        with pytest.raises(FormatError, match=r"log\.h5: damaged: the HDF5 library ended the process that read"):
            scan(whole_log)
    assert len(scan(whole_log).channels) == 3


def test_a_child_that_was_killed_while_nobody_asked_is_started_again(whole_log, child):
    scan(whole_log)
    first = child._process
    first.kill()
    first.wait()
    assert len(scan(whole_log).channels) == 3
    assert child._process.pid != first.pid


def test_one_child_serves_all_files(whole_log, child):
    scan(whole_log)
    first = child._process.pid
    other = whole_log.with_name("other.h5")
    other.write_bytes(whole_log.read_bytes())
    scan(other)
    assert child._process.pid == first


@pytest.mark.parametrize(
    "python", [("/no/such/python",), (sys.executable, "-c", "pass"), (sys.executable, "-c", "print('[1]')")]
)
def test_without_a_child_the_scan_is_done_here(whole_log, monkeypatch, child, python):
    monkeypatch.setattr(guard, "PYTHON", python)
    assert len(scan(whole_log).channels) == 3
    monkeypatch.setattr(guard, "PYTHON", PYTHON)
    assert len(scan(whole_log).channels) == 3
    assert child._process is None, "tried again"


def test_a_defect_of_ours_is_not_hidden(whole_log, monkeypatch, tmp_path):
    stand_in(monkeypatch, tmp_path, "def scan(path):\n    raise ZeroDivisionError\n")
    assert len(scan(whole_log).channels) == 3


def test_too_much_memory_is_refused(whole_log, monkeypatch, tmp_path):
    stand_in(monkeypatch, tmp_path, "def scan(path):\n    bytearray(1 << 60)\n")
    with pytest.raises(FormatError, match=r"log\.h5: .*too much memory"):
        scan(whole_log)


@pytest.mark.parametrize("relative", [False, True])
@pytest.mark.parametrize("damage", ["cut", "empty"])
def test_a_refusal_is_the_words_of_the_scan(whole_log, monkeypatch, relative, damage):
    from tdacoustic.formats.hdf5.reader import scan_file, scan_here

    if damage == "cut":
        whole_log.write_bytes(whole_log.read_bytes()[:3000])
    else:
        with h5py.File(whole_log, "w"):
            pass
    scan_file_at = whole_log
    if relative:
        monkeypatch.chdir(whole_log.parent)
        scan_file_at = Path("log.h5")
    with pytest.raises(FormatError) as here:
        scan_here(scan_file_at)
    with pytest.raises(FormatError) as guarded:
        scan_file(scan_file_at)
    assert str(guarded.value) == str(here.value)


def test_a_file_found_good_is_not_asked_about_again_until_it_changes(whole_log, monkeypatch, child):
    monkeypatch.setattr(guard, "_RACY_S", -1.0)
    asked = []
    ask = child.ask
    monkeypatch.setattr(child, "ask", lambda job: asked.append(job["path"]) or ask(job))
    scan(whole_log)
    scan(whole_log)
    assert asked == [str(whole_log)]
    with h5py.File(whole_log, "a") as file:
        file.create_dataset("more", data=np.arange(100.0))
    scan(whole_log)
    assert len(asked) == 2


def test_a_file_that_has_just_been_written_is_asked_about_each_time(whole_log):
    scan(whole_log)
    assert os.environ[guard.FOUND_GOOD] == ""


def test_what_is_remembered_is_bounded(monkeypatch):
    for number in range(guard.MOST_FOUND + 5):
        guard._remember(f"{number:016x}")
    found = os.environ[guard.FOUND_GOOD].split()
    assert len(found) == guard.MOST_FOUND and found[-1] == f"{guard.MOST_FOUND + 4:016x}"
    assert len(os.environ[guard.FOUND_GOOD]) < 32_767, "more than Windows takes"


def program(source, *arguments, **more):
    """Start a program of its own that scans."""
    strict = ["-X", "dev", "-W", "error::ResourceWarning"]
    return subprocess.Popen(
        [sys.executable, *strict, "-c", textwrap.dedent(source), *map(str, arguments)],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more,
    )  # fmt: skip


def test_a_process_started_from_here_needs_no_child_for_what_was_found_good(whole_log, monkeypatch):
    monkeypatch.setattr(guard, "_RACY_S", -1.0)
    scan(whole_log)
    source = """
        import sys
        from tdacoustic.formats import scan
        from tdacoustic.formats.hdf5 import guard
        print(len(scan(sys.argv[1]).channels), guard._CHILD._process)
    """
    out, err = program(source, whole_log).communicate(timeout=60)
    assert out.split() == ["3", "None"] and not err


def test_the_child_ends_with_the_program_without_a_word(whole_log):
    source = """
        import sys
        from tdacoustic.formats import scan
        from tdacoustic.formats.hdf5 import guard
        scan(sys.argv[1])
        print(guard._CHILD._process.pid)
    """
    process = program(source, whole_log)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0 and not err
    assert os.name != "posix" or ended_within(int(out), 2.0)


SPINNING = """
    import sys, threading, time
    sys.path.insert(0, sys.argv[2])
    from tdacoustic.formats import scan
    from tdacoustic.formats.hdf5 import guard
    guard.MOST_S = float(sys.argv[3])
    guard._CODE = sys.argv[4]
    def tell():
        while guard._CHILD._process is None or not guard._CHILD._ready:
            time.sleep(0.01)
        time.sleep(0.2)
        print(guard._CHILD._process.pid, flush=True)
    threading.Thread(target=tell, daemon=True).start()
    scan(sys.argv[1])
"""


@POSIX
@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_ends_the_waiting_and_the_child(whole_log, tmp_path):
    (tmp_path / "other_scan.py").write_text(SPIN)
    process = program(SPINNING, whole_log, tmp_path, 60.0, OTHER_SCAN)
    pid = int(process.stdout.readline())
    assert is_alive(pid)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=10)
    assert err.rstrip().endswith("KeyboardInterrupt")
    assert ended_within(pid, 2.0)


@POSIX
def test_a_child_that_runs_for_ever_does_not_outlive_its_time_when_the_program_is_killed(whole_log, tmp_path):
    (tmp_path / "other_scan.py").write_text(SPIN)
    process = program(SPINNING, whole_log, tmp_path, 1.0, OTHER_SCAN)
    pid = int(process.stdout.readline())
    process.kill()
    process.communicate(timeout=10)
    assert ended_within(pid, 5.0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_has_a_child_of_its_own(whole_log):
    source = """
        import json, os, sys
        from tdacoustic.formats import scan
        from tdacoustic.formats.hdf5 import guard
        scan(sys.argv[1])
        ours = guard._CHILD._process.pid
        read, write = os.pipe()
        if os.fork() == 0:
            assert guard._CHILD._process is None
            n = len(scan(sys.argv[1]).channels)
            os.write(write, json.dumps([n, guard._CHILD._process.pid]).encode())
            os._exit(0)
        os.wait()
        n, theirs = json.loads(os.read(read, 100))
        scan(sys.argv[1])
        print(json.dumps([n, ours == guard._CHILD._process.pid, theirs != ours, theirs]))
    """
    out, err = program(source, whole_log).communicate(timeout=60)
    n, kept, other, theirs = json.loads(out)
    assert (n, kept, other) == (3, True, True) and not err
    assert ended_within(theirs, 2.0)


def test_the_hdf5_level_of_matlab_is_guarded_too(whole_log, child):
    path = whole_log.with_suffix(".mat")
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("acc", data=np.arange(50.0)[np.newaxis]).attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, by a test".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head.ljust(512, b"\0") + path.read_bytes()[512:])
    assert [channel.name for channel in scan(path).channels] == ["acc"]
    assert child._process is not None
