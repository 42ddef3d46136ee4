"""Any damage to a log of any format: a `TdacousticError` or a log, in bounded time and memory.

The longer run, guided by coverage, is `tests/evidence/formats_fuzz.py`.
"""

import sys
from pathlib import Path

import pytest
from fuzz_mutations import CHANGES, Change, changed
from fuzz_worker import Reader
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_makers import all_makers

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is bounded and read as Linux does")

MOST_S = 5.0
MOST_KB = 300_000
EXAMPLES = 60
TEXTS = (b"\x00", b"\xff" * 8, b"\n", b'"', b"-1\n", b"<!ENTITY a SYSTEM 'file:///etc/passwd'>", b"1e999", b"\x80" * 40)

changes = st.builds(
    Change,
    st.sampled_from(sorted(CHANGES)),
    st.floats(0.0, 1.0),
    st.integers(-40, 80),
    st.integers(0, 10_000),
    st.sampled_from(TEXTS) | st.binary(min_size=1, max_size=16),
)


@pytest.fixture(scope="module")
def reader():
    held = Reader(MOST_S)
    yield held
    held.close()


@pytest.fixture(scope="module", params=all_makers(), ids=lambda maker: maker.__name__)
def seed(request, tmp_path_factory):
    """A small whole log, and another of the same format where there is one."""
    path = request.param(tmp_path_factory.mktemp("seed")).path
    other = next(
        (maker(tmp_path_factory.mktemp("other")).path for maker in all_makers() if maker is not request.param), path
    )
    return path, path.read_bytes(), other.read_bytes()


def test_damage_ends_in_a_log_or_in_one_clear_error(seed, reader):
    path, whole, other = seed
    damaged = path.with_name(f"damaged{path.suffix}")
    beyond_us: list[str] = []

    @settings(
        max_examples=EXAMPLES, deadline=None, derandomize=True, database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(st.lists(changes, min_size=1, max_size=4))
    def attempt(many):
        blob = whole
        for change in many:
            blob = changed(blob, change, other)
        damaged.write_bytes(blob)
        answer = reader(damaged)
        if answer["outcome"].startswith(("hung", "killed")) and in_a_c_library(answer["outcome"]):
            beyond_us.append(answer["outcome"])
            return
        assert answer["outcome"] in ("read", "refused"), answer
        assert answer["seconds"] < MOST_S and answer["kb"] < MOST_KB, answer

    attempt()
    # libhdf5 can end the process or run for ever over damaged samples, libsndfile over a damaged header
    assert len(beyond_us) <= EXAMPLES // 20, beyond_us


def in_a_c_library(outcome: str) -> bool:
    """Whether it was h5py reading samples, or soundfile, that ended the reader; scans of HDF5 are guarded."""
    return any(name in outcome.partition(":")[2] for name in ("in _slabs", "soundfile.py"))


def test_the_reader_of_damage_sees_what_it_must(tmp_path, reader):
    """A test of the tests: what crashes, hangs or ends the process is told apart."""
    assert reader(Path(__file__))["outcome"] == "refused"
    (tmp_path / "a.csv").write_text("mic [Pa]\n1.5\n2.5\n")
    assert reader(tmp_path / "a.csv")["outcome"] == "read"
    assert changed(b"RIFF1234", Change("cut", 0.5, -1, 0, b"")) == b"RIF"
