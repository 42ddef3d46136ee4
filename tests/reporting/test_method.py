"""What the section on method says of windows, frames, overlaps and averages, of steps recorded by hand."""

import json
from types import SimpleNamespace

import pytest

from tdacoustic.campaign import load_campaign
from tdacoustic.measured.shaft_frames import plan_turn_frames
from tdacoustic.measured.tonality import Tonality
from tdacoustic.reporting.document import Paragraph, Table, walk
from tdacoustic.reporting.sections.method import TURNS_OVERLAP, method_of_measurement
from tdacoustic.results import Analysis
from tdacoustic.steps.record import Record

HEAD = 'schema = "tdacoustic-campaign/1"\nname = "Made up"\norigin = "measured"\n[[level]]\ncondition = "50"\n'
LEVEL = 'level_db = 80.0\ndistance_m = 4.0\norigin = "a book"\n'


def record(step, run, **settings):
    written = json.dumps({"$type": "a:Settings", "fields": settings})
    return step + run, Record(step, 1, step, f"run {run}", written, (), (), 0.0)


def run(name, over_time):
    channel = SimpleNamespace(channel="mic", usable=True, rms=1.0, spectrum=None, map="a map" if over_time else None)
    measurement = SimpleNamespace(channels=(channel,))
    kind = SimpleNamespace(kind="test", condition=name)
    return SimpleNamespace(name=name, run=kind, measurement=measurement, recording={"mic": None})


@pytest.fixture
def section(tmp_path):
    path = tmp_path / "campaign.toml"
    path.write_text(HEAD + LEVEL, encoding="utf-8")
    frames = {"$type": "a:Frames", "fields": {"resolution_hz": 1.0, "overlap": 0.75, "run_up_resolution_hz": 5.0}}
    crossed = {"resolution_hz": 4.0, "overlap": 0.5, "max_segments": 16}
    records = (
        record("survey", "up", frames=frames),
        record("survey", "steady", frames=frames),
        record("cross spectra", "up", **crossed | {"max_segments": 64}),
        record("cross spectra", "steady", **crossed),
        record("cross spectra", "again", **crossed),
    )
    rated = SimpleNamespace(line_spacing_hz=2.5, averaging_s=3.0)
    tonality = Tonality(hearing={"steady": SimpleNamespace(audibility=(rated, rated))})
    turned = SimpleNamespace(
        shaft="motor",
        speed_source="tacho",
        lowest_hz=5.0,
        highest_hz=10.0,
        bandwidth=0.5,
        highest_order=100.0,
        channels=(SimpleNamespace(maps=(SimpleNamespace(domain="frequency", resolution=8.0),)),),
    )
    runs = (run("up", True), run("steady", False), run("again", False))
    held = Analysis(
        load_campaign(path), runs, (), (), {}, (), (), records, tonality=tonality, orders={"up": turned}
    )  # fmt: skip
    (found,) = method_of_measurement(held)
    return found


def test_the_frames_of_each_analysis_are_told_by_what_was_asked_of_it(section):
    (table,) = [b for b in walk([section]) if isinstance(b, Table) and b.name == "other-spectra-as-made"]
    told = [(row[1], *row[2:6]) for row in table.rows]
    assert told == [
        ("up", "Hann", 0.2, 5.0, 75.0),
        ("up", "Hann", 0.25, 4.0, 50.0),
        ("steady, again", "Hann", 0.25, 4.0, 50.0),
        ("steady", "Hann", 0.4, 2.5, 50.0),
        ("up", "Hann", 0.125, 8.0, 50.0),
    ]
    averaged = [row[6] for row in table.rows]
    assert "64 segments" in averaged[1] and "16 segments" in averaged[2] and "3 s each" in averaged[3]


def test_the_overlap_over_the_angle_is_the_one_that_frames_have(section):
    plan = plan_turn_frames(64, 0.125, 1000.0)
    assert plan.window == "hann"
    assert 100.0 * (1.0 - plan.hop / plan.length) == pytest.approx(TURNS_OVERLAP, abs=0.5)
    (words,) = [block.text for block in walk([section]) if isinstance(block, Paragraph)]
    assert "Hann frames that overlap by 75 %" in words and "4 lines a bandwidth" in words
