"""The report's section on maps close to the housing, their rows and their arrays."""

import dataclasses
import math

import h5py
import numpy as np
import pytest
from made_up_maps import bump, by_hand
from plain_fleets import plain_fleet

from tdacoustic.drive import DriveModel
from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.document import Details, FigureBlock, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.figure import Heatmap, Line, Markers
from tdacoustic.reporting.matplotlib_renderer import plot
from tdacoustic.reporting.plotly_renderer import render_plotly
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.reporting.sections.near_field import near_field_section
from tdacoustic.results import FleetPrediction, LogInput
from tdacoustic.tables import predicted_tables
from tdacoustic.tables.prediction_file import ModelArrays, write_prediction_file

FLEET = load_fleet(plain_fleet("crrc-freight"))
BETWEEN, ABOVE = (0.0, 0.5, 0.0), (0.0, 0.0, 0.8)


@pytest.fixture(scope="module")
def prediction():
    return DriveModel(FLEET).evaluate()


def result_with(prediction, *maps, fleet=FLEET):
    held = dataclasses.replace(prediction, maps=maps)
    return FleetPrediction(fleet, held, {}, (LogInput("fleet.toml", "0" * 64, 0, "TOML"),), ())


def said(section):
    blocks = list(walk([section]))
    found = [block.text for block in blocks if isinstance(block, Paragraph)]
    return "\n".join(found + [item for block in blocks if isinstance(block, Sentences) for item in block.items])


def figures(section):
    return {block.figure.name: block.figure for block in walk([section]) if isinstance(block, FigureBlock)}


def outside_alone(field):
    """The same without levels inside."""
    maps = []
    for held in field.planes:
        levels = {path: np.where(held.plane.place == 2, math.nan, values) for path, values in held.level_db.items()}
        maps.append(dataclasses.replace(held, level_db=levels))
    return dataclasses.replace(field, planes=tuple(maps))


def test_without_maps_there_is_no_section(prediction):
    assert near_field_section(result_with(prediction)) is None
    silent = by_hand(lambda points: np.full(len(points), math.nan))
    assert near_field_section(result_with(prediction, silent)) is None


def test_where_the_highest_levels_are_and_what_the_paper_has(prediction):
    def louder_inside(points):
        return bump(BETWEEN)(points) + 60.0 * (np.abs(points) < np.array([0.29, 0.19, 0.19])).all(axis=1)

    text = said(near_field_section(result_with(prediction, by_hand(louder_inside, condition="5"))))
    assert "the highest level outside is 100.0 dB at x 0, y 0.5, z 0 m, between the motor and the housing; " in text
    assert "the highest level inside is 148.0 dB at x 0, y 0.1, z 0 m." in text
    assert "inside it is louder than anywhere outside in condition 5." in text
    assert "Condition 5, as the maps show it: outside " in text
    assert "dB at the darkest point; inside it is up to 48 dB above the brightest outside." in text
    text = said(near_field_section(result_with(prediction, outside_alone(by_hand(bump(BETWEEN), condition="5")))))
    assert "the highest level outside is 100.0 dB at x 0, y 0.5, z 0 m, between the motor and the housing." in text
    assert "here the highest level outside lies between them in condition 5." in text
    assert "above the housing's top" not in text
    assert "inside it is" not in text
    assert "dB at the darkest point." in text


def test_another_place_is_said_as_such(prediction):
    fields = (by_hand(bump(ABOVE), ("motor", "mesh"), "1"), by_hand(bump(ABOVE, 90.0), ("motor", "mesh"), "3"))
    text = said(near_field_section(result_with(prediction, *fields)))
    assert "here it lies elsewhere in conditions 1 and 3" in text
    assert "inside it is quieter than the loudest point outside in conditions 1 and 3." in text
    assert "0.40 m from the source of the meshing noise" in text
    assert 'which [masuda] placement = "inside" computes' in text
    assert "conditions 1 and 3 correlate in pairs with 1.00 (1 is the same pattern)" in text
    assert "remains almost unchanged over speed" in text
    free = dataclasses.replace(fields[0], free_hz=(1852.0, 2778.0))
    text = said(near_field_section(result_with(prediction, free)))
    assert "In condition 1 lines of point sources at 1852 to 2778 Hz lie beyond the housing's range" in text


