"""Tables, section and words of studies over ranges: from a small prediction, and from made-up levels."""

import dataclasses
import math
import re

import numpy as np
import pytest
from plain_fleets import plain_fleet

import tdacoustic as td
from tdacoustic.fleet.design_sweep import DesignSweep, Range
from tdacoustic.reporting.document import Details, FigureBlock, Notice, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.matplotlib_renderer import render_png
from tdacoustic.reporting.sections.design_study_words import left_out_words, study_words
from tdacoustic.reporting.sections.design_sweeps import design_sweeps
from tdacoustic.reporting.sections.provenance import MOST_OF_A_STEP, steps_of
from tdacoustic.studies import QUANTITIES, sweep_sensitivity_of
from tdacoustic.studies.design_sweeps import SweepResult
from tdacoustic.studies.designs import coordinates, points_of
from tdacoustic.tables import COLUMNS, csv_text
from tdacoustic.tables.sweeps import RATTLES, sweep_tables

ASKED = """
[[sweep]]
name = "Spread"
sampling = "latin_hypercube"
points = 60
conditions = ["1", "5"]
[sweep.parameters]
"masuda.constant_db" = { from = 18, to = 26 }
"gear_dynamics.mesh_damping_ratio" = { from = 0.02, to = 0.2, scale = "log" }
"gear_pair.1.teeth.1" = { from = 31, to = 32 }

[[sweep]]
name = "Indices"
sampling = "saltelli"
base_points = 16
conditions = ["5"]
parameters = { "masuda.constant_db" = { from = 18, to = 26 }, "model.motor_gain_db" = { from = -3, to = 3 } }
"""
KEYS = ("masuda.constant_db", "gear_dynamics.mesh_damping_ratio", "model.motor_gain_db")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studies")
    path = folder / "fleet.toml"
    path.write_text(plain_fleet("crrc-freight").read_text(encoding="utf-8") + ASKED, encoding="utf-8")
    return td.predict(path, folder / "store")


def parts(blocks, kind):
    return [block for block in walk(blocks) if isinstance(block, kind)]


def subsection(result, name):
    return next(section for section in design_sweeps(result).blocks if getattr(section, "title", "") == name)


def test_the_tables_of_a_study(result):
    table = result.tables["sweep_sensitivity"]
    assert list(table.columns) == COLUMNS["sweep_sensitivity"].split()
    assert csv_text(table).startswith(
        "sweep,parameter,range_from,range_to,scale,condition,level_of,measure,value,low,high"
    )
    spread = table[table["sweep"] == "Spread"]
    assert set(spread["measure"]) == {"standardised_regression", "rank_correlation", "change_over_range_db"}
    assert len(spread) == 3 * 3 * 3  # parameters, levels, measures
    assert (spread[["condition", "level_of"]].drop_duplicates().to_numpy().tolist()) == [
        ["1", "condition"],
        ["5", "condition"],
        ["", "energy_mean"],
    ]
    known = table.dropna(subset=["value"])
    assert (known["low"] <= known["high"]).all()
    assert set(table[table["value"].isna()]["parameter"]) == {"gear_pair.1.teeth.1"}  # 31 wherever the gears can be
    indices = table[table["sweep"] == "Indices"]
    assert set(indices["measure"]) >= {"first_order_index", "total_index"}
    assert set(indices["level_of"]) == {"condition"}
    sweeps = result.tables["sweeps"]
    assert len(sweeps) == 60 * 2 + 16 * 4
    teeth = result.tables["sweep_points"].query("parameter == 'gear_pair.1.teeth.1'")
    assert set(teeth["value"]) == {31.0, 32.0}
    refused = int((teeth["value"] == 32.0).sum())
    assert set(spread["n_refused"]) == {float(refused)}  # the stated centre distance has no room for 32 teeth
    assert set(spread["n_used"]) == {60.0 - refused}


