"""*Your own campaign in ten minutes*, followed to the letter in an empty folder."""

import csv

import pytest
from guides import DOCS, follow


@pytest.fixture(scope="module")
def followed(real_recordings, store, tmp_path_factory):
    folder = tmp_path_factory.mktemp("empty")
    follow(DOCS / "ten-minutes.md", folder, store, RECORDINGS=str(real_recordings))
    return folder


def rows(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_it_ends_in_a_report(followed):
    page = (followed / "report" / "report.html").read_text(encoding="utf-8")
    assert page.lower().startswith("<!doctype html>") and page.rstrip().endswith("</html>")
    for said in (
        "A car and an electric motor",
        "car run-up",
        "electric motor",
        "The data of this report were measured.",
    ):
        assert said in page


def test_both_logs_are_in_it(followed):
    levels = {(row["condition"], row["channel"]): row for row in rows(followed / "report" / "levels.csv")}
    vibration = float(levels["electric motor", "motor_vibration"]["rms"])
    # what `info` prints of the log, without the mean, which it prints too
    expected = (512.392**2 - 0.518266**2) ** 0.5
    assert abs(vibration / expected - 1.0) < 0.02


def test_what_nobody_knows_is_not_made_up(followed):
    """Nobody names a drive: no line has an owner, and no condition a verdict."""
    assert {row["dominant"] for row in rows(followed / "report" / "dominance.csv")} == {"undecided"}
    assert {row["distance_m"] for row in rows(followed / "report" / "levels.csv")} == {""}


def test_the_orders_that_were_asked_for_are_followed(followed):
    found = {float(row["order"]) for row in rows(followed / "report" / "orders.csv") if row["channel"] == "microphone"}
    assert {2.0, 4.0, 6.0} <= found
