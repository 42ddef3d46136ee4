"""Tables and sections of patterns and studies, from a small prediction."""

import math

import pytest
from plain_fleets import plain_fleet

import tdacoustic as td
from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.document import Details, FigureBlock, Notice, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.matplotlib_renderer import render_png
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.reporting.sections.design_sweeps import design_sweeps
from tdacoustic.reporting.sections.directivity import directivity
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.paper_features import features_words, paper_features
from tdacoustic.reporting.sections.sensitivity import sensitivity
from tdacoustic.reporting.sections.words import slug
from tdacoustic.tables import COLUMNS, csv_text

ASKED = """
[[sweep]]
name = "Damping"
parameters = { "gear_dynamics.mesh_damping_ratio" = [0.01, 0.3, 2] }
conditions = ["1", "6"]

[[sweep]]
name = "Damping and torque"
parameters = { "gear_dynamics.mesh_damping_ratio" = [0.02, 0.1], "operation.torque_n_m" = [3000, 6000, 1000] }
conditions = ["5"]

[[reference]]
quantity = "spl_4m_db"
condition = "3"
value = 88.3
kind = "measured"
origin = "paper, section 5.1"

[[reference]]
quantity = "spl_4m_db"
condition = ["4", "5"]
value = 88
origin = "paper, section 5.1"

[[feature]]
name = "Level over speed"
quantity = "spl_4m_db"
shape = "rises_then_falls"
origin = "paper, Fig. 16"

[[feature]]
name = "Level over speed rises"
quantity = "spl_4m_db"
shape = "rises"
origin = "made up"

[[feature]]
name = "Silent"
quantity = "structure_spl_4m_db"
shape = "flat"
origin = "made up"
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studies")
    path = folder / "fleet.toml"
    path.write_text(plain_fleet("crrc-freight").read_text(encoding="utf-8") + ASKED, encoding="utf-8")
    return td.predict(path, folder / "store")


def _summary(result):
    return [item for block in predicted_report(result).summary if isinstance(block, Sentences) for item in block.items]


def parts(section, kind):
    return [block for block in walk([section]) if isinstance(block, kind)]


def rows_of(section, name):
    (table,) = (table for table in parts(section, Table) if table.name == name)
    return [dict(zip((column.key for column in table.columns), row, strict=True)) for row in table.rows]


def test_every_table_has_its_columns_and_is_written(result):
    for name in ("patterns", "pattern_correlation", "sensitivity", "references", "features", "sweep_points", "sweeps"):
        assert list(result.tables[name].columns) == COLUMNS[name].split()
        assert csv_text(result.tables[name]).startswith(COLUMNS[name].split()[0])


def test_the_tables_say_what_the_studies_found(result):
    features = result.tables["features"].set_index("feature")
    assert features.loc["Silent", "verdict"] == "not determined"
    assert math.isnan(features.loc["Silent", "margin"])
    assert features.loc["Level over speed", "verdict"] != features.loc["Level over speed rises", "verdict"]
    assert set(features["margin_unit"]) == {"dB"}
    references = result.tables["references"]
    assert references[["unit", "difference_unit"]].to_numpy().tolist() == [["dB", "dB"]] * 2
    assert (references["model_value"] - references["reference_value"]).tolist() == pytest.approx(
        references["difference"].tolist()
    )
    levels = result.tables["conditions"].set_index("condition")["spl_4m_db"]
    assert references["model_value"][0] == pytest.approx(levels["3"])


def test_the_sweeps_in_long_form(result):
    sweeps, points = result.tables["sweeps"], result.tables["sweep_points"]
    assert len(sweeps) == 3 * 2 + 6
    assert len(points) == 3 + 6 * 2
    wide = points[points["sweep"] == "Damping and torque"].pivot(index="point", columns="parameter", values="value")
    assert wide["operation.torque_n_m"].tolist() == [3000.0, 6000.0, 1000.0] * 2
    refused = sweeps[sweeps["reason"] != ""]
    assert refused["point"].tolist() == [3.0, 3.0]
    assert refused["spl_4m_db"].isna().all()


def test_the_section_on_features(result):
    section = paper_features(result)
    verdicts = [row["verdict"] for row in rows_of(section, "features")]
    assert sorted(verdicts) == ["not determined", "not reproduced", "reproduced"]
    texts = [block.text for block in parts(section, Paragraph)]
    assert "Of 3 features 1 is reproduced, 1 is not, and 1 cannot be said." in texts
    statements, _, _ = parts(section, Sentences)
    assert [text.partition(": ")[0] for text in statements.items] == [
        "Level at 4 m rises, then falls with speed (paper, Fig. 16)",
        "Level at 4 m rises with speed (made up)",
        "Structure's level at 4 m does not change with speed (made up)",
    ]
    (figure,) = parts(section, FigureBlock)
    assert {element.name for element in figure.figure.elements} >= {"this model", "printed, measured"}
    words = features_words(result)
    assert words.startswith("of 3 features of the paper 1 is reproduced, 1 is not, and 1 cannot be said; not ")
    assert words.endswith("not determined: Silent")
    assert any(text == sentence(words) for text in _summary(result))


def test_the_section_on_design_sweeps(result):
    section = design_sweeps(result)
    (notice,) = parts(section, Notice)
    assert notice.text.startswith("1 of 3 points cannot be: [gear_dynamics]: mesh_damping_ratio must be <= 1")
    lines, heat = (block.figure for block in parts(section, FigureBlock))
    assert lines.x_axis.log  # 0.01 to 0.3
    assert [line.name for line in lines.elements] == ["condition 1", "condition 6"]
    assert heat.elements[0].x.tolist() == [1000.0, 3000.0, 6000.0]  # sorted, whatever the file's order
    rows = rows_of(section, "sweep-damping-and-torque-points")
    assert "each condition has a scale of its own" in heat.caption
    assert any("is operation.torque_n_m." in block.text for block in parts(section, Paragraph))
    z = heat.elements[0].z
    assert z[0].tolist() == pytest.approx([rows[2]["condition_5"], rows[0]["condition_5"], rows[1]["condition_5"]])


def test_the_section_on_sensitivities(result):
    section = sensitivity(result)
    (figure,) = parts(section, FigureBlock)
    assert len(figure.figure.categories) <= 10
    rows = rows_of(section, "sensitivity-total")
    by_key = {row["parameter"]: row for row in rows}
    assert by_key["masuda.constant_db"]["words"] == "Masuda constant"
    assert by_key["gear_pair.1.face_width_mm"]["value"] == "120 mm"
    assert by_key["gear_pair.1.profile_shift.2"]["value"] == "\N{MINUS SIGN}0.59026"
    (whole,) = [block for block in parts(section, Table) if block.name == "sensitivity-total"]
    titles = [column.title for column in whole.columns]
    assert titles[4] == "Condition 1" and "Helix 12°" in titles
    assert any(block.text.startswith("Slopes of the level at 4 m") for block in parts(section, Paragraph))
    assert {block.summary for block in parts(section, Details)} >= {"Parameters not varied"}


def test_the_section_on_directions_takes_its_numbers_from_the_prediction(result):
    """Point sources in free space at two places: a shape there is none of, so the housing's own test holds the rest."""
    found = directivity(result)
    patterns = result.tables["patterns"]
    if found is None:
        assert (patterns["range_db"] < 0.05).all()
    else:
        rows = rows_of(found, "directivity-conditions")
        speeds = patterns[patterns["sweep"] == "speed"]
        assert [row["range_db"] for row in rows] == pytest.approx(speeds["range_db"].tolist())


def test_pictures_and_page(result):
    document = predicted_report(result)
    names = [section.id for section in document.sections]
    assert names.index("references") < names.index("design-sweeps") < names.index("sensitivity")
    for section in (paper_features(result), design_sweeps(result), sensitivity(result)):
        for block in parts(section, FigureBlock):
            assert render_png(block.figure)


def test_a_fleet_that_asks_for_nothing_has_sensitivities_alone(tmp_path):
    fleet = load_fleet(plain_fleet("reference-drive"))
    found = td.predict(fleet, tmp_path / "store")
    assert paper_features(found) is None
    assert design_sweeps(found) is None
    assert sensitivity(found) is not None
    assert features_words(found) == ""
    assert not {"references", "features", "sweeps", "sweep_points"} & set(found.tables)
    scan = next(record for _, record in found.records if record.step == "responses")
    assert '"scan":false' in scan.settings


def test_anchors_of_names_that_differ_in_a_hyphen():
    assert slug("sweep", "a b") == "sweep-a-b"
    assert len({slug("sweep", name) for name in ("a b", "a-b", "a.b", "a_b")}) == 4
