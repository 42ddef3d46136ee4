"""What the report says of a housing's insertion loss; the curves are put in by hand."""

import dataclasses

import numpy as np
import pytest
from plain_fleets import plain_fleet

from tdacoustic.drive import DriveModel
from tdacoustic.drive.insertion_loss import AirLosses, InsertionLoss, MeshLoss
from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.document import FigureBlock, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.figure import Line, Markers
from tdacoustic.reporting.sections.insertion_loss import insertion_loss_section
from tdacoustic.results import FleetPrediction, LogInput
from tdacoustic.tables import predicted_tables

PLAIN = load_fleet(plain_fleet("crrc-freight"))
LOSSES = (47.0, 34.0, 23.0, 37.0, 24.0, None)
FREQUENCIES = np.geomspace(50.0, 700.0, 60)
BANDS = 1000.0 * 10.0 ** (np.arange(-12, -1) / 10.0)


def held_of(prediction):
    mesh = tuple(
        MeshLoss(
            state.condition.name,
            state.mesh_hz,
            loss,
            40.0 + number,
            None if loss is None else (loss - 1.0 - 3.0 * (number == 4), loss + 1.0 + 4.0 * (number == 4)),
            None if loss is None else (loss - 2.0 - 5.0 * (number == 2), loss + 2.0),
        )
        for number, (state, loss) in enumerate(zip(prediction.conditions, LOSSES, strict=True))
    )
    return InsertionLoss(
        (-0.134, -0.35, 0.0),
        ((1.0, 94.2),),
        413.0,
        AirLosses(0.01, 500.0, 0.00101, 0.0404),
        FREQUENCIES,
        30.0 + 10.0 * np.sin(np.arange(60)),
        np.linspace(26.0, 49.0, 60),
        BANDS,
        np.linspace(45.0, 25.0, len(BANDS)),
        mesh,
    )


def made(**values):
    fleet = PLAIN.replaced({key.replace("__", "."): value for key, value in values.items()}) if values else PLAIN
    prediction = DriveModel(fleet).evaluate()
    prediction = dataclasses.replace(prediction, insertion_loss=held_of(prediction))
    tables = predicted_tables(prediction, 1500.0)
    return FleetPrediction(fleet, prediction, tables, (LogInput("fleet.toml", "0" * 64, 0, "TOML"),), ())


@pytest.fixture(scope="module")
def result():
    return made()


@pytest.fixture(scope="module")
def section(result):
    return insertion_loss_section(result)


def blocks(section, kind):
    return [block for block in walk([section]) if isinstance(block, kind)]


def words(section):
    found = [block.text for block in blocks(section, Paragraph)]
    return "\n".join([*found, *(item for block in blocks(section, Sentences) for item in block.items)])


def test_without_a_housing_there_is_no_section(result):
    bare = dataclasses.replace(result, prediction=dataclasses.replace(result.prediction, insertion_loss=None))
    assert insertion_loss_section(bare) is None


def test_what_it_says(section):
    said = words(section)
    assert "pitch point between the shafts [assumed], at x = −0.134, y = −0.35, z = 0 m in the drive's frame" in said
    assert "In third octaves the housing takes 25 dB (at 630 Hz) to 45 dB (at 63 Hz)" in said
    assert "47 dB in condition 1, 34 dB in condition 2, 23 dB in condition 3" in said
    assert "of condition 6 it is not computed" in said
    assert "from half to twice its value the insertion loss goes from 20 to 29 dB in condition 5." in said
    assert "50 mm off along x, y or z it is 16 to 25 dB in condition 3." in said
    assert "a loss factor of 0.01, an absorption coefficient of 0.04 at 500 Hz" in said
    assert "bare walls alone would give a loss factor of 0.001" in said


@pytest.mark.parametrize(
    ("placement", "said"),
    [
        ("free", 'none of this is taken from it. With placement = "inside", as the paper has it, the meshing noise'),
        ("inside", "here the housing takes 23 to 47 dB from it a second time"),
        ("off", "the meshing noise is no part of the total"),
    ],
)
def test_it_says_what_the_placement_means(placement, said):
    assert said in words(insertion_loss_section(made(masuda__placement=placement)))


def test_figure_and_tables(section):
    (figure,) = [block.figure for block in blocks(section, FigureBlock)]
    names = {element.name for element in figure.elements}
    assert names == {"insertion loss", "its third octaves", "mass law, field incidence", "at mesh frequencies"}
    (marks,) = [element for element in figure.elements if isinstance(element, Markers)]
    assert marks.labels == ("1", "2", "3", "4", "5")
    steps = next(e for e in figure.elements if isinstance(e, Line) and e.name == "its third octaves")
    assert steps.x[1] == pytest.approx(steps.x[2])
    tables = {block.name: block for block in blocks(section, Table)}
    assert [row[2] for row in tables["insertion-loss-at-mesh"].rows] == list(LOSSES)
    assert [row[0] for row in tables["insertion-loss-bands"].rows][:3] == [63.0, 80.0, 100.0]


def test_the_table_has_a_row_for_each_line_band_and_condition(result):
    table = result.tables["insertion_loss"]
    assert table["kind"].value_counts().to_dict() == {"line": 60, "third_octave": 11, "mesh": 6}
    mesh = table[table["kind"] == "mesh"]
    assert mesh["condition"].tolist() == [state.condition.name for state in result.prediction.conditions]
    assert mesh["insertion_loss_db"].tolist()[:5] == list(LOSSES[:5]) and mesh["insertion_loss_db"].isna().iloc[5]
