"""What the report of the modelled side says of drives in contact, apart, at rest and on the other flanks."""

import dataclasses
import re

import numpy as np
import pytest
from plain_fleets import plain_fleet

from tdacoustic.drive import DriveModel, GearState, SpeedSweep
from tdacoustic.fleet import load_fleet
from tdacoustic.gears import bearing_forces, branch_of_sweep, coexisting, sampling_points, steady_state
from tdacoustic.reporting.document import Details, FigureBlock, Notice, Paragraph, Section, Sentences, Table, walk
from tdacoustic.reporting.figure import Line, Markers, Rule
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.plotly_renderer import render_plotly
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.reporting.sections.gear_words import hertz, newtons, significant
from tdacoustic.reporting.sections.loads_over_speed import _course
from tdacoustic.reporting.sections.printed import TABLE_5, is_of_the_paper
from tdacoustic.results import FleetPrediction, LogInput
from tdacoustic.steps import Store
from tdacoustic.workflows.predict import predict

REFERENCE = load_fleet(plain_fleet("reference-drive"))
RATTLING = {"operation.torque_n_m": 300.0, "gear_pair.1.transmission_error_um": (8.0,)}

INPUTS = (LogInput("fleet.toml", "0" * 64, 0, "TOML"),)


def predicted(values, sweep_hz=(), origin="calibrated"):
    """The modelled side of the reference drive with other values; sweeps only where asked, and over a few speeds."""
    fleet = REFERENCE.replaced(values, origin=origin)
    model = DriveModel(fleet)
    prediction = model.evaluate()
    if sweep_hz:
        km_h_per_hz = prediction.conditions[0].condition.train_speed_km_h / prediction.conditions[0].mesh_hz
        torques = [prediction.conditions[0].steady.torque_n_m] * len(sweep_hz)
        up = branch_of_sweep(model.unit.system, sweep_hz, torques)
        down = branch_of_sweep(model.unit.system, sweep_hz[::-1], torques)
        sweep = SpeedSweep(tuple(hz * km_h_per_hz for hz in sweep_hz), up, down)
        prediction = dataclasses.replace(prediction, sweep=sweep)
    return FleetPrediction(fleet, prediction, {}, INPUTS, ())


def with_record(result, name, km_h):
    """The same result with one more condition, whose motion is taken from a record too short to repeat."""
    model, states = DriveModel(result.fleet), result.prediction.conditions
    slower = states[-1].condition
    motor_hz = slower.motor_hz * km_h / slower.train_speed_km_h
    condition = dataclasses.replace(slower, name=name, train_speed_km_h=km_h, motor_hz=motor_hz)
    steady = steady_state(model.unit.system, model.unit.mesh_hz(motor_hz), condition.torque_n_m, most_periods=128)
    assert steady.repeats_after is None
    forces = bearing_forces(model.unit.system, steady)
    state = GearState(condition, steady.mesh_hz, steady, forces, states[-1].masuda_db)
    return dataclasses.replace(result, prediction=dataclasses.replace(result.prediction, conditions=(*states, state)))


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return predict(REFERENCE, store=Store(tmp_path_factory.mktemp("store")))


@pytest.fixture(scope="module")
def rattling():
    speeds = {"operation.train_speed_km_h": (30.0, 114.455), "operation.helix_angle_deg": (4.0,)}
    result = predicted({**RATTLING, **speeds}, (440.0, 477.5, 517.8, 800.0, 832.3, 900.0, 1000.0))
    return with_record(result, "3", 130.0)


def blocks_of(document, kind):
    return [
        block for block in walk((*document.notices, *document.summary, *document.sections)) if isinstance(block, kind)
    ]


def words(document):
    """Everything the report says in sentences."""
    found = [block.text for block in blocks_of(document, (Paragraph, Notice))]
    found += [item for block in blocks_of(document, Sentences) for item in block.items]
    return "\n".join([*found, *(block.figure.caption for block in blocks_of(document, FigureBlock))])


def table(document, name):
    (found,) = [block for block in blocks_of(document, Table) if block.name == name]
    return [dict(zip((column.key for column in found.columns), row, strict=True)) for row in found.rows]


def figure(document, name):
    (found,) = [block.figure for block in blocks_of(document, FigureBlock) if block.figure.name == name]
    return found


