"""The cluster study: whether its record is of these sources, and what it must hold."""

import pytest

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

from studies import study_module

RERUN = "python tests/evidence/cluster_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("cluster_study", "steps", "workflows") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


def test_the_record_is_of_these_sources(study, record):
    """Who changes a module of steps runs the study again."""
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


def test_every_way_gives_the_same_bits(record):
    assert len(record["ways"]) == 6
    assert {way["bits"] for way in record["ways"].values()} == {record["killed"]["bits"]}


def test_two_workers_were_killed_and_nothing_was_lost(record):
    assert record["killed"]["killed"] == 2
    assert record["killed"]["problems"] == record["ways"]["1 process"]["problems"]


def test_two_workers_share_the_steps(record):
    """How many steps ran at one time on average; less than the workers, because the client does something alone too."""
    for travel in ("", ", results travel"):
        one, two = (record["ways"][f"cluster, {count}{travel}"] for count in ("1 worker", "2 workers"))
        assert 0.5 < one["side_by_side"] <= 1.0
        assert 1.2 < two["side_by_side"] <= 2.0
