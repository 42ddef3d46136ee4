"""The store: what goes in comes out, nothing is executed, nothing is half written."""

import io
import json
import os
import pickle
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path, PurePosixPath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sample_steps import NUMBERS, TOTAL

from tdacoustic.errors import StoreError, TdacousticError
from tdacoustic.recording import Raster
from tdacoustic.steps import LogFile, Record, Store, execute, result_of
from tdacoustic.steps.codec import canonical_json, decode, encode
from tdacoustic.steps.execution import compute
from tdacoustic.steps.store import default_store_path

RECORD = Record("s", 1, "S", "l", "{}", (("a", "b"),), (("python", "3"),), 0.5)
KEY = "ab" * 32


def same(a, b):
    """Equal in type and value; NaN is NaN, and arrays to the bit."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if type(a) is not type(b):
        return False
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (LogFile, Record)):
        return same(list(vars(a).values()), list(vars(b).values()))
    if isinstance(a, float):
        return repr(a) == repr(b)
    return a == b


arrays = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int64, np.int16, np.uint8, np.bool_, np.complex128, np.dtype(">f8")]),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
leaves = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(st.characters(exclude_categories=["Cs"])),
    st.sampled_from([Path("a/b"), Path("/x/ä ö.h5")]), arrays,
)  # fmt: skip
values = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.lists(inner, max_size=3).map(tuple),
        st.dictionaries(st.sampled_from(["a", "$type", "$array", "$tuple", "ü"]), inner, max_size=3),
        st.builds(LogFile, inner, inner, inner),
        st.builds(Record, *[inner] * 8),
    ),
    max_leaves=8,
)


@given(values)
def test_the_codec_gives_back_what_it_took(value):
    held = []
    tree = json.loads(canonical_json(encode(value, held)))
    assert same(value, decode(tree, [array.copy() for array in held]))


@settings(max_examples=30, deadline=None)
@given(value=values)
def test_the_store_gives_back_what_it_took(tmp_path_factory, value):
    store = Store(tmp_path_factory.mktemp("store"))
    store.save(KEY, value, RECORD)
    assert same(value, store.load(KEY))
    assert store.record(KEY) == RECORD


def test_a_checked_type_and_its_arrays_come_back_read_only(store):
    store.save(KEY, (Raster(8192.0, 10, 0.5), np.arange(3.0)), RECORD)
    raster, array = store.load(KEY)
    assert raster == Raster(8192.0, 10, 0.5)
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0


def test_numpy_scalars_come_back_as_numbers_of_python():
    assert decode(encode((np.float32(0.5), np.int16(3), np.bool_(True)), []), []) == (0.5, 3, True)


@pytest.mark.parametrize(
    "value",
    [object(), {1, 2}, 1j, np.array([object()]), b"x", {1: 2}, PurePosixPath, Raster],
    ids=["object", "set", "complex", "array of objects", "bytes", "key that is no text", "class", "dataclass type"],
)
def test_what_could_not_be_read_back_is_refused_at_once(store, value):
    with pytest.raises(StoreError, match="cannot be kept in the store"):
        store.save(KEY, (value,), RECORD)
    assert KEY not in store


# ---------------------------------------------------------------- nothing is executed


@pytest.mark.parametrize(
    "name",
    [
        "subprocess:Popen",
        "os:system",
        "builtins:eval",
        "tdacoustic_evil:Thing",
        "tdacoustic.steps.codec:importlib.machinery",
        "tdacoustic.steps.store:Store",
        "tdacoustic.steps.task:Task.key",
        "tdacoustic.steps:Record",
        "tdacoustic.results.analysis:Campaign",
        "tdacoustic.nothing:Thing",
        "tdacoustic.steps.store:Thing",
        "tdacoustic.",
        "",
    ],
)
def test_a_type_that_is_no_dataclass_of_ours_is_refused(name):
    with pytest.raises((StoreError, ImportError, AttributeError, ValueError)):
        decode({"$type": name, "fields": {}}, [])


def test_a_store_file_that_names_a_foreign_type_is_absent_and_removed(store, tmp_path):
    store.save(KEY, (1,), RECORD)
    path = store._path(KEY)
    flag = tmp_path / "executed"
    tree = {
        "schema": "tdacoustic-result/1",
        "result": {"$type": "subprocess:Popen", "fields": {"args": ["touch", str(flag)]}},
        "record": None,
    }
    with path.open("wb") as stream:
        np.savez(stream, tree=np.frombuffer(json.dumps(tree).encode(), np.uint8))
    with pytest.raises(KeyError, match="outside tdacoustic"):
        store.load(KEY)
    assert not flag.exists()
    assert not path.exists()


class Evil:
    def __init__(self, flag):
        self.flag = str(flag)

    def __reduce__(self):
        return os.mkdir, (self.flag,)


def test_a_pickle_in_a_store_file_is_not_opened(store, tmp_path):
    flag = tmp_path / "executed"
    bad = np.array([Evil(flag)], dtype=object)
    store.save(KEY, (1,), RECORD)
    path = store._path(KEY)
    with path.open("wb") as stream:
        np.savez(
            stream, tree=np.frombuffer(b'{"schema":"tdacoustic-result/1","result":{"$array":0}}', np.uint8), a0=bad
        )
    with pytest.raises(KeyError):
        store.load(KEY)
    path.write_bytes(pickle.dumps(Evil(flag)))
    with pytest.raises(KeyError):
        store.load(KEY)
    assert not flag.exists()


# ---------------------------------------------------------------- damage


def test_every_flipped_bit_is_seen_or_does_no_harm(store):
    value = (np.arange(5.0), "text", 3)
    store.save(KEY, value, RECORD)
    path = store._path(KEY)
    whole = path.read_bytes()
    seen = 0
    for place in range(len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << (place % 8)
        path.write_bytes(damaged)
        try:
            assert same(store.load(KEY), value), f"byte {place}"
        except KeyError:
            seen += 1
    assert seen > len(whole) // 4


def test_every_truncation_is_seen(store):
    store.save(KEY, (np.arange(5.0), "text"), RECORD)
    path = store._path(KEY)
    whole = path.read_bytes()
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(KeyError):
            store.record(KEY)
        with pytest.raises(KeyError):
            store.load(KEY)
        assert not path.exists()


@pytest.mark.parametrize("which", ["one", "total"])
@pytest.mark.parametrize("damage", ["removed", "truncated", "tail lost", "array damaged"])
def test_what_is_damaged_is_computed_again(store, which, damage):
    one, other = NUMBERS.task("x", (1,)), NUMBERS.task("x", (2,))
    task = TOTAL.task("x", (), one=one, other=other)
    execute([task], store)
    kept = result_of(task, store)
    path = store._path({"one": one, "total": task}[which].key)
    whole = path.read_bytes()
    if damage == "removed":
        path.unlink()
    elif damage == "array damaged":
        path.write_bytes(whole.replace(whole[-2000:-1500], bytes(500)) if len(whole) > 4000 else whole[:-30])
    else:
        path.write_bytes(whole[: 100 if damage == "truncated" else -30])
    execute([task], store)
    assert result_of(task, store) == kept
    assert same(result_of(one, store), NUMBERS.function((1,)))


def test_a_result_of_another_schema_is_absent(store):
    store.save(KEY, (1,), RECORD)
    path = store._path(KEY)
    with np.load(path) as bundle:
        tree = json.loads(bytes(bundle["tree"]))
    buffer = io.BytesIO()
    np.savez(buffer, tree=np.frombuffer(json.dumps({**tree, "schema": "tdacoustic-result/9"}).encode(), np.uint8))
    path.write_bytes(buffer.getvalue())
    with pytest.raises(KeyError, match="tdacoustic-result/9"):
        store.load(KEY)


# ---------------------------------------------------------------- from one store to another


def test_the_bytes_of_one_store_are_a_result_in_another(store, tmp_path):
    other = Store(tmp_path / "other")
    value = (np.arange(5.0), "text", 3)
    store.save(KEY, value, RECORD)
    other.write_bytes(KEY, store.read_bytes(KEY))
    assert same(other.load(KEY), value)
    assert other.record(KEY) == RECORD
    assert other.is_whole(KEY)
    assert not other.is_whole("cd" * 32)
    with pytest.raises(KeyError):
        store.read_bytes("cd" * 32)


def test_bytes_that_are_not_whole_are_refused_on_arrival(store, tmp_path):
    other = Store(tmp_path / "other")
    value = (np.arange(5.0), "text")
    store.save(KEY, value, RECORD)
    whole = store.read_bytes(KEY)
    for length in range(0, len(whole), 31):
        with pytest.raises(StoreError, match=f"these {length} bytes are no whole result"):
            other.write_bytes(KEY, whole[:length])
    for place in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << (place % 8)
        try:
            other.write_bytes(KEY, bytes(damaged))
        except StoreError:
            continue
        assert same(other.load(KEY), value), f"byte {place}"
    (other.folder / "results").mkdir(parents=True, exist_ok=True)
    assert list(other.folder.rglob("*.tmp")) == []


def test_a_pickle_that_arrives_is_not_opened(store, tmp_path):
    flag = tmp_path / "executed"
    buffer = io.BytesIO()
    tree = b'{"schema":"tdacoustic-result/1","result":{"$array":0}}'
    np.savez(buffer, tree=np.frombuffer(tree, np.uint8), a0=np.array([Evil(flag)], dtype=object))
    for data in (buffer.getvalue(), pickle.dumps(Evil(flag))):
        with pytest.raises(StoreError, match="no whole result"):
            store.write_bytes(KEY, data)
    assert not flag.exists()
    assert KEY not in store


def test_a_damaged_result_is_not_handed_on_but_removed(store):
    store.save(KEY, (np.arange(500.0),), RECORD)
    path = store._path(KEY)
    damaged = bytearray(path.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    path.write_bytes(damaged)
    with pytest.raises(KeyError, match="no whole result"):
        store.read_bytes(KEY)
    assert not path.exists()


# ---------------------------------------------------------------- atomic


SAVER = """
import sys, numpy as np
from tdacoustic.steps import Store, Record
store = Store(sys.argv[1])
record = Record("s", 1, "S", "l", "{}", (), (), 0.0)
print("ready", flush=True)
number = 0
while True:
    store.save("ab" * 32, (number, np.full(400_000, number)), record)
    number += 1
