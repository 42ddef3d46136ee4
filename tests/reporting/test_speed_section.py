"""What report and tables say of made-up speeds: tachos with faults, lines, slip, and nothing at all."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tdacoustic.attribution import RunSlip
from tdacoustic.campaign import CampaignRun, WrittenPath
from tdacoustic.measured.results import LineReading, RunMeasurement, RunSpeed
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.recording import Channel, Recording
from tdacoustic.reporting.document import Document, FigureBlock, Sentences, walk
from tdacoustic.reporting.figure import Band, Line
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.sections.speed import speed
from tdacoustic.speed import SlipEvent, SpeedProfile, WheelSlip
from tdacoustic.tables.speeds import speed_tables

T = np.linspace(0.025, 9.975, 200)
SIGNAL = Channel("acc", "acceleration", "m/s^2", 0, 0, 1000.0, 0, 10000)


def profile(channel="tacho", shaft="motor", **changes):
    values = {"speed": 10.0 + T, "error": np.full(T.size, 0.001), "source": "tacho", **changes}
    return SpeedProfile(
        channel, shaft, changes.pop("si_symbol", "1/s"), T, **{k: v for k, v in values.items() if k != "si_symbol"}
    )


def run(name, *profiles, problems=(), lines=None, **keys):
    written = CampaignRun(name=name, condition="c", logs=(WrittenPath("a.h5", Path("a.h5")),), **keys)
    measurement = RunMeasurement(RunSpeed(profiles, problems, (), lines), False, (), ())
    return MeasuredRun(written, Recording(name, (), (SIGNAL,)), measurement)


def analysis(*runs, slips=None):
    slips = slips or {}
    campaign = SimpleNamespace(origin="measured")
    return SimpleNamespace(campaign=campaign, runs=runs, slips=slips, tables=speed_tables(runs, slips, {}))


def sentences(section):
    return [item for block in walk(section.blocks) if isinstance(block, Sentences) for item in block.items]


def figures(section):
    return {block.figure.name: block.figure for block in walk(section.blocks) if isinstance(block, FigureBlock)}


def rows(made):
    return made.tables["speeds"].to_dict("records")


def test_a_tacho_is_one_sentence_and_one_figure():
    made = analysis(run("a", profile()), run("b", profile(speed=np.full(T.size, 12.0))))
    section = speed(made)
    assert sentences(section) == [
        "The tacho “tacho” tells the speed of the motor shaft in 2 runs, 601.5 to 1198 rpm; a value's standard error "
        "is less than 0.01 %, by the scatter of its edges."
    ]
    assert [line.name for line in figures(section)["speed-tacho"].elements] == ["run a", "run b"]
    assert {(row["run"], row["source"], row["unit"], row["known_share"]) for row in rows(made)} == {
        ("a", "tacho", "rpm", 1.0),
        ("b", "tacho", "rpm", 1.0),
    }


def test_an_error_that_can_be_seen_has_its_band_and_a_gap_breaks_the_trace():
    words = "not known from 4.00 s to 6.00 s: no pulses"
    gap = profile(
        speed=np.where((T < 4.0) | (T > 6.0), 10.0 + T, np.nan),
        error=np.full(T.size, 0.2),
        unknown=((4.0, 6.0, "no pulses"),),
        notes=("200 pulses", words),
        faults=(words,),
        doubtful=True,
    )
    kept = np.isfinite(gap.speed)
    gap = SpeedProfile(
        gap.channel,
        gap.shaft,
        "1/s",
        T[kept],
        gap.speed[kept],
        gap.notes,
        True,
        gap.error[kept],
        None,
        gap.unknown,
        "tacho",
        gap.faults,
    )
    section = speed(analysis(run("a", gap)))
    band, line = figures(section)["speed-tacho"].elements
    assert isinstance(band, Band) and isinstance(line, Line)
    assert np.isnan(line.y).sum() == 1 and line.x[np.isnan(line.y)][0] == pytest.approx(5.0)
    assert f"Run a, tacho: {words}." in sentences(section)
    assert "2 standard errors" in figures(section)["speed-tacho"].caption
    assert rows(analysis(run("a", gap)))[0]["known_share"] == pytest.approx(0.8, abs=0.01)


def test_lines_say_their_confidence_and_stand_beside_the_tacho():
    lines = profile("lines of acc", confidence=np.full(T.size, 0.93), source="lines", error=np.full(T.size, 0.01))
    made = analysis(run("a", profile(speed=1.01 * (10.0 + T)), lines))
    section = speed(made)
    (said,) = [text for text in sentences(section) if "read from the lines of acc" in text]
    assert "beside its channels" in said and "median confidence 0.93" in said and "0.99 % (rms) beside tacho" in said
    assert {"speed-lines", "speed-confidence", "speed-tacho"} == set(figures(section))
    assert [e.style for e in figures(section)["speed-lines"].elements if isinstance(e, Line)] == ["solid", "dashed"]
    assert rows(made)[1]["beside_leading"] == pytest.approx(1.0 / 1.01 - 1.0)


def test_what_is_not_found_is_said_with_its_reason():
    lines = LineReading(("acc",), "no speed in the lines: noise")
    made = analysis(run("a", lines=lines), run("b", problems=(("acc", "tacho 'acc' has no pulses"),)))
    section = speed(made)
    assert sentences(section) == [
        "The speed is not known in run a: no speed in the lines: noise.",
        "The speed is not known in run b: tacho 'acc' has no pulses.",
    ]
    assert [(row["run"], row["source"], row["reason"]) for row in rows(made)] == [
        ("a", "lines", "no speed in the lines: noise"),
        ("b", "speed channel", "tacho 'acc' has no pulses"),
    ]
    assert all(np.isnan(row["mean"]) for row in rows(made))


def test_slip_has_its_sentence_and_figure():
    slip = WheelSlip(
        T,
        0.01 + 0.05 * ((T > 4) & (T < 5)),
        np.full(T.size, 0.002),
        0.01,
        (SlipEvent("slip", 4.0, 5.0, 0.05),),
        float("nan"),
        (),
    )
    items = (
        RunSlip("gps", "tacho", "motor", slip),
        RunSlip("gps", "other", "wheelset", None, "at no instant are both known"),
    )
    made = analysis(run("a", profile()), slips={"a": items})
    section = speed(made)
    lost, usual, none = sentences(section)[-3:]
    assert lost == (
        "Run a: the wheels lose adhesion (1 × slip, by tacho against gps), at worst +5 % beside the usual slip, from "
        "4.0 s to 5.0 s."
    )
    assert usual.startswith("The usual slip of run a is +1.00 %, one value ± 0.2 % (1 σ). Creep, wear of the wheel")
    assert none == "Run a: at no instant are both known."
    assert figures(section)["slip"].elements[0].y.max() == pytest.approx(6.0)
    one, other = made.tables["slip"].to_dict("records")
    assert "no delay can be told" in one["notes"] and np.isnan(one["like_delay_s"])
    assert other["reason"] == "at no instant are both known" and np.isnan(other["usual_slip"])


def test_many_runs_from_lines_are_summed_up():
    lines = profile("lines of acc", confidence=np.full(T.size, 0.93), source="lines")
    section = speed(analysis(*(run(f"r{k}", lines) for k in range(9))))
    assert len(sentences(section)) == 7 and sentences(section)[-1].startswith("So it is in 3 more runs")


def test_without_any_measured_speed_there_is_no_section_but_a_row():
    made = analysis(run("a"), run("b", train_speed_km_h=30.0))
    assert speed(made) is None
    assert [(row["source"], row["mean"], row["reason"]) for row in rows(made)][1][:2] == ("stated", 30.0)
    assert rows(made)[0]["reason"] == "no speed or tacho channel, and the campaign states none"


def test_the_section_is_a_page():
    section = speed(analysis(run("a", profile())))
    page = render_html(Document(title="t", subtitle="s", origin="measured", sections=[section]))
    assert "All speeds as a table" in page


def test_a_shaft_that_stands_has_no_range_and_no_error():
    made = analysis(run("a", profile(speed=np.zeros(T.size))))
    assert sentences(speed(made)) == ["The tacho “tacho” tells the speed of the motor shaft in run a, which stands."]


def test_a_backward_speed_has_a_minus_sign():
    (said,) = sentences(speed(analysis(run("a", profile(speed=np.linspace(-10.0, 10.0, T.size))))))
    assert "\N{MINUS SIGN}600 to 600 rpm" in said
