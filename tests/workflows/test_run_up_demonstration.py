"""The campaign recordings/run-up against what its recipe and truth.json say was put in."""

import json
import math
import tomllib
from pathlib import Path

import pytest

from tdacoustic.workflows.analyze import analyze

FOLDER = Path(__file__).parents[2] / "recordings" / "run-up"
SOURCE = "known input: recipe and truth.json of recordings/run-up"


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    return analyze(FOLDER, tmp_path_factory.mktemp("store"), jobs=1).tables


@pytest.fixture(scope="module")
def recipe():
    return tomllib.loads((FOLDER / "synthesis.toml").read_text(encoding="utf-8"))


def truth(run):
    content = json.loads((FOLDER / "truth.json").read_text(encoding="utf-8"))
    return next(item for item in content["runs"] if item["name"] == run)


def tones_db(run, source):
    """Level at the microphone of the lines of a component from 100 Hz on."""
    lines = truth(run)["channels"]["mic_left"]["lines"]
    held = [line["level_db"] for line in lines if line["source"] == source and line["frequency_hz"] > 100.0]
    return 10.0 * math.log10(sum(10.0 ** (0.1 * level) for level in held))


@pytest.mark.parametrize("run", ["60 traction", "60 brake"])
@pytest.mark.parametrize("source", ["motor", "gearbox"])
def test_contributions_of_the_tones(tables, run, source, conformance):
    found = tables["contributions"].query("run == @run and span == 'tones' and part == @source").iloc[0]
    assert found["verdict"] == "ok"
    expected, note = tones_db(run, source), "a statistical estimate from one run, and stated with its interval"
    assert found["low_db"] - 0.5 < expected < found["high_db"] + 0.5
    conformance(f"tones of the {source}, {run}", expected, found["level_db"], 1.0, "dB", SOURCE, note)


def test_the_mesh_order_over_the_run_up_is_the_gearbox(tables):
    rows = tables["contributions"].query("run == 'run-up' and kind == 'order' and span == 'mesh x1'")
    gearbox = rows.query("part == 'gearbox'")
    assert len(gearbox) >= 5 and (gearbox["verdict"] == "ok").all() and (gearbox["probability_largest"] > 0.95).all()


def test_sidebands_that_nobody_named_are_named_by_their_family(tables):
    rows = tables["orders"].query("run == 'run-up'").drop_duplicates("name").set_index("name")
    assert rows.loc["mesh x1 - motor shaft", "order"] == 30.0 and rows.loc["mesh x1 + motor shaft", "order"] == 32.0


def test_slip_and_its_time(tables, recipe, conformance):
    (put_in,) = recipe["condition"][0]["slip"]
    row = tables["slip"].set_index("run").loc["run-up"]
    assert row["n_events"] == 1 and row["worst_event"] == "slip"
    conformance("largest slip of the run-up", put_in["peak"], row["worst_slip"], 0.002, "1", SOURCE)
    assert put_in["from_s"] < row["worst_from_s"] < row["worst_to_s"] < put_in["to_s"]
    assert not tables["slip"].query("run != 'run-up'")["n_events"].any()


@pytest.mark.parametrize("channel", ["motor_z", "gearbox_z"])
def test_the_resonance_that_orders_pass(tables, recipe, channel, conformance):
    own = next(item for item in recipe["channel"] if item["name"] == channel)["resonance"][0]
    rows = tables["resonances"].query("run == 'run-up' and channel == @channel and kind == 'resonance'")
    nearest = rows.iloc[(rows["frequency_hz"] - own["frequency_hz"]).abs().argmin()]
    # Its width is what limits it: the sweep passes 40 to 60 Hz in a second or two.
    tolerance = 0.5 * own["width_hz"]
    conformance(f"resonance of {channel}", own["frequency_hz"], nearest["frequency_hz"], tolerance, "Hz", SOURCE)


def test_orders_away_from_the_resonances_have_the_level_put_in(tables, recipe, conformance):
    """Below 500 rpm mesh x1 lies 350 Hz below the resonance at 610 Hz, which lifts it by less than 0.1 dB there."""
    rows = tables["orders"].query(
        "run == 'run-up' and channel == 'gearbox_z' and name == 'mesh x1' and method == 'cut'"
    )
    slow = rows[rows["speed_rpm"] < 500.0]
    assert len(slow) >= 3
    (line,) = [item for item in recipe["condition"][0]["line"] if item["name"] == "mesh 1"]
    conformance("mesh x1 below 500 rpm", line["level_db"], slow["level_db"].mean(), 0.3, "dB", SOURCE)


def test_the_kinds_of_evidence_agree_on_traction(tables):
    row = tables["dominance"].set_index("condition").loc["60 traction"]
    assert (row["dominant"], row["contribution_dominant"], row["evidence_agreement"]) == ("gearbox", "gearbox", "agree")


def test_no_number_is_missing_without_a_reason(tables):
    for name in ("orders", "sidebands", "synchronous", "contributions", "coherence"):
        table = tables[name]
        column = {"orders": "level_db", "sidebands": "sidebands_db", "coherence": "corrected"}.get(name, "level_db")
        missing = table[table[column].isna()]
        assert (missing["reason"].fillna("") != "").all(), name