"""


def test_a_kill_while_saving_leaves_the_key_whole(tmp_path, store):
    for number in range(6):
        process = subprocess.Popen([sys.executable, "-c", SAVER, str(store.folder)], stdout=subprocess.PIPE)
        process.stdout.readline()
        time.sleep(0.05 + 0.013 * number)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        if KEY in store:
            number, array = store.load(KEY)
            assert (array == number).all()
            assert zipfile.is_zipfile(store._path(KEY))
    assert KEY in store


def test_left_overs_of_a_kill_are_swept_when_they_are_old(store):
    folder = store._path(KEY).parent
    folder.mkdir(parents=True)  # a process looks through it when it first keeps something there
    fresh, stale = folder / "x.tmp", folder / "y.tmp"
    fresh.touch()
    stale.touch()
    os.utime(stale, (time.time() - 1e6,) * 2)
    store.save(KEY, (1,), RECORD)
    assert fresh.exists()
    assert not stale.exists()
    assert store.load(KEY) == (1,)


def test_a_result_that_cannot_be_encoded_leaves_the_old_one(store):
    store.save(KEY, (1,), RECORD)
    with pytest.raises(StoreError):
        store.save(KEY, (object(),), RECORD)
    assert store.load(KEY) == (1,)
    assert len(list(store.folder.rglob("*.tmp"))) == 0


def test_a_store_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    store = Store(tmp_path / "file")
    with pytest.raises(StoreError, match="file"):
        compute(NUMBERS.task("x", (1,)), store)
    store.remember_hash(tmp_path / "a.h5", "{}")  # no error: it is only computed again
    assert store.remembered_hash(tmp_path / "a.h5") is None


def test_where_a_result_that_is_being_read_cannot_be_replaced_it_stays(store, monkeypatch):
    """As Windows does, which moves no file over one that is open."""
    store.save(KEY, (1,), RECORD)

    def refused(self, target):
        raise PermissionError(13, "used by another process", str(target))

    monkeypatch.setattr(Path, "replace", refused)
    store.save(KEY, (1,), RECORD)
    assert store.load(KEY) == (1,) and not list(store.folder.rglob("*.tmp"))
    with pytest.raises(StoreError):
        store.save("cd" * 32, (1,), RECORD)


AT_ONE_KEY = """
import sys
from tdacoustic.steps import Record, Store

