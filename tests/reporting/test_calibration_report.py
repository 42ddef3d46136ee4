"""The report of a calibration: what is measured, printed, assumed and calculated is told apart."""

import dataclasses
from pathlib import Path

import pytest
from plain_fleets import plain_campaign, plain_fleet

import tdacoustic as td
from tdacoustic.reporting.calibration_report import calibration_report
from tdacoustic.reporting.document import FigureBlock, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.sections.calibration_figures import contributions_figure
from tdacoustic.reporting.sections.calibration_tables import contributions_table, parameters_table

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    return td.calibrate(plain_campaign("crrc-freight-printed"), tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def blocks(printed):
    document = calibration_report(printed)
    return list(walk((*document.summary, *document.sections)))


def figure(blocks, name):
    return next(block.figure for block in blocks if isinstance(block, FigureBlock) and block.figure.name == name)


def table(blocks, name):
    return next(block for block in blocks if isinstance(block, Table) and block.name == name)


def test_the_figure_tells_what_is_what(blocks, printed):
    elements = {element.name: element for element in figure(blocks, "calibration-over-speed").elements}
    assert set(elements) == {
        "calibrated model ± 4 dB (1 σ)",
        "model before: assumed parameters",
        "model after: calibrated",
        "level, printed (± 1 σ)",
        "the paper's model, printed, ± its largest error of 4.1 dB",
    }  # its measurement of condition 3 is the level itself here, and not drawn twice
    assert list(elements["level, printed (± 1 σ)"].y) == [88.3, 88.0]
    paper = elements["the paper's model, printed, ± its largest error of 4.1 dB"]
    assert list(paper.y) == [81.3, 84.2, 88.0, 77.3]
    assert list(paper.errors) == [4.1] * 4
    after = elements["model after: calibrated"]
    assert list(after.y) == pytest.approx([item.after_db for item in printed.over_speed])
    assert len(after.y) == 6  # every condition of the fleet, not only those with a level


def test_contributions_and_levels_add_up(blocks, printed):
    rows = table(blocks, "calibration-contributions-table").rows
    for row in rows:
        motor, _, mesh, _, total, _ = row[2:]
        assert total == pytest.approx(10 * _log10(10 ** (motor / 10) + 10 ** (mesh / 10)), abs=1e-9)
    levels = {row[0]: row for row in table(blocks, "calibration-levels").rows}
    for level in printed.calibration.levels:
        row = levels[level.datum.condition.name]
        assert row[5:9] == (level.datum.level_db, level.before_db, level.predicted_db, level.error_db)
        assert row[4] == "printed"


def test_the_structure_is_shown_before_and_after_where_it_has_a_level(printed):
    def with_structure(sound):
        levels = [dataclasses.replace(e, level_db=60.0) if e.path == "structure" else e for e in sound.levels]
        return dataclasses.replace(sound, levels=tuple(levels))

    calibration = printed.calibration
    assert "structure_before_db" not in {c.key for c in contributions_table(calibration).columns}
    held = dataclasses.replace(
        calibration,
        before=tuple(with_structure(sound) for sound in calibration.before),
        after=tuple(with_structure(sound) for sound in calibration.after),
    )
    keys = [column.key for column in contributions_table(held).columns]
    rows = [dict(zip(keys, row, strict=True)) for row in contributions_table(held).rows]
    assert {(row["structure_before_db"], row["structure_after_db"]) for row in rows} == {(60.0, 60.0)}
    drawn = contributions_figure(dataclasses.replace(printed, calibration=held))
    assert {"structure, before", "structure, after"} < {element.name for element in drawn.elements}
    assert "motor, meshing noise and structure contribute" in drawn.title
    assert "the structure (bearing forces through the housing) is shown but not added" in drawn.caption


def _log10(value):
    from math import log10

    return log10(value)


def test_a_value_is_read_as_its_error_allows_and_downloaded_whole(printed):
    (first, *_) = printed.calibration.parameters
    parameter = dataclasses.replace(first, value=4.877326, stderr=11.83, ci95=(-10.1829, None))
    found = parameters_table(dataclasses.replace(printed.calibration, parameters=(parameter,)))
    (row,) = (dict(zip((column.key for column in found.columns), row, strict=True)) for row in found.rows)
    assert (row["value"].text, row["stderr"].text, row["low"].text) == ("4.9", "12", "\u221210.2")
    assert (row["value"].value, row["stderr"].value, row["low"].value) == (4.877326, 11.83, -10.1829)
    assert row["high"] is None and "linearisation" in found.caption and "profile likelihood" in found.caption


def test_what_is_printed_stands_beside_ours(blocks, printed):
    (text,) = [b.text for b in blocks if isinstance(b, Paragraph) and "beside the paper's own" in b.text]
    ours = {item.condition: item.after_db for item in printed.over_speed}
    for condition, level in (("1", 81.3), ("3", 84.2), ("6", 77.3)):
        assert f"{ours[condition]:.1f} against {level} dB in condition {condition}" in text
    assert ("The paper's level falls from condition 5 to 6" in text) == (ours["6"] >= ours["5"])


def test_rank_and_next_measurement_are_said(blocks, printed):
    found = printed.calibration
    told = [b.text for b in blocks if isinstance(b, Paragraph) and b.text.startswith("The levels see")]
    assert told[0].startswith(f"The levels see {found.rank} of 2 directions among the parameters")
    assert f"Chi square is {found.chi_square:.3g} with 0 degrees of freedom" in told[0]
    best = found.next_measurements[0]
    row = table(blocks, "next-measurements").rows[0]
    assert row[0] == pytest.approx(best.condition.train_speed_km_h)
    assert 0.0 < row[4] <= 100.0
    sentences = [text for b in blocks if isinstance(b, Sentences) for text in b.items]
    assert any(text.startswith("What would tell most next is a level at ") for text in sentences)


def test_another_fleet_gets_no_numbers_of_the_paper(tmp_path):
    fleet = tmp_path / "fleet.toml"
    text = plain_fleet("reference-drive").read_text(encoding="utf-8")
    fleet.write_text(text.replace("paper", "data sheet"), encoding="utf-8")
    level = '[[level]]\ncondition = "{}"\ndistance_m = {}\nlevel_db = {}\n'
    campaign = tmp_path / "campaign.toml"
    campaign.write_text(
        'schema = "tdacoustic-campaign/1"\norigin = "measured"\nfleet = "fleet.toml"\n'
        + level.format("5", 4.0, 90.0)
        + level.format("6", 4.0, 97.0)
        + level.format("6", 7.5, 91.0),
        encoding="utf-8",
    )
    result = td.calibrate(campaign, tmp_path / "store")
    document = calibration_report(result)
    page = render_html(document)
    assert "the paper" not in page.lower().replace("on white paper", "")
    elements = {e.name: e for e in figure(list(walk(document.sections)), "calibration-over-speed").elements}
    assert len(elements["level, measured (± 1 σ)"].x) == 2  # what was measured at 7.5 m is not drawn at 4 m