def figure_names(document):
    return {block.figure.name for block in blocks_of(document, FigureBlock)}


def of_condition(document, name):
    (found,) = [
        item
        for block in document.summary
        if isinstance(block, Sentences)
        for item in block.items
        if item.startswith(f"Condition {name} (")
    ]
    return found


# ---------------------------------------------------------------- the reference drive


def test_the_summary_has_a_sentence_a_condition_with_its_figures(reference):
    document = predicted_report(reference)
    for state in reference.prediction.conditions:
        said = of_condition(document, state.condition.name)
        assert f"mesh frequency {hertz(state.mesh_hz)}, torque +5913 N m (drive flanks)" in said
        assert f"DTE {significant(1e6 * state.steady.dte_pp_m)} µm peak to peak" in said
        assert f"Masuda's level {state.masuda_db:.1f} dB at 1 m," in said
        force = float(np.abs(state.forces.amplitude_n).max())
        assert f"largest bearing force {newtons(force)} at" in said
        assert said.endswith("Harmonic balance: periodic with the mesh, teeth stay in contact.")


def test_the_regime_is_named_and_told_from_that_of_the_papers_test(reference):
    said = words(predicted_report(reference))
    assert "Regime: traction, +5913 N m of one motor, constant over speed (210 to 1200 kW)." in said
    assert "the motor drives the wheelset and the drive flanks carry" in said
    assert "another locomotive hauled this one" in said
    assert "The load computed here is another regime than that of the test." in said


def test_every_doubt_of_the_prediction_is_a_warning_of_the_summary(reference, rattling):
    for result in (reference, rattling):
        warned = [
            block.text.rstrip(".").lower()
            for block in predicted_report(result).summary
            if isinstance(block, Notice) and block.kind == "warning"
        ]
        assert warned == [doubt.rstrip(".").lower() for doubt in result.prediction.doubts]


def test_the_sections_stand_in_the_order_of_the_model(reference):
    assert [section.id for section in predicted_report(reference).sections] == [
        "gear-pair", "mesh-stiffness", "transmission-error", "bearing-forces", "speed-sweep", "meshing-noise",
        "sound-field", "what-if", "helix-sweep", "sensitivity", "model-parameters", "provenance",
    ]  # fmt: skip


def test_geometry_stiffness_and_natural_frequencies_are_those_of_the_unit(reference):
    document, unit = predicted_report(reference), reference.prediction.unit
    gears = {row["quantity"]: row for row in table(document, "gears")}
    assert gears["Base diameter"]["pinion"] == pytest.approx(2e3 * unit.geometry.base_radii_m[0])
    assert gears["Root diameter"]["wheel"] == pytest.approx(2e3 * unit.geometry.root_radii_m[1])
    pair = {row["quantity"]: row["value"] for row in table(document, "pair")}
    assert pair["Centre distance"] == pytest.approx(495.0)
    assert pair["Helix angle at the reference circle"] == pytest.approx(4.0, abs=1e-3)
    modes = table(document, "modes")
    np.testing.assert_allclose(
        [row["natural_frequency_hz"] for row in modes[1:]], unit.system.natural_frequencies_hz()[1:]
    )
    assert modes[0]["conditions"] == "rigid rotation"
    # 545.8 Hz is met by the mesh of condition 5, 524.9 Hz, less 3.8 %
    assert "5 (x1, \u22123.8 %)" in modes[5]["conditions"]
    state = reference.prediction.conditions[4]
    per_hz = state.condition.train_speed_km_h / state.mesh_hz
    assert modes[5]["mesh_1_km_h"] == pytest.approx(modes[5]["natural_frequency_hz"] * per_hz)


def test_the_stiffness_is_drawn_over_two_mesh_periods_about_its_mean(reference):
    stiffness, mean = figure(predicted_report(reference), "mesh-stiffness").elements
    k = 1e-6 * reference.prediction.unit.system.mesh_stiffness_n_per_m
    assert (stiffness.x[0], stiffness.x[-1]) == (0.0, 2.0)
    assert stiffness.y[:-1].mean() == pytest.approx(k, rel=1e-3)
    np.testing.assert_allclose(mean.y, k)


