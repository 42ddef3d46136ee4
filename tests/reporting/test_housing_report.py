"""What the report says of a drive with its housing: paths, directions, and what is added.

The prediction is that of point sources, with a housing, its sound and its directions put in by hand.
"""

import dataclasses
import math

import numpy as np
import pytest
from plain_fleets import plain_fleet

from tdacoustic.drive import DriveModel, HousingFacts, LevelAt, StructureSource
from tdacoustic.fleet import load_fleet
from tdacoustic.radiation import overall_level_db
from tdacoustic.reporting.document import (
    Details,
    Facts,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
    walk,
)
from tdacoustic.reporting.figure import Line, Markers, Rule
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.reporting.sections.run_answer import _louder_words
from tdacoustic.results import FleetPrediction, LogInput

PLAIN = load_fleet(plain_fleet("crrc-freight"))
FACTS = HousingFacts(
    mass_kg=469.3,
    mode_hz=np.array([43.8, 51.7, 58.1, 70.1, 79.2, 84.0, 118.2, 147.7, 230.6, 259.0, 990.0, 1100.0]),
    corrections=12,
    range_hz=(20.0, 1000.0),
    left_share=(0.5, 0.5),
    position_m=(0.0, -0.35, 0.0),
    mesh_m=(0.0, -0.35, 0.55),
    motor_m=(0.0, 0.45, 0.0),
)
STRUCTURE_DB = 70.0
TO_POWER_DB = 23.03
"""Of a level at 4 m in free space."""


def with_structure(sound, adds):
    """A sound with lines of the housing at two harmonics of the mesh, as far as they lie below 1000 Hz."""
    mesh = next(source for source in sound.sources if source.path == "mesh")
    lines = [(n, n * mesh.frequency_hz) for n in (1, 2) if n * mesh.frequency_hz <= FACTS.range_hz[1]]
    heard = [
        StructureSource("structure", f"mesh x{n}", hz, STRUCTURE_DB + TO_POWER_DB - 3.0103, FACTS.position_m)
        for n, hz in lines
    ]
    levels = {(level.receiver, level.path, level.weighting): level for level in sound.levels}
    for (receiver, path, weighting), level in levels.items():
        if path == "structure":
            held = overall_level_db([s.sound_power_level_db - TO_POWER_DB for s in heard])
            levels[receiver, path, weighting] = dataclasses.replace(level, level_db=held)
    for (receiver, path, weighting), level in levels.items():
        if path == "total":
            parts = [levels[receiver, added, weighting].level_db for added in adds]
            total = overall_level_db([part for part in parts if part is not None])
            levels[receiver, path, weighting] = dataclasses.replace(level, level_db=total)
    assert all(isinstance(level, LevelAt) for level in levels.values())
    surface_db = (*sound.surface_db, *(s.sound_power_level_db - TO_POWER_DB for s in heard))
    return dataclasses.replace(
        sound, sources=(*sound.sources, *heard), levels=tuple(levels.values()), surface_db=surface_db
    )


def around(circle, number):
    """A circle with a lobe that turns with its number."""
    lobe = 2.0 * np.cos(2.0 * np.radians(circle.angle_deg) + 0.5 * number)
    return dataclasses.replace(circle, level_db=80.0 + number + lobe)


def housed(adds, facts=FACTS, **values):
    """The modelled side of the demonstration's drive with its housing; ``adds`` as the fleet's keys have it."""
    keys = {key.replace("__", "."): value for key, value in values.items()}
    model = DriveModel(PLAIN.replaced(keys) if keys else PLAIN)
    made = model.evaluate()
    sound = tuple(with_structure(one, adds) for one in made.sound)
    helix = tuple(dataclasses.replace(case, sound=with_structure(case.sound, adds)) for case in made.helix)
    circles = tuple(around(circle, number) for number, circle in enumerate(made.directivity))
    prediction = dataclasses.replace(made, sound=sound, helix=helix, directivity=circles, housing=facts)
    fleet = model.fleet.replaced({"radiation.method": "boundary_elements"})
    return FleetPrediction(fleet, prediction, {}, (LogInput("fleet.toml", "0" * 64, 0, "TOML"),), ())


@pytest.fixture(scope="module")
def result():
    return housed(("motor", "mesh"))


@pytest.fixture(scope="module")
def document(result):
    return predicted_report(result)