def test_what_stands_for_the_inside_is_said(prediction):
    field = by_hand(bump(BETWEEN), condition="5")
    maps = []
    for held in field.planes:
        total = np.where(held.plane.place == 2, math.nan, held.level_db["total"])
        maps.append(dataclasses.replace(held, level_db={**held.level_db, "total": total}))
    field = dataclasses.replace(field, planes=tuple(maps))
    section = near_field_section(result_with(prediction, field))
    assert "of what the walls send inwards (structure), which the total outside does not add" in said(section)
    (heat,) = [one for one in figures(section)["near-field-5-xy"].elements if isinstance(one, Heatmap)]
    assert np.isfinite(heat.z).all()


def test_three_maps_a_condition_on_one_scale(prediction):
    fields = (by_hand(bump(BETWEEN), ("motor", "mesh"), "5"), by_hand(bump(ABOVE), ("motor", "mesh"), "1"))
    section = near_field_section(result_with(prediction, *fields))
    found = figures(section)
    assert list(found) == [f"near-field-{condition}-{plane}" for condition in "51" for plane in ("xy", "xz", "yz")]
    folded = [block for block in section.blocks if isinstance(block, Details)]
    assert [block.summary for block in folded] == ["Maps of condition 1"]
    scales = {
        next(e for e in found[f"near-field-5-{p}"].elements if isinstance(e, Heatmap)).z_axis.limits
        for p in ("xy", "xz")
    }
    assert len(scales) == 1
    xy = found["near-field-5-xy"].elements
    assert [e.name for e in xy if isinstance(e, Line)] == ["housing", "within 3 dB of the highest level outside"]
    assert "source: motor" in [e.name for e in xy if isinstance(e, Markers)]
    assert all(figure.equal for figure in found.values())
    rows = [row for block in section.blocks if isinstance(block, Table) for row in block.rows]
    assert ("5", "outside", "total") in [row[:3] for row in rows]


def test_both_renderers_draw_a_metre_as_long_both_ways(prediction):
    figure = figures(near_field_section(result_with(prediction, by_hand(bump(BETWEEN)))))["near-field-1-yz"]
    layout = render_plotly(figure)["layout"]
    assert layout["yaxis"]["scaleanchor"] == "x"
    axes = plot(figure).axes[0]
    assert axes.get_aspect() == 1.0
    box = axes.get_position()
    assert box.width > 0.0


def test_the_section_stands_in_the_report(prediction):
    document = predicted_report(result_with(prediction, by_hand(bump(BETWEEN))))
    assert "near-field" in [section.id for section in document.sections]


def test_rows_and_arrays(prediction, tmp_path):
    field = by_hand(bump(BETWEEN), condition="5")
    held = dataclasses.replace(prediction, maps=(field,))
    table = predicted_tables(held, 3000.0)["near_field"]
    assert len(table) == 3 * 21 * 21  # made-up walls have no thickness
    row = table[(table["plane"] == "XY") & np.isclose(table["x_m"], 0.0) & np.isclose(table["y_m"], 0.5)].iloc[0]
    assert (row["condition"], row["place"], row["z_m"], row["level_db"]) == ("5", "outside", 0.0, 100.0)
    assert row["motor_level_db"] == row["structure_level_db"] == 100.0
    assert set(table["place"]) == {"outside", "inside"}
    alone = predicted_tables(dataclasses.replace(prediction, maps=(outside_alone(field),)), 3000.0)["near_field"]
    assert set(alone["place"]) == {"outside"}
    assert "near_field" not in predicted_tables(prediction, 3000.0)
    write_prediction_file(tmp_path / "result.h5", ModelArrays("drive", held, 3000.0))
    with h5py.File(tmp_path / "result.h5") as file:
        plane = file["model/conditions/5/near_field/XZ"]
        assert plane.attrs["at_m"] == 0.0
        assert plane["total_level"].shape == (21, 21)
        assert plane["total_level"].attrs["unit"] == "dB re 20 uPa"
        assert "near_field" not in file["model/conditions/1"]
