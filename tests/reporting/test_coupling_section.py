"""What the report says of one-way against two-way coupling: its figures, tables and words are the comparison's."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_modes import fleet_text, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.drive import DriveModel
from tdacoustic.reporting.document import FigureBlock, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.figure import Line, Rule
from tdacoustic.reporting.matplotlib_renderer import render_svg
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.reporting.sections.coupling import coupling_section
from tdacoustic.results import FleetPrediction, LogInput


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The small housing's drive with either coupling."""
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(fleet_text("", 700), encoding="utf-8")
    fleet = td.load_fleet(path)
    housing = sound_of_made_up_modes(fleet)
    found = {}
    for name in ("one_way", "two_way"):
        model = DriveModel(fleet.replaced({"model.coupling": name}), housing=housing)
        prediction = model.with_coupling(model.evaluate())
        found[name] = FleetPrediction(model.fleet, prediction, {}, (LogInput("fleet.toml", "0" * 64, 0, "TOML"),), ())
    return found


def words(blocks):
    texts = [block.text for block in walk(blocks) if isinstance(block, Paragraph)]
    return " ".join([*texts, *(item for block in walk(blocks) if isinstance(block, Sentences) for item in block.items)])


def figures(section):
    return {block.figure.name: block.figure for block in walk([section]) if isinstance(block, FigureBlock)}


def test_without_a_housing_there_is_no_section(results):
    result = results["one_way"]
    assert coupling_section(replace(result, prediction=replace(result.prediction, coupling=None))) is None


def test_it_says_which_coupling_the_report_has(results):
    for name, plain in (("one_way", "one-way"), ("two_way", "two-way")):
        said = words([coupling_section(results[name])])
        assert f'All other numbers of this report are {plain} ([model] coupling = "{name}")' in said
    document = predicted_report(results["two_way"])
    said = words([*document.summary, *document.sections])
    assert "The coupling is two-way" in said
    assert "in a housing that gives way under them" in said
    assert "does not act back on the gears" not in said


def test_extremes_in_words_are_those_of_the_curves(results):
    coupling = results["one_way"].prediction.coupling
    mesh = [held.mesh_hz for held in coupling.conditions if held.mesh_hz <= 700.0]
    curves = coupling.curves
    held = (curves.frequency_hz >= min(mesh)) & (curves.frequency_hz <= max(mesh))
    values = 20.0 * np.log10(curves.bearing_force_n_per_um[1] / curves.bearing_force_n_per_um[0])[..., held]
    said = words([coupling_section(results["one_way"])]).replace("\N{MINUS SIGN}", "-")
    assert f"by {values.min():+.1f} dB (at " in said
    assert f" to {values.max():+.1f} dB (at " in said
    changes = [two - one for c in coupling.conditions for one, two in [c.structure_db] if one is not None]
    assert f"The housing's own sound at 4 m changes by {min(changes):+.1f} dB" in said


def test_figures_show_either_coupling_and_the_mesh_lines(results):
    shown = figures(coupling_section(results["two_way"]))
    names = {
        "coupling-receptance",
        "coupling-pinion",
        "coupling-wheel",
        "coupling-forces-pinion",
        "coupling-forces-wheel",
    }
    assert set(shown) == names
    curves = results["two_way"].prediction.coupling.curves
    lines = [element for element in shown["coupling-receptance"].elements if isinstance(element, Line)]
    assert [(line.name, line.style) for line in lines] == [("one-way", "dashed"), ("two-way", "solid")]
    assert np.array_equal(lines[1].y, curves.receptance_m_per_n[1])
    rules = [element for element in shown["coupling-wheel"].elements if isinstance(element, Rule)]
    assert [rule.label for rule in rules] == ["1", "2", "3", "4", "5"]  # the sixth meshes at 1001 Hz, beyond the modes
    assert all(render_svg(figure) for figure in shown.values())


def test_a_condition_without_a_motion_is_said_and_left_empty(results):
    result = results["one_way"]
    coupling = result.prediction.coupling
    first, *rest = coupling.conditions
    unknown = replace(first, dte_pp_m=(first.dte_pp_m[0], None), structure_db=(60.0, None), total_db=(70.0, None))
    changed = replace(coupling, conditions=(unknown, *rest))
    section = coupling_section(replace(result, prediction=replace(result.prediction, coupling=changed)))
    assert "In condition 1 the balance finds no stable motion with the other coupling" in words([section])
    (table,) = (block for block in walk([section]) if isinstance(block, Table) and block.name == "coupling-conditions")
    assert table.rows[0][3] is None
    assert table.rows[1][3] is not None


def test_one_condition_makes_a_whole_sentence(results):
    result = results["one_way"]
    coupling = result.prediction.coupling
    alone = replace(coupling, conditions=coupling.conditions[:1])
    said = words([coupling_section(replace(result, prediction=replace(result.prediction, coupling=alone)))])
    assert "in condition 1 with two-way coupling." in said
    assert "Between 20 Hz and 700 Hz" in said.replace(".0 Hz", " Hz")


def test_levels_that_do_not_change_have_no_signed_nothing(results):
    result = results["one_way"]
    coupling = result.prediction.coupling
    same = [replace(held, total_db=(80.0, 80.0 - 0.01 * n)) for n, held in enumerate(coupling.conditions[:3])]

    def of(*conditions):
        held = replace(coupling, conditions=conditions)
        return words([coupling_section(replace(result, prediction=replace(result.prediction, coupling=held)))])

    assert "The total at 4 m does not change with two-way coupling (less than 0.05 dB)." in of(*same)
    assert "The total at 4 m does not change in condition 1 with two-way coupling" in of(same[0])
    louder = replace(same[2], total_db=(80.0, 81.0))
    text = of(*same[:2], louder)
    assert "The total at 4 m changes by 0.0 dB (condition 2) to +1.0 dB (condition 3) with two-way coupling." in text