def blocks_of(document, kind):
    return [block for block in walk((*document.summary, *document.sections)) if isinstance(block, kind)]


def words(document):
    found = [block.text for block in blocks_of(document, Paragraph)]
    return "\n".join([*found, *(item for block in blocks_of(document, Sentences) for item in block.items)])


def table(document, name):
    (found,) = [block for block in blocks_of(document, Table) if block.name == name]
    return [dict(zip((column.key for column in found.columns), row, strict=True)) for row in found.rows]


def figures(document):
    return {block.figure.name: block.figure for block in blocks_of(document, FigureBlock)}


def sections(document):
    return [section.id for section in document.sections]


# ---------------------------------------------------------------- paths and what the total adds


def test_the_level_names_what_the_total_adds_and_what_stands_beside_it(result, document):
    sound, surface = result.prediction.sound[0], result.prediction.surface
    motor, mesh, structure, total = (sound.level_db(surface, p) for p in ("motor", "mesh", "structure", "total"))
    assert structure == pytest.approx(STRUCTURE_DB, abs=1e-3)
    assert (
        f"level at 4 m {total:.1f} dB (motor {motor:.1f} dB, mesh {mesh:.1f} dB; not added: structure 70.0 dB)"
        in words(document)
    )
    said = words(document)
    assert "The total adds the energies of the motor's tones and the meshing noise; the structure (bearing" in said
    assert 'is shown but not added ([model] gear_path = "masuda", Masuda\'s level already holds what the' in said


@pytest.mark.parametrize(
    ("gear_path", "placement", "adds", "said", "level"),
    [
        (
            "sum",
            "free",
            ("motor", "mesh", "structure"),
            "The total adds the energies of the motor's tones, the meshing noise and the structure (bearing forces "
            "through the housing).",
            "structure 70.0 dB)",
        ),
        (
            "structure",
            "free",
            ("motor", "structure"),
            'the meshing noise is shown but not added ([model] gear_path = "structure").',
            "structure 70.0 dB; not added: mesh ",
        ),
        (
            "masuda",
            "off",
            ("motor",),
            "The total is the motor's tones; the meshing noise and the structure (bearing forces through the housing) "
            'are shown but not added ([model] gear_path = "masuda", [masuda] placement = "off").',
            "; not added: mesh ",
        ),
        (
            "sum",
            "inside",
            ("motor", "mesh", "structure"),
            "The total adds the energies of the motor's tones, the meshing noise and the structure (bearing forces "
            "through the housing).",
            "structure 70.0 dB)",
        ),
    ],
)
def test_the_keys_that_leave_a_path_out_are_named(gear_path, placement, adds, said, level):
    document = predicted_report(housed(adds, model__gear_path=gear_path, masuda__placement=placement))
    assert said in words(document)
    assert level in words(document)


def test_a_silent_total_is_no_level_and_names_what_is_not_added():
    found = housed((), model__gear_path="masuda", masuda__placement="off")
    silent = tuple(
        dataclasses.replace(
            sound,
            sources=tuple(source for source in sound.sources if source.path != "motor"),
            surface_db=tuple(
                level for s, level in zip(sound.sources, sound.surface_db, strict=True) if s.path != "motor"
            ),
            levels=tuple(
                dataclasses.replace(level, level_db=None) if level.path == "motor" else level for level in sound.levels
            ),
        )
        for sound in found.prediction.sound
    )
    prediction = dataclasses.replace(found.prediction, sound=silent)
    document = predicted_report(dataclasses.replace(found, prediction=prediction))
    assert "no level at 4 m (not added: mesh " in words(document)
    assert "The total adds nothing of what is shown; the meshing noise and the structure" in words(document)
    assert [element.name for element in figures(document)["level-over-speed"].elements] == [
        "meshing noise (not added)",
        "structure (not added)",
    ]
    assert render_html(document)


def test_table_and_figure_have_the_structure(result, document):
    rows = table(document, "levels-4-m")
    for row, sound in zip(rows, result.prediction.sound, strict=True):
        assert row["structure_spl_db"] == sound.level_db("4 m", "structure")
        assert row["spl_db"] == sound.level_db("4 m")
    lines = {line.name: line for line in figures(document)["level-over-speed"].elements}
    assert set(lines) == {"total", "motor", "meshing noise", "structure (not added)"}
    assert len({line.color for line in lines.values()}) == 4
    assert lines["structure (not added)"].style == "dotted"
    assert lines["meshing noise"].style == "dashed"


