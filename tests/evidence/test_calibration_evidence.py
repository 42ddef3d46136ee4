"""The calibration study on a few seeds, the truth it rests on, and whether its record still speaks of this program."""

import ast
import json
import math
from pathlib import Path

import pytest
from scipy.stats import binomtest
from studies import study_module

HERE = Path(__file__).parent
RERUN = (
    "python tests/evidence/run_calibration_study.py --rows rows.jsonl --record tests/evidence/calibration_record.json"
)
CHANCE = 1e-4
"""With which a band misses although the coverage is the stated one."""


@pytest.fixture(scope="module")
def study():
    with study_module("calibration_study", "gears") as module:
        yield module


@pytest.fixture(scope="module")
def record():
    return json.loads((HERE / "calibration_record.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def known_levels(record):
    """Levels of the record's true drives."""
    return {(row["misfit"], row["index"]): row["levels_db"] for row in record["truths"]}


def band(k, n):
    """Exact (Clopper-Pearson) confidence band of a proportion."""
    found = binomtest(k, n).proportion_ci(1.0 - CHANCE, method="exact")
    return found.low, found.high


# ---------------------------------------------------------------- the truth


def test_the_truth_uses_nothing_of_the_program():
    modules = [HERE / "drive_levels.py", HERE.parent / "gears" / "printed_equations.py"]
    for path in modules:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        names |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        assert not {name for name in names if name.startswith("tdacoustic")}, path


def test_the_number_that_is_taken_over_is_the_programs(study):
    from drive_levels import MESH_STIFFNESS_N_PER_M, REFERENCE_DRIVE

    import tdacoustic as td

    unit = td.DriveModel(td.load_fleet(REFERENCE_DRIVE)).unit
    assert unit.stiffness.normal_n_per_m == pytest.approx(MESH_STIFFNESS_N_PER_M, rel=1e-12)


def test_geometry_of_the_truth_is_that_of_the_program(study, conformance):
    from drive_levels import REFERENCE_DRIVE, TrueDrive, geometry

    import tdacoustic as td

    ours = td.DriveModel(td.load_fleet(REFERENCE_DRIVE)).unit.geometry
    true = geometry(TrueDrive().numbers["gear_pair"][0])
    source = "independent: involute geometry of ISO 21771 written anew, tests/evidence/drive_levels.py"
    for what, expected, got, unit in (
        ("helix angle", true.helix_rad, ours.helix_angle_rad, "rad"),
        ("working pressure angle", true.working_angle_rad, ours.working_pressure_angle_rad, "rad"),
        ("pinion's base radius", true.base_radii_m[0], ours.base_radii_m[0], "m"),
        ("transverse contact ratio", true.transverse_contact_ratio, ours.transverse_contact_ratio, "1"),
        ("overlap ratio", true.overlap_ratio, ours.overlap_ratio, "1"),
        ("pinion's working pitch radius", true.pitch_radius_m, ours.pitch_radii_m[0], "m"),
    ):
        conformance(f"reference drive, {what}", expected, got, 1e-9 * abs(expected), unit, source)


@pytest.mark.parametrize(
    "name, change",
    [
        ("as the study draws it", {}),
        ("little damping", {"mesh_damping_ratio": 0.01, "bearing_damping_ratio": 0.01}),
        (
            "stiffer bearings, larger error of the teeth",
            {"bearing_stiffness_factor": 1.1025, "transmission_error_um": 8.0},
        ),
    ],
)
def test_the_model_is_the_truth_where_both_have_the_same_parameters(study, name, change, conformance, tmp_path):
    """Interpolated or not, levels of the program are those of the eight equations marched in time."""
    from dataclasses import replace

    from drive_levels import levels_at_4_m_db

    import tdacoustic as td
    from tdacoustic.drive import Receiver
    from tdacoustic.fitting.free import free_parameter
    from tdacoustic.fitting.levels import LevelModel
    from tdacoustic.fitting.measured_level import MeasuredLevel

    truth = study.Truth.draw(0)
    path = tmp_path / "fleet.toml"
    path.write_text(truth.fleet_text(()), encoding="utf-8")
    drive = replace(truth.drive(), **change)
    fleet = td.load_fleet(path)
    factor = drive.bearing_stiffness_factor
    for side in ("pinion", "wheel"):
        key = f"gear_dynamics.{side}_bearing_stiffness_n_per_m"
        fleet = fleet.replaced({key: tuple(factor * value for value in fleet.get(key).value)})
    fleet = fleet.replaced({"gear_pair.1.transmission_error_um": (drive.transmission_error_um,)})
    place = Receiver("4 m", 4.0)
    conditions = td.DriveModel(fleet).conditions
    model = LevelModel(fleet, [MeasuredLevel(c, place, 0.0, 1.0, "Z", "synthetic", "evidence") for c in conditions])
    values = {
        study.CONSTANT: drive.masuda_constant_db,
        study.DAMPING: drive.mesh_damping_ratio,
        study.BEARINGS: drive.bearing_damping_ratio,
        study.GAIN: drive.motor_gain_db,
    }
    true = levels_at_4_m_db(drive)
    source = "independent: equations (1) to (8) of Appl. Sci. 2025, 15, 10597 marched in time, written anew"
    for condition, expected, got in zip(conditions, true, model.levels_db(values), strict=True):
        what = f"level at 4 m, condition {condition.name}, {name}"
        conformance(what, expected, got, 0.002, "dB", source)
    model.prepare([free_parameter(fleet, study.CONSTANT), free_parameter(fleet, study.DAMPING)])
    fleet_values = {key: value for key, value in values.items() if key != study.BEARINGS}
    between, computed = model.levels_db(fleet_values), model.levels_db(fleet_values, exact=True)
    assert between == pytest.approx(computed, abs=0.01)


def test_motor_and_mesh_share_the_levels(study):
    """The motor leads at the lowest speed and the gears at the highest, whatever is drawn."""
    from dataclasses import replace

    for index in (0, 1):
        drive = study.Truth.draw(index).drive()
        speeds = [20.0, 114.455]
        both = study.levels_at_4_m_db(drive, speeds)
        gears = study.levels_at_4_m_db(replace(drive, motor_lines_db=()), speeds)
        assert both[0] - gears[0] > 3.0
        assert both[1] - gears[1] < 1.0


# ---------------------------------------------------------------- a few seeds


def run(study, known_levels, free, scatter_db, seeds, misfit=None, model_sigma_db=0.0):
    case = study.Case(free, scatter_db, misfit, model_sigma_db)
    assert case in set(study.cases())
    found = []
    for index in sorted({seed % study.TRUTHS for seed in seeds}):
        mine = [seed for seed in seeds if seed % study.TRUTHS == index]
        found += study.rows_of(case, index, mine, known_levels[misfit, index])
    return study.scores(case, found)


@pytest.mark.parametrize("free", ["two", "three"])
def test_parameters_come_back_with_honest_intervals(study, known_levels, free):
    result = run(study, known_levels, free, 0.3, [0, 1, 10, 11, 20, 21, 30, 31])
    for key, score in result["parameters"].items():
        for level, stated in (("68", 0.68), ("95", 0.95)):
            held = score[f"covered{level}"]
            assert band(held["k"], held["n"])[1] >= stated, (key, level, held)
        assert abs(score["bias"]) < 4.0 * score["scatter"] / math.sqrt(8), key


def test_five_parameters_are_flagged(study, known_levels):
    result = run(study, known_levels, "five", 1.0, [0, 10, 1, 11])
    assert result["flagged_as_not_identifiable"] == 4


@pytest.mark.parametrize("model_sigma_db", [4.0, None])
def test_a_truth_that_the_model_does_not_have_is_still_covered(study, known_levels, model_sigma_db):
    result = run(study, known_levels, "two", 0.3, [0, 1, 10, 11], "both", model_sigma_db)
    for key, score in result["parameters"].items():
        held = score["covered95"]
        assert band(held["k"], held["n"])[1] >= 0.9, (key, held)


# ---------------------------------------------------------------- the record


def test_the_record_is_of_these_sources(study, record):
    """Who changes a module that the calibration rests on runs the study again."""
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"
    assert record["seed"] == study.SEED
    assert list(record["cases"]) == [case.name for case in study.cases()]


def test_the_record_holds_the_truths(study, record, known_levels):
    """All are drawn again, and one is computed again."""
    assert len(record["truths"]) == len(list(study.truths()))
    for row, truth in zip(record["truths"], study.truths(), strict=True):
        assert (row["misfit"], row["index"]) == (truth.misfit, truth.index)
        for name in ("constant_db", "mesh_damping_ratio", "motor_gain_db", "bearing_damping_ratio"):
            assert row[name] == pytest.approx(getattr(truth, name), rel=1e-12)
    again = study.levels_of(study.Truth.draw(3, "both"))
    assert again == pytest.approx(known_levels["both", 3], abs=1e-4)


def test_the_record_covers_what_it_states(study, record):
    """Two and three parameters: the exact band of each coverage holds the stated one, or lies above it where intervals
    are cut off by bounds.
    """
    for case in study.cases():
        if case.misfit is not None or case.free == "five":
            continue
        result = record["cases"][case.name]
        assert result["seeds"] == study.SEEDS
        for key, score in result["parameters"].items():
            for level, stated in (("68", 0.68), ("95", 0.95)):
                held, where = score[f"covered{level}"], (case.name, key, level)
                assert held["n"] >= 0.95 * study.SEEDS, where  # of a few blind fits there is no interval
                low, high = band(held["k"], held["n"])
                assert high >= stated, where
                if score["open95"] == 0:
                    assert low <= stated, where


def test_the_record_has_no_bias_where_the_scatter_is_small(study, record):
    """Beyond its own standard error at 0.3 dB, where the model is near to straight; 3.9 is passed by chance at 1e-4."""
    for free in ("two", "three"):
        result = record["cases"][study.Case(free, 0.3).name]
        for key, score in result["parameters"].items():
            assert abs(score["bias_over_its_standard_error"]) < 3.9, (free, key)


def test_the_record_flags_five_parameters(study, record):
    for case in study.cases():
        if case.free == "five":
            result = record["cases"][case.name]
            assert result["flagged_as_not_identifiable"] == result["seeds"] == study.SEEDS


def test_the_record_covers_a_truth_that_the_model_does_not_have(study, record):
    """At least 90 %: with the default of the model's scatter everywhere. Where the scatter is fitted, a motor that is
    6 dB louder than the fleet says is taken for gears (README.md): what the intervals miss then, doubts have to say.
    """
    for case in study.cases():
        if case.misfit is None:
            continue
        result = record["cases"][case.name]
        assert result["missed_by_95_and_not_flagged"] <= 0.02 * result["seeds"], case.name
        for key in result["parameters"]:
            for side in ("higher", "lower"):
                held, where = result[side][key], (case.name, key, side)
                assert held["n"] >= 0.475 * study.SEEDS, where
                if case.model_sigma_db is not None or side == "higher" or case.misfit != "damping":
                    assert held["k"] >= 0.9 * held["n"], where