def test_the_dte_over_time_is_that_of_the_papers_condition(reference):
    document, state = predicted_report(reference), reference.prediction.conditions[4]
    drawn = figure(document, "dte-over-time")
    assert "condition 5 (60 km/h)" in drawn.title
    delta, edge = drawn.elements
    assert np.ptp(delta.y) == pytest.approx(1e6 * state.steady.dte_pp_m, rel=2e-3)
    assert delta.x[-1] == pytest.approx(4e3 / state.mesh_hz, rel=0.01)
    assert (delta.y > edge.y).all()
    assert "prints 14.8491 µm peak to peak for its condition 5; here it is 12.21 µm" in words(document)


def test_spectra_show_the_lines_and_where_the_papers_points_find_nothing(reference):
    document, state = predicted_report(reference), reference.prediction.conditions[4]
    drawn = figure(document, "spectrum-pinion-5")
    by_name = {element.name: element for element in drawn.elements}
    first = np.abs(state.forces.amplitude_n[0, :, 0])
    assert [by_name[direction].y[0] for direction in "xyz"] == pytest.approx(first)
    points = sampling_points(state.mesh_hz, 3000.0)
    between = points[np.abs(points / state.mesh_hz - np.round(points / state.mesh_hz)) > 0.1]
    np.testing.assert_allclose(by_name["sampled: zero"].x, between)
    assert "sampled" not in by_name
    assert "it has nothing between the mesh harmonics" in words(document)


def test_one_condition_has_its_spectra_in_sight_and_the_others_folded(reference):
    (bearing,) = [block for block in blocks_of(predicted_report(reference), Section) if block.id == "force-spectra"]
    in_sight = [block.figure.name for block in bearing.blocks if isinstance(block, FigureBlock)]
    (folded,) = [block for block in bearing.blocks if isinstance(block, Details)]
    assert in_sight == ["spectrum-pinion-5", "spectrum-wheel-5"]
    assert len([block for block in walk([folded]) if isinstance(block, FigureBlock)]) == 10


def test_how_the_forces_at_the_mesh_frequency_go_with_speed(reference):
    document = predicted_report(reference)
    told = {(row["gear"], row["direction"]): row for row in table(document, "force-courses")}
    assert told["pinion", "y"]["course"] == "rises, then falls"
    assert told["pinion", "y"]["figures"] == (
        "from 145 N at 175.0 Hz up to 9.12 kN at 524.9 Hz, then down to 2.04 kN at 1001.3 Hz"
    )
    assert told["wheel", "y"]["course"] == "up and down"
    assert (
        "The tangential force (y) is the largest of the three both at the mesh frequency and by the rms of all lines "
        "in 6 of 6 conditions (pinion)" in words(document)
    )
    assert "rises, then falls over the speeds at pinion x and pinion y, not at " in words(document)
    forces = table(document, "forces-first")
    assert forces[4]["pinion_y_n"] == pytest.approx(9121.2, rel=1e-3)


@pytest.mark.parametrize(
    ("values", "course", "words"),
    [
        ((1.0, 3.0, 2.0), "rises, then falls", "from 1.00 N at 100 Hz up to 3.00 N at 200 Hz, then down to 2.00 N at"),
        ((1.0, 2.0, 3.0), "rises", "from 1.00 N at 100 Hz to 3.00 N at 300 Hz"),
        ((3.0, 2.0, 1.0), "falls", "from 3.00 N at 100 Hz to 1.00 N at 300 Hz"),
        ((3.0, 3.05, 3.1), "stays the same", "from 3.00 N"),  # 0.3 dB
        ((3.0, 1.0, 2.0), "up and down", "3.00 N, 1.00 N, 2.00 N; largest 3.00 N at 100 Hz"),
        ((1.0, 2.0), "", "at least 3 speeds are needed"),
    ],
)
def test_courses(reference, values, course, words):
    states = [dataclasses.replace(reference.prediction.conditions[0], mesh_hz=100.0 * n) for n in (1, 2, 3)]
    found = _course(states[: len(values)], np.array(values))
    assert found[0] == course
    assert words in found[1]