def test_conditions_beyond_the_range_of_the_housing_are_named(result, document):
    assert result.prediction.sound[-1].level_db("4 m", "structure") is None  # mesh at 1001 Hz
    said = words(document)
    assert "Condition 6: no line of the bearing forces lies within 20 to 1000 Hz" in said
    assert (
        "All that the total adds in condition 6 lies outside of the 20 to 1000 Hz that the housing is computed for, so "
        in said
    )


def test_the_method_is_that_of_the_housing(document):
    said = words(document)
    assert "In free space stands the housing, a closed box, computed from 20 to 1000 Hz" in said
    assert "the power of the source is held" in said
    assert "Their volume flow is held, so that the housing changes their power." in said
    assert "Outside of 20 to 1000 Hz point sources radiate as if there were no housing" in said
    assert "is not computed" not in said.replace("how much is not computed", "")
    assert "the housing is not" not in said
    assert "is not modelled" not in said
    assert "nothing is split between the two bearings" not in said
    assert "split between the two bearings of a shaft for the housing alone" in said


def test_a_gain_is_said_and_a_motor_without_sound_has_no_sentence():
    facts = dataclasses.replace(FACTS, motor_m=None)
    document = predicted_report(housed(("motor", "mesh"), facts, model__structure_gain_db=-3.0))
    said = words(document)
    assert "with [model] structure_gain_db = \N{MINUS SIGN}3 dB" in said
    assert "volume flow" not in said
    (listed,) = [block for block in blocks_of(document, Facts) if block.pairs[0].key == "Mass"]
    assert "Sources of the motor" not in [fact.key for fact in listed.pairs]


def test_the_loudest_path_is_one_that_the_total_adds(result):
    assert _louder_words(result).startswith("The louder part of the total is ")
    assert "structure" not in _louder_words(result)
    quiet = housed(("motor", "mesh", "structure"), model__gear_path="sum", masuda__constant_db=-60.0)
    assert _louder_words(quiet).startswith("The loudest part of the total is the motor's tones in ")
    assert _louder_words(housed(("motor",), masuda__placement="off")) == ""


# ---------------------------------------------------------------- tones


def test_tones_are_drawn_by_path_one_condition_in_sight(result, document):
    drawn = figures(document)
    (section,) = [block for block in blocks_of(document, Section) if block.id == "sound-tones"]
    assert [block.figure.name for block in section.blocks if isinstance(block, FigureBlock)] == ["tones-5"]
    (folded,) = [block for block in section.blocks if isinstance(block, Details)]
    assert len(folded.blocks) == len(result.prediction.sound) - 1
    sound = result.prediction.sound[0]
    markers = {element.name: element for element in drawn["tones-1"].elements if isinstance(element, Markers)}
    assert set(markers) == {"motor", "meshing noise", "structure"}
    lines = [source for source in sound.sources if source.path == "structure"]
    held = [level for s, level in zip(sound.sources, sound.surface_db, strict=True) if s.path == "structure"]
    np.testing.assert_array_equal(markers["structure"].x, [line.frequency_hz for line in lines])
    np.testing.assert_array_equal(markers["structure"].y, held)
    assert drawn["tones-1"].y_axis.caption == "Level / dB re 20 µPa"
    assert "at 4 m" in drawn["tones-1"].title
    (rule,) = [element for element in drawn["tones-1"].elements if isinstance(element, Rule)]
    assert rule.x == FACTS.range_hz[1]


def test_every_source_has_its_power_and_its_level(result, document):
    rows = table(document, "sound-sources")
    sounds = result.prediction.sound
    assert [row["surface_db"] for row in rows] == [level for sound in sounds for level in sound.surface_db]
    assert [row["path"] for row in rows] == [source.path for sound in sounds for source in sound.sources]
    assert "a tone of the structure is that of a point source with the same mean level at 4 m" in words(document)


def test_weak_tones_are_left_out_and_counted():
    found = housed(("motor", "mesh"), masuda__constant_db=90.0)
    drawn = figures(predicted_report(found))["tones-1"]
    low, high = drawn.y_axis.limits
    assert high - low == 80.0
    hidden = [level for level in found.prediction.sound[0].surface_db if level <= low]
    assert len(hidden) > 1
    assert drawn.caption == f"{len(hidden)} weaker tones are left out."