store, record = Store(sys.argv[1]), Record("s", 1, "S", "l", "{}", (), (), 0.5)
for _ in range(40):
    store.save("ab" * 32, tuple(range(2000)), record)
    assert store.load("ab" * 32) == tuple(range(2000)) and store.record("ab" * 32) == record
"""


def test_processes_that_keep_and_read_one_key_at_one_time_do_not_disturb_each_other(store):
    command = [sys.executable, "-c", AT_ONE_KEY, str(store.folder)]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    several = [subprocess.Popen(command, env=environment, stderr=subprocess.PIPE) for _ in range(3)]
    assert [(process.communicate(timeout=120)[1], process.returncode) for process in several] == [(b"", 0)] * 3
    assert store.load(KEY) == tuple(range(2000)) and not list(store.folder.rglob("*.tmp"))


def test_where_the_store_is(monkeypatch, tmp_path):
    monkeypatch.setenv("TDACOUSTIC_STORE", str(tmp_path))
    assert default_store_path() == tmp_path
    monkeypatch.delenv("TDACOUSTIC_STORE")
    assert "tdacoustic" in str(default_store_path())


def test_store_errors_are_caught_as_ours_and_as_os_errors():
    assert issubclass(StoreError, TdacousticError)
    assert issubclass(StoreError, OSError)