def test_the_sweep_has_both_ways_the_conditions_and_the_natural_frequencies(reference):
    document, sweep = predicted_report(reference), reference.prediction.sweep
    drawn = figure(document, "sweep-dte")
    up, down = (element for element in drawn.elements if isinstance(element, Line))
    np.testing.assert_array_equal(up.y, 1e6 * sweep.up.dte_pp_m)
    np.testing.assert_array_equal(down.x, sweep.down.mesh_hz)
    (conditions,) = [element for element in drawn.elements if isinstance(element, Markers)]
    assert conditions.labels == ("1", "2", "3", "4", "5", "6")
    natural = reference.prediction.unit.system.natural_frequencies_hz()
    rules = [element.x for element in drawn.elements if isinstance(element, Rule)]
    assert rules == pytest.approx(natural[1:7])
    assert "sweep-floquet" in figure_names(document)
    assert "sweep-contact" not in figure_names(document)
    assert "The two ways end in one motion." in words(document)


def test_masudas_level_stands_beside_table_5_and_says_what_can_be_compared(reference):
    document = predicted_report(reference)
    rows = table(document, "masuda")
    assert [row["printed_db"] for row in rows] == [row.level_db for row in TABLE_5]
    for row, printed, state in zip(rows, TABLE_5, reference.prediction.conditions, strict=True):
        assert row["masuda_spl_1m_db"] == state.masuda_db
        assert row["relative_db"] == pytest.approx(state.masuda_db - reference.prediction.conditions[0].masuda_db)
        assert row["printed_relative_db"] == pytest.approx(printed.level_db - TABLE_5[0].level_db)
    said = words(document)
    assert "only the shape over the conditions can be compared; the absolute level cannot" in said
    assert "86.517 dB" in said and "93.6556 dB in Table 5, a factor of 2.27 in W X" in said
    assert "dB off Table 5 on average, which the constant would take up; in shape the two then differ by" in said
    shape = figure(document, "masuda-shape")
    ours, printed = shape.elements
    assert ours.y[0] == printed.y[0] == 0.0
    assert [trace["mode"] for trace in render_plotly(shape)["data"]] == ["lines+markers"] * 2


def test_table_5_is_as_printed():
    assert [(row.condition, row.mesh_hz, row.level_db) for row in TABLE_5] == [
        ("1", 174.97, 70.7811), ("2", 262.45, 85.5865), ("3", 349.94, 84.9987),
        ("4", 437.42, 92.8384), ("5", 524.9, 93.6556), ("6", 1001.0, 88.5417),
    ]  # fmt: skip


def test_the_reading_of_the_formula_has_its_origins(reference):
    reading = {row["parameter"]: row for row in table(predicted_report(reference), "masuda-reading")}
    assert reading["Masuda: constant C"]["origin"] == "paper, equation (8)"
    assert (reading["Masuda: what X is (displacement)"]["value"]) == "um_pp"
    assert reading["Masuda: what X is (displacement)"]["standing"] == "assumed"


def test_the_helix_sweep_has_dte_level_and_centre_distance(reference):
    document = predicted_report(reference)
    rows = table(document, "helix")
    assert [row["helix_angle_deg"] for row in rows] == [0.1, 4.0, 8.0, 12.0]
    for name, key in (("dte", "dte_pp_um"), ("masuda", "masuda_spl_1m_db"), ("distance", "centre_distance_mm")):
        (line,) = figure(document, f"helix-{name}").elements
        np.testing.assert_allclose(line.y, [row[key] for row in rows])
    assert "profile shifts and face width stay; the centre distance, the contact ratios" in words(document)


def test_every_parameter_of_the_gear_model_is_listed_with_its_standing(reference):
    document = predicted_report(reference)
    rows = {row["parameter"]: row for row in table(document, "model-parameters")}
    assert rows["Face width"]["standing"] == "assumed"
    assert rows["Normal module"]["origin"] == "paper, Table 3" and rows["Normal module"]["standing"] == "printed"
    assert rows["Teeth of pinion and wheel"]["value"] == "31 : 104"
    assert rows["Bearing stiffness of the wheel, x, y, z"]["value"] == "1.2e9, 1.2e9, 4e8 N/m"
    assert not any(name.startswith(("Power", "Resistance")) for name in rows)
    assumed = sum(row["standing"] == "assumed" for row in rows.values())
    assert f"{assumed} of {len(rows)} parameters are assumed" in words(document)