# ---------------------------------------------------------------- directions


def test_directions_are_drawn_closed_and_tabled(result, document):
    circles = [circle for circle in result.prediction.directivity if circle.sweep == "speed"]
    drawn = [element for element in figures(document)["directivity"].elements if isinstance(element, Line)]
    assert [line.name for line in drawn][:2] == ["1 (20 km/h)", "2 (30 km/h)"]
    for line, circle in zip(drawn, circles, strict=True):
        assert (line.x[-1], line.y[-1]) == (360.0, line.y[0])
        np.testing.assert_array_equal(line.y[:-1], circle.level_db)
    for row, circle in zip(table(document, "directivity-conditions"), circles, strict=True):
        assert row["loudest_db"] == circle.level_db.max()
        assert row["quietest_db"] == circle.level_db.min()
        assert row["range_db"] == pytest.approx(np.ptp(circle.level_db))
        assert row["loudest_deg"] == circle.angle_deg[circle.level_db.argmax()]
    sides = [e.label for e in figures(document)["directivity"].elements if isinstance(e, Rule)]
    assert sides == ["travel", "left", "back", "right"]


def test_the_frame_of_the_directions_and_the_added_paths_are_said(document):
    said = words(document)
    assert "Levels on a circle of 12 m around the drive's centre" in said
    assert "0° is the direction of travel (x), 90° is to the left (y)" in said
    assert "those of the total, which adds the motor's tones and the meshing noise." in said


def test_shapes_are_compared_by_their_correlation(document):
    least = min(math.cos(0.5 * number) for number in range(6))
    assert f"correlate in pairs with \N{MINUS SIGN}{abs(least):.2f} to {math.cos(0.5):.2f}" in words(document)
    assert "calls the shape invariant with speed" in words(document)
    for line in figures(document)["directivity-shape"].elements:
        if isinstance(line, Line):
            assert line.y.max() == 0.0


def test_helix_angles_have_their_directions_folded(result, document):
    (section,) = [section for section in document.sections if section.id == "directivity"]
    pairs, folded = [block for block in section.blocks if isinstance(block, Details)]
    assert pairs.summary == "Shapes in pairs"
    names = [block.figure.name for block in folded.blocks if isinstance(block, FigureBlock)]
    assert names == ["directivity-helix", "directivity-helix-shape"]
    assert len(table(document, "directivity-helix-angles")) == len(result.prediction.helix)


def test_a_drive_as_loud_all_around_has_no_section_on_directions(result):
    flat = tuple(dataclasses.replace(c, level_db=np.full(72, 90.0)) for c in result.prediction.directivity)
    prediction = dataclasses.replace(result.prediction, directivity=flat)
    assert "directivity" not in sections(predicted_report(dataclasses.replace(result, prediction=prediction)))


def test_a_circle_in_a_node_plane_is_said_where_the_circle_is_shown(result):
    def said(prediction):
        made = dataclasses.replace(result, prediction=prediction)
        (section,) = [one for one in predicted_report(made).sections if one.id == "directivity"]
        return [block.text for block in section.blocks if isinstance(block, Notice)]

    first, *others = result.prediction.directivity
    (level_db,) = [one.level_db(result.prediction.surface) for one in result.prediction.sound[:1]]
    lower = np.where(np.arange(72) < 36, level_db - 30.0, level_db - 40.0)
    circles = (dataclasses.replace(first, level_db=lower), *others)
    before = said(result.prediction)
    after = said(dataclasses.replace(result.prediction, directivity=circles))
    assert not any(" 1 (" in text for text in before)
    assert any(" 1 (" in text and "lies in a node plane of the sound" in text for text in after)


def test_one_that_is_round_among_others_has_no_angle_of_its_loudest(result):
    first, *others = result.prediction.directivity
    silent = dataclasses.replace(others[0], level_db=np.full(72, math.nan))
    circles = (dataclasses.replace(first, level_db=np.full(72, 90.0)), silent, *others[1:])
    prediction = dataclasses.replace(result.prediction, directivity=circles)
    rows = table(predicted_report(dataclasses.replace(result, prediction=prediction)), "directivity-conditions")
    assert [row["of"][0] for row in rows] == ["1", "3", "4", "5", "6"]
    assert rows[0]["loudest_deg"] is None
    assert rows[0]["range_db"] == 0.0


# ---------------------------------------------------------------- the housing


