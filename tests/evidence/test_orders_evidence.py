"""The study of orders: whether its record is of these sources, and what it must hold."""

import pytest
from studies import study_module

PUT_IN = "known input: orders of known level, tests/evidence/orders_study.py"

RERUN = "python tests/evidence/orders_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("orders_study") as module:
        yield module


@pytest.fixture(scope="module")
def rows(study):
    return study.record()["rows"]


def test_the_record_is_of_these_sources(study):
    assert study.record()["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


def test_crossing_orders_are_separated_by_the_filter_and_not_by_the_cut(rows, conformance):
    for row in (row for row in rows if row["case"] == "crossing"):
        conformance(f"level through a crossing, sweep {row['sweep_hz_s']:g} turns/s², Vold-Kalman, rms", 0.0,
                    row["filter"]["level_rms_db"], 0.3, "dB", PUT_IN)  # fmt: skip
        assert row["cut"]["level_largest_db"] > 2.5 * row["filter"]["level_largest_db"]


def test_the_filter_errs_as_rota_order_does(rows, conformance):
    compared = [row for row in rows if "rota" in row]
    assert len(compared) >= 12
    for row in compared:
        what = f"{row['case']}, sweep {row['sweep_hz_s']:g} turns/s²: rms level error beside rota-order's"
        own, other = row["filter"]["level_rms_db"], row["rota"]["level_rms_db"]
        conformance(
            what,
            other,
            own,
            0.01 + 0.02 * other,
            "dB",
            "program: rota-order, recorded by tests/evidence/orders_study.py",
        )


SCATTER = "three times the scatter of one record of an order 10 dB below the noise"


def test_an_order_10_db_below_the_floor_is_seen_by_its_mean(rows, conformance):
    # One record: the slowest has 4 minutes, which leaves a scatter of 0.5 dB; the quickest has 5 s.
    slow = next(row for row in rows if row["case"] == "weak")
    for method in ("cut", "filter"):
        level = slow[method]["level_rms_db"]
        conformance(f"order 10 dB below the floor, {method}, 240 s", 0.0, level, 1.5, "dB", PUT_IN, SCATTER)