def test_where_the_numbers_come_from_is_said(reference):
    document = predicted_report(reference)
    (row,) = table(document, "inputs")
    assert row["sha256"] == reference.inputs[0].sha256
    assert {row["label"] for row in table(document, "steps")} == {"up", "down", "6 conditions"}
    assert "harmonics" in words(document) and "The backlash is 200 µm" in words(document)


def test_all_numbers_are_tagged_as_calculated(reference):
    document = predicted_report(reference)
    assert document.origin == "calculated"
    assert all(block.origin == "calculated" for block in blocks_of(document, FigureBlock))


# ---------------------------------------------------------------- other regimes


def test_teeth_that_separate_and_motions_that_do_not_repeat_are_told_apart(rattling):
    document = predicted_report(rattling)
    assert "Harmonic balance: periodic with the mesh, teeth stay in contact." in of_condition(document, "1")
    assert "Time integration: the motion does not repeat, teeth are apart" in of_condition(document, "3")
    apart = 100.0 * (1.0 - rattling.prediction.conditions[1].steady.contact_part)
    said = f"the motion repeats only after 2 mesh periods, teeth are apart {apart:.0f} % of the time"
    assert said in of_condition(document, "2")
    assert render_html(document)


def test_lines_between_the_harmonics_are_drawn_and_points_gather_what_does_not_repeat(rattling):
    document, states = predicted_report(rattling), rattling.prediction.conditions
    by_name = {element.name: element for element in figure(document, "spectrum-pinion-2").elements}
    assert by_name["y"].x[0] == pytest.approx(0.5 * states[1].mesh_hz)
    assert "sampled" not in by_name  # every point is a line or nothing
    gathered = {element.name: element for element in figure(document, "spectrum-pinion-3").elements}["sampled"]
    points = sampling_points(states[2].mesh_hz, 5.0 * states[2].mesh_hz)
    sampled = states[2].forces.sampled_n(points)[0].ravel()
    kept = np.isfinite(gathered.y)
    assert kept.any()
    np.testing.assert_allclose(gathered.y[kept], sampled[kept])
    assert "what is broadband has no line" in words(document)


def test_a_record_is_drawn_as_it_is_and_a_repeat_several_times(rattling):
    document, states = predicted_report(rattling), rattling.prediction.conditions
    assert states[1].steady.waveform_m.shape[0] == 2
    lines = figure(document, "dte-conditions").elements
    assert [round(line.x[-1]) for line in lines] == [4, 4, 8]


def test_where_the_two_ways_differ_is_marked_and_said(rattling):
    document, sweep = predicted_report(rattling), rattling.prediction.sweep
    twice = coexisting(sweep.up, sweep.down)
    assert twice.any()
    by_name = {
        element.name: element for element in figure(document, "sweep-dte").elements if isinstance(element, Markers)
    }
    np.testing.assert_array_equal(by_name["two motions"].x, np.tile(sweep.up.mesh_hz[twice], 2))
    assert "Two motions are stable" in words(document)
    assert "sweep-contact" in figure_names(document)
    both = [row for row in table(document, "sweep-stretches") if row["what"] == "two motions are stable"]
    assert sum(row["speeds"] for row in both) == twice.sum()
    assert {"teeth separate"} <= {row["what"] for row in table(document, "sweep-stretches")}


def test_without_torque_nothing_moves_and_every_section_says_so():
    document = predicted_report(predicted({"operation.torque_n_m": 0.0}, (200.0, 400.0)))
    assert "no torque; the teeth of the model do not touch" in of_condition(document, "3")
    said = words(document)
    assert "Regime: traction, no torque" in said
    assert "Without torque nothing moves at any speed." in said
    assert "the formula has no level" in said
    assert not {"dte-over-time", "sweep-dte", "masuda-shape", "helix-dte"} & figure_names(document)
    assert table(document, "conditions")[0]["masuda_spl_1m_db"] is None
    assert render_html(document)