def test_the_housing_is_a_section_with_its_facts(document):
    assert sections(document)[-6:] == [
        "housing", "sound-field", "directivity", "helix-sweep", "model-parameters", "provenance",
    ]  # fmt: skip
    (listed,) = [block for block in blocks_of(document, Facts) if block.pairs[0].key == "Mass"]
    facts = {fact.key: fact.value for fact in listed.pairs}
    assert facts["Mass"].startswith("469 kg")
    assert facts["Modes"].startswith("11 with natural frequencies up to 1000 Hz; kept are 12 and 12 shapes")
    assert facts["First natural frequencies"].startswith("43.8, 51.7, ")
    assert facts["First natural frequencies"].endswith("259.0, ... Hz")
    assert facts["Sources of the motor"] == "x 0, y 0.45, z 0 m in the drive's frame"
    assert "\N{MINUS SIGN}0.35" in facts["Middle of the housing"]


def test_the_count_of_modes_ends_with_the_range(result, document):
    line = figures(document)["housing-modes"].elements[0]
    assert (line.x[0], line.y[0]) == (0.0, 0.0)
    assert (line.x[-1], line.y[-1]) == (1000.0, 11.0)
    rules = [element for element in figures(document)["housing-modes"].elements if isinstance(element, Rule)]
    below = [state.mesh_hz for state in result.prediction.conditions if state.mesh_hz <= 1000.0]
    assert [rule.x for rule in rules] == below


def test_frames_split_and_limits_are_said(document):
    said = words(document)
    assert "The gears' x points from the pinion to the wheel, their z to the right" in said
    assert "a positive torque is traction forward" in said
    assert "the left bearing takes 50 % of the force of either gear" in said
    assert "The coupling is one-way" in said
    uneven = dataclasses.replace(FACTS, left_share=(0.25, 0.4))
    said = words(predicted_report(housed(("motor", "mesh"), uneven)))
    assert "takes 25 % of that of the pinion and 40 % of that of the wheel" in said


def test_parameters_of_housing_and_field_are_listed_with_their_standing(document):
    for name in ("housing-parameters", "model-parameters"):
        rows = {row["parameter"]: row for row in table(document, name)}
        assert rows["Housing: loss factor"]["standing"] == "assumed"
        assert rows["Seats of the wheel: radius"]["value"] == "0.2 m"
        assert rows["Radius of the circle of directions"]["origin"] == "paper, section 5.1"
        assert rows["How the sound field is computed"]["value"] == "boundary_elements"
    keys = {p.key for p in PLAIN.parameters() if p.key.startswith("housing.") and p.value is not None}
    listed = [row["parameter"] for row in table(document, "model-parameters")]
    assert sum(name.startswith(("Housing: ", "Seats of ")) for name in listed) == len(keys)
    assert "Position of the motor's sources, x, y, z" in listed


def test_a_field_of_point_sources_lists_no_housing(result):
    model = DriveModel(PLAIN)
    plain = predicted_report(dataclasses.replace(result, fleet=PLAIN, prediction=model.evaluate()))
    assert "housing" not in sections(plain)
    listed = [row["parameter"] for row in table(plain, "model-parameters")]
    assert not any(name.startswith(("Housing", "Seats")) for name in listed)
    assert "Space around the drive" in listed
    assert "structure_spl_db" not in table(plain, "levels-4-m")[0]
    assert "The bearing forces' way through the housing is not computed." in words(plain)


# ---------------------------------------------------------------- the helix sweep


def test_the_helix_sweep_has_the_levels_of_the_paths(result, document):
    rows = table(document, "helix")
    for row, case in zip(rows, sorted(result.prediction.helix, key=lambda c: c.helix_angle_deg), strict=True):
        assert row["spl_db"] == case.sound.level_db("4 m")
        assert row["structure_spl_db"] == case.sound.level_db("4 m", "structure")
    assert "the housing and its seats, and the unloaded transmission error stay as they are" in words(document)


def test_the_helix_sweep_draws_the_paths_where_there_is_more_than_the_mesh():
    document = predicted_report(housed(("motor", "mesh"), operation__train_speed_km_h=(20.0, 60.0)))
    names = [line.name for line in figures(document)["helix-level"].elements]
    assert names[0] == "total"
    assert "structure (not added)" in names


def test_all_is_drawn(document):
    assert render_html(document)
