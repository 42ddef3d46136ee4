"""A task's key is made of its step's name and version, its settings and its inputs, and of nothing else."""

import os
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_steps import NUMBERS, TOTAL, failing, log_of, raised

from tdacoustic.errors import MissingFileError, StoreError
from tdacoustic.measured.survey_step import SurveySettings
from tdacoustic.steps import LogFile, log_file
from tdacoustic.steps.codec import fingerprint


def test_the_same_parts_give_the_same_key(tmp_path):
    log = log_of(tmp_path / "a.h5")
    assert NUMBERS.task("x", (1,), logs=(log,)).key == NUMBERS.task("x", (1,), logs=(log,)).key


def test_the_key_of_a_task_is_the_same_in_every_session():
    # golden: where this changes, every store there is will be computed anew
    assert NUMBERS.task("x", (1,)).key == "523b424ff586e7fc41950257cf3efb6c3810c68991a9b749fb12ddac39b61075"


@pytest.mark.parametrize(
    "other",
    [
        raised(NUMBERS, name="other").task("x", (1,)),
        raised(NUMBERS, version=2).task("x", (1,)),
        NUMBERS.task("x", (2,)),
        NUMBERS.task("x", (1.0,)),
        NUMBERS.task("x", ("1",)),
        NUMBERS.task("x", [1]),
        NUMBERS.task("x", (1,), logs=()),
    ],
    ids=["name", "version", "settings", "type of a setting", "text", "list", "input"],
)
def test_every_part_changes_the_key(other):
    assert other.key != NUMBERS.task("x", (1,)).key


def test_label_title_and_function_are_no_part_of_the_key():
    same = raised(NUMBERS, title="Other words", function=failing).task("run 2", (1,))
    assert same.key == NUMBERS.task("run 1", (1,)).key


def test_a_moved_log_is_the_same_log_and_a_changed_one_is_not(tmp_path):
    keys = [
        NUMBERS.task("x", (1,), logs=(log_of(path, text),)).key
        for path, text in ((tmp_path / "a.h5", "abc"), (tmp_path / "deep" / "b.h5", "abc"), (tmp_path / "c.h5", "abd"))
    ]
    assert keys[0] == keys[1] != keys[2]


def test_the_order_and_the_names_of_inputs_matter_and_upstream_changes_reach_down():
    one, other = NUMBERS.task("x", (1,)), NUMBERS.task("x", (2,))
    straight = TOTAL.task("x", (), one=one, other=other).key
    assert straight == TOTAL.task("x", (), other=other, one=one).key
    assert straight != TOTAL.task("x", (), one=other, other=one).key
    assert straight != TOTAL.task("x", (), one=raised(NUMBERS, version=2).task("x", (1,)), other=other).key


def test_an_input_that_is_no_task_and_no_log_is_refused():
    with pytest.raises(StoreError, match="must be a task or a log, got str"):
        _ = NUMBERS.task("x", (1,), logs="a.h5").key


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_keys_are_equal_where_settings_are(a, b):
    same = fingerprint(SurveySettings((), a, 0.5)) == fingerprint(SurveySettings((), b, 0.5))
    assert same == (a == b)


def test_fingerprints_tell_arrays_apart_by_values_shape_and_type():
    a = np.arange(6.0)
    kinds = [a, a.reshape(2, 3), a.astype(np.float32), a + 1, a.astype(">f8"), a.astype(np.int64)]
    assert len({fingerprint((array,)) for array in kinds}) == len(kinds)
    assert fingerprint((np.arange(12.0)[::2],)) == fingerprint((np.arange(12.0)[::2].copy(),))
    assert fingerprint((np.asfortranarray(a.reshape(2, 3)),)) == fingerprint((a.reshape(2, 3),))


# ---------------------------------------------------------------- remembered hashes


def old(path, seconds=100):
    stamp = time.time_ns() - int(seconds * 1e9)
    os.utime(path, ns=(stamp, stamp))
    return stamp


def test_a_hash_is_remembered_and_not_trusted_after_a_change(tmp_path, store):
    path = tmp_path / "a.h5"
    first = log_of(path, "abc").sha256
    stamp = old(path)
    assert log_file(path, store).sha256 == first
    assert first in store.remembered_hash(path)
    path.write_text("abcd")
    assert log_file(path, store).sha256 != first
    path.write_text("abd")
    os.utime(path, ns=(stamp, stamp))  # the same size and time of change: a copy that keeps its stamps
    assert log_file(path, store).sha256 != first


def test_a_remembered_hash_saves_the_reading(tmp_path, store, monkeypatch):
    path = tmp_path / "a.h5"
    log_of(path, "abc")
    old(path)
    kept = log_file(path, store)
    monkeypatch.setattr("hashlib.file_digest", lambda *_: pytest.fail("the file was read again"))
    assert log_file(path, store) == kept


def test_a_file_changed_a_moment_ago_is_not_remembered(tmp_path, store):
    path = tmp_path / "a.h5"
    log_of(path, "abc")
    log_file(path, store)
    assert store.remembered_hash(path) is None


@pytest.mark.parametrize("note", [b"", b"{", b"[1]", b"null", b'{"size": 3}', b"\xff\xfe"])
def test_a_damaged_note_of_a_hash_is_none(tmp_path, store, note):
    path = tmp_path / "a.h5"
    log_of(path, "abc")
    old(path)
    kept = log_file(path, store)
    (file,) = (store.folder / "hashes").iterdir()
    file.write_bytes(note)
    assert log_file(path, store) == kept == LogFile(path, kept.sha256, 3)


def test_where_a_log_was_fetched_from_is_no_part_of_the_key(tmp_path):
    path = tmp_path / "a.h5"
    log_of(path, "abc")
    near, far = log_file(path), log_file(path, url="s3://bucket/a.h5")
    assert (near.url, far.url) == (None, "s3://bucket/a.h5")
    assert NUMBERS.task("x", (1,), logs=(near,)).key == NUMBERS.task("x", (1,), logs=(far,)).key


def test_a_missing_log_is_named(tmp_path):
    with pytest.raises(MissingFileError, match=r"gone\.h5: no such file"):
        log_file(tmp_path / "gone.h5")