def test_a_torque_against_the_motor_is_signed_and_on_the_coast_flanks():
    document = predicted_report(predicted({"operation.mode": "hauled"}, (200.0, 400.0)))
    assert "torque \u22125913 N m (coast flanks)" in of_condition(document, "1")
    assert "Below zero the wheelset drives the motor and the coast flanks carry." in words(document)
    delta, edge = figure(document, "dte-over-time").elements
    assert (delta.y < edge.y).all() and delta.y.max() < 0.0


def test_torques_of_both_signs_and_none_are_told_apart():
    values = {
        "operation.torque": "table",
        "operation.torque_table": ((0.0, 6000.0), (40.0, 0.0), (120.0, -12000.0)),
    }
    document = predicted_report(predicted(values))
    said = words(document)
    assert (
        "In conditions 1 and 2 the motor drives the wheelset and the drive flanks carry, in conditions 4, 5 and 6 "
        in said
    )
    assert "no torque" in of_condition(document, "3")
    assert [row["masuda_spl_1m_db"] is None for row in table(document, "masuda")] == [False, False, True, *[False] * 3]
    assert len(table(document, "forces-first")) == 5
    assert "speed-sweep" not in [section.id for section in document.sections]
    rows = {row["parameter"]: row["value"] for row in table(document, "model-parameters")}
    assert rows["Torque of one motor"] == "6000 at 0 km/h; 0 at 40 km/h; \u221212000 at 120 km/h N m"


def test_one_condition_without_helix_angles_renders():
    fleet = REFERENCE.replaced({"operation.train_speed_km_h": (60.0,)})
    operation = fleet.operation.model_copy(update={"helix_angle_deg": None})
    fleet = dataclasses.replace(fleet, operation=operation)
    result = FleetPrediction(fleet, DriveModel(fleet).evaluate(), {}, INPUTS, ())
    document = predicted_report(result)
    assert "helix-sweep" not in [section.id for section in document.sections]
    assert {row["course"] for row in table(document, "force-courses")} == {""}
    assert "rises, then falls over the speeds" not in words(document)
    assert not {"dte-conditions", "masuda-shape", "forces-pinion"} & figure_names(document)
    page = render_html(document)
    assert page == render_html(predicted_report(result))
    assert not re.search(r">[^<]*\b(nan|inf|None)\b", page.split("<main")[1].split("<script")[0])


def test_a_drive_that_is_not_the_papers_is_not_held_against_it():
    own = {p.key: p.value for p in REFERENCE.parameters() if "paper" in p.origin and not p.key.startswith("masuda")}
    result = predicted(own, origin="drawing 12")
    assert not is_of_the_paper(result.fleet)
    document = predicted_report(result)
    said = words(document)
    assert "another locomotive" not in said and "14.8491" not in said and "Against Table 5" not in said
    assert "printed_db" not in table(document, "masuda")[0]
    assert "condition 4 (50 km/h)" in figure(document, "dte-over-time").title  # the middle one


def test_a_calibrated_constant_and_a_weighting_are_said():
    values = {"masuda.constant_db": -10.0, "masuda.weighting": "A", "masuda.displacement": "static_ratio"}
    fleet = REFERENCE.replaced(values, stderr={"masuda.constant_db": 1.5})
    document = predicted_report(FleetPrediction(fleet, DriveModel(fleet).evaluate(), {}, INPUTS, ()))
    said = words(document)
    assert (
        "1 m in dB(A) re 20 µPa with C = \u221210 dB, X the peak to peak of the DTE over the static compression" in said
    )
    assert "The constant is calibrated ± 1.5 dB (calibrated)." in said
    assert "Its absolute height cannot be held" not in said
    assert "dB(A)" in of_condition(document, "1")
    rows = {row["parameter"]: row for row in table(document, "model-parameters")}
    assert rows["Masuda: constant C"]["value"] == "\u221210.0 ± 1.5 dB (1 σ)"


def test_names_of_conditions_keep_their_letters():
    document = predicted_report(predicted({"operation.train_speed_km_h": (60.0,)}))
    assert "Condition 1 (60 km/h)" in words(document)


@pytest.mark.parametrize(
    ("value", "said"), [(9121.2, "9.12 kN"), (999.7, "1.00 kN"), (999.4, "999 N"), (0.0123, "0.0123 N"), (0.0, "0 N")]
)
def test_forces_have_three_digits_and_no_exponent(value, said):
    assert newtons(value) == said