def test_the_section_of_a_hypercube(result):
    section = subsection(result, "Spread")
    (notice,) = parts([section], Notice)
    assert "points cannot be: [[gear_pair]] 1: no helix angle gives a centre distance" in notice.text
    texts = [block.text for block in parts([section], Paragraph)]
    assert any(text.startswith("60 points of a Latin hypercube") for text in texts)
    ranges = next(table for table in parts([section], Table) if table.name.endswith("-ranges"))
    spread = {row[4]: row[3] for row in ranges.rows}
    assert spread["gear_dynamics.mesh_damping_ratio"] == "each ratio as likely"
    assert spread["gear_pair.1.teeth.1"] == "each as likely, whole numbers alone"
    figures = [block.figure for block in parts([section], FigureBlock)]
    assert [bars.name for bars in figures[0].elements] == ["condition 1", "condition 5", "energy mean"]
    assert len(figures) == 1 + 3
    assert {figure.x_axis.scale for figure in figures[1:]} == {"linear", "log"}
    assert all(len(figure.elements[0].x) == 60 - int(notice.text.split(" of ")[0]) for figure in figures[1:])
    for figure in figures:
        assert render_png(figure)


def test_the_section_of_saltellis_design(result):
    section = subsection(result, "Indices")
    assert any("Saltelli's design of 16 base points" in block.text for block in parts([section], Paragraph))
    figures = [block.figure for block in parts([section], FigureBlock)]
    assert [bars.name for bars in figures[0].elements] == ["on its own (first order)", "with interactions (total)"]
    assert [bars.name for bars in figures[1].elements] == ["condition 5"]
    assert len(figures[2].elements[0].x) == 2 * 16  # rows A and B
    assert render_png(figures[0])
    assert any(block.summary == "Sensitivities by parameter and condition" for block in parts([section], Details))


def made_up(levels_of, sampling="latin_hypercube", conditions=("1", "2"), **more):
    ranges = zip(KEYS, (Range(18.0, 26.0), Range(0.02, 0.2, "log"), Range(-3.0, 3.0)), strict=True)
    sweep = DesignSweep(name="made up", sampling=sampling, parameters=tuple(ranges), **(more or {"points": 400}))
    points = points_of(sweep)
    levels = levels_of(coordinates(sweep, points))
    values = np.full((*levels.shape, len(QUANTITIES)), 1.0)
    values[..., QUANTITIES.index("spl_4m_db")] = levels
    return SweepResult(sweep, points, conditions, np.ones(levels.shape), values, ("",) * len(points))


def said(result, found):
    return " ".join(study_words(result.fleet, sweep_sensitivity_of(found)))


def both(level):
    return np.stack([level, level], axis=1)


def test_words_on_a_straight_line(result):
    text = said(result, made_up(lambda unit: both(80.0 + unit @ [8.0, -4.0, 0.0])))
    assert "it moves most with Masuda constant (+8.0 dB over its range, +8.0 to +8.0) and mesh damping ratio (" in text
    assert "\N{MINUS SIGN}4.0 dB over its range" in text
    assert "The line has 100 % of the variance (R²), so that the coefficients describe it." in text
    scattered = np.random.default_rng(0).normal(size=400)
    text = said(result, made_up(lambda unit: both(80.0 + unit @ [8.0, -4.0, 0.0] + scattered)))
    assert "Of motor gain the intervals leave open even the sign." in text


def test_words_on_a_line_that_explains_little(result):
    bent = said(result, made_up(lambda unit: both(80.0 + 30.0 * unit[:, 0] ** 12)))
    assert "a line between ranks 100 %: the level bends, but mostly only rises or falls" in bent
    turned = said(result, made_up(lambda unit: both(80.0 + 30.0 * (unit[:, 0] - 0.5) ** 2)))
    assert 'for coefficients to tell what decides it. Take sampling = "saltelli".' in turned


def test_words_on_interaction(result):
    def product(unit):
        return both(80.0 + 8.0 * (unit[:, 0] - 0.5) * (unit[:, 1] - 0.5))

    text = said(result, made_up(product, "saltelli", base_points=1024))
    alone = re.search(r"Parameters on their own make about (\d+) % of the variance, interactions the rest", text)
    assert int(alone[1]) <= 10
    assert "beyond the intervals" in text.lower()
    assert "Motor gain could lie anywhere in the range: total index below 5 %." in text
    alone = said(result, made_up(lambda unit: both(80.0 + 8.0 * unit[:, 0]), "saltelli", base_points=1024))
    assert "It is decided by Masuda constant with 100 % of its variance (" in alone
    assert "beyond the intervals" not in alone.lower()
    assert "These intervals are wide" not in alone
    few = said(result, made_up(lambda unit: both(80.0 + 8.0 * unit[:, 0]), "saltelli", base_points=16))
    assert "These intervals are wide; four times as many base points halve them." in few


def test_too_few_points_are_said(result):
    text = said(result, made_up(lambda unit: both(80.0 + unit[:, 0]), points=10))
    assert text == (
        "Nothing can be said of the energy mean over the conditions: it does not vary, or fewer than 16 points have it."
    )
    text = said(result, made_up(lambda unit: both(80.0 + unit[:, 0]), "saltelli", base_points=8))
    assert "fewer than 16 base points have it" in text


def with_gaps(found, where, names):
    values = found.values.copy()
    values[np.ix_(where, [1], [QUANTITIES.index(name) for name in names])] = np.nan
    return dataclasses.replace(found, values=values)


def test_points_left_out_are_counted_in_words_and_tables(result):
    found = with_gaps(made_up(lambda unit: both(80.0 + unit[:, 0])), [3, 5, 8], QUANTITIES)
    study = sweep_sensitivity_of(found)
    assert left_out_words(study).startswith(
        "Of 400 points in condition 2 3 rattle. Where the harmonic balance finds no"
    )
    silent = with_gaps(found, [7], ["spl_4m_db"])
    assert "in condition 2 3 rattle and 1 makes no sound" in left_out_words(sweep_sensitivity_of(silent))
    assert left_out_words(sweep_sensitivity_of(made_up(lambda unit: both(80.0 + unit[:, 0])))) == ""
    tables = sweep_tables([found], [study])
    gaps = tables["sweeps"][tables["sweeps"]["reason"] == RATTLES]
    assert gaps[["point", "condition"]].to_numpy().tolist() == [[4.0, "2"], [6.0, "2"], [9.0, "2"]]
    of_second = tables["sweep_sensitivity"].query("condition == '2'")
    assert set(of_second["n_rattling"]) == {3.0}
    assert set(of_second["n_used"]) == {397.0}


def test_a_study_that_says_nothing_has_its_row_and_no_figure(result):
    found = made_up(lambda unit: both(np.full(len(unit), 80.0)))
    study = sweep_sensitivity_of(found)
    table = sweep_tables([found], [study])["sweep_sensitivity"]
    assert len(table) == 3 * 3
    assert table["value"].isna().all() and (table["measure"] == "").sum() + table["measure"].isna().sum() == 9
    studies = dataclasses.replace(result.studies, sweeps=(found,), sweep_sensitivities=(study,))
    section = design_sweeps(dataclasses.replace(result, studies=studies))
    assert parts([section], FigureBlock) == []
    assert any("Nothing can be said" in item for block in parts([section], Sentences) for item in block.items)


def test_many_points_and_conditions_are_drawn_in_part(result):
    names = tuple(f"c{number}" for number in range(12))
    found = made_up(lambda unit: 80.0 + unit[:, :1] * np.arange(1.0, 13.0), conditions=names, points=2500)
    studies = dataclasses.replace(result.studies, sweeps=(found,), sweep_sensitivities=(sweep_sensitivity_of(found),))
    section = design_sweeps(dataclasses.replace(result, studies=studies))
    figures = [block.figure for block in parts([section], FigureBlock)]
    assert [bars.name for bars in figures[0].elements] == [*(f"condition c{k}" for k in range(7)), "energy mean"]
    assert "7 of 12 conditions are drawn" in figures[0].caption
    assert len(figures[1].elements[0].x) == 1000
    assert "1000 of 2500 points" in figures[1].caption
    table = next(table for table in parts([section], Table) if table.name.endswith("-points"))
    assert len(table.rows) == 300 and "the first 300 of 2500 points" in table.caption


def test_steps_done_very_often_are_counted(result):
    key, record = next(pair for pair in result.records if pair[1].step == "design-sweep")
    many = tuple((f"{number:064x}", record) for number in range(MOST_OF_A_STEP + 30))
    (block,) = steps_of(dataclasses.replace(result, records=((key, record), *many)))
    (table,) = block.blocks
    assert block.summary == f"{MOST_OF_A_STEP + 31} steps"
    assert len(table.rows) == MOST_OF_A_STEP + 1
    assert table.rows[-1][0] == "31 more of this step"
    assert math.isclose(len(steps_of(result)[0].blocks[0].rows), len(result.records))
