"""The housing study: whether its record is of these sources, and what it must hold."""

import ast
from pathlib import Path

import pytest
from studies import study_module

HERE = Path(__file__).parent
RERUN = "python tests/evidence/run_housing_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("housing_study", "housing") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


@pytest.fixture(scope="module")
def ours(record):
    """The grid as the program makes it by itself."""
    return next(row for row in record["grids"] if (row["edges_over_ours"], row["order"]) == (1.0, 4))


def response(record, reach, corrected):
    """Worst level and worst difference by frequency."""
    rows = [row for row in record["responses"] if row["corrected"] is corrected]
    rows = [row for row in rows if row["modes_up_to_hz"] == pytest.approx(reach)]
    return {row["frequency_hz"]: (abs(row["worst_level_db"]), row["worst_difference_percent"]) for row in rows}


def test_the_record_is_of_these_sources(study, record):
    """Who changes a module of the housing runs the study again."""
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"
    assert record["tetrahedra"]["sources_sha256"] == study.tetrahedra_sources(), f"stale: {RERUN} --tetrahedra"
    assert len(record["tetrahedra"]["cases"]) == len(study.TETRAHEDRA)
    assert [(row["edges_over_ours"], row["order"]) for row in record["grids"]] == list(study.GRIDS)


def test_the_tetrahedra_use_nothing_of_the_program():
    tree = ast.parse((HERE / "housing_tetrahedra.py").read_text(encoding="utf-8"))
    names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    names |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    assert not {name for name in names if name.startswith("tdacoustic")}


def test_mass_is_that_of_another_geometry(study, record, conformance):
    for case in record["tetrahedra"]["cases"]:
        box = study.reference_box()
        what = f"mass of the reference housing, tetrahedra of order {case['order']}"
        conformance(what, case["mass_kg"], box.mass_kg, 0.01, "kg", "program: OpenCASCADE, volume of its solid")


def test_modes_are_those_of_tetrahedra(study, record, ours, conformance):
    """Both come from above; tetrahedra do so from farther, and the finer they are the less."""
    worst = []
    for case in record["tetrahedra"]["cases"]:
        found = study.apart(ours["frequency_hz"], case["frequency_hz"], case["highest_hz"])
        worst.append(abs(found["worst_percent"]))
        if case["order"] < 4:
            continue
        assert abs(found["median_percent"]) < 0.5
        source = "program: NGSolve on tetrahedra of an OpenCASCADE solid"
        what = f"modes of the reference housing, order {case['order']}, worst of {found['modes']}"
        conformance(what, 0.0, found["worst_percent"], 1.0, "%", source)
    assert worst == sorted(worst, reverse=True)


def test_modes_have_converged_within_one_percent(study, record, ours):
    finest = record["finest"]["frequency_hz"]
    found = study.apart(ours["frequency_hz"], finest, study.HIGHEST_HZ)
    assert found["modes"] > 80
    assert 0.0 < found["median_percent"] < 0.5
    assert abs(found["worst_percent"]) < 1.0


def test_finer_grids_come_nearer(study, record):
    rows = {(row["edges_over_ours"], row["order"]): row["frequency_hz"] for row in record["grids"]}
    finest = record["finest"]["frequency_hz"]
    median = {key: study.apart(hz, finest, study.HIGHEST_HZ)["median_percent"] for key, hz in rows.items()}
    assert median[1.4, 4] > median[1.0, 4] > median[0.7, 4] > 0.0
    assert median[1.0, 3] > 2.0 * median[1.0, 4]


def test_modal_responses_are_direct_ones(study, record):
    """With what the program keeps: 1.2 times the highest frequency and the static correction."""
    found = response(record, 1.2 * study.HIGHEST_HZ, True)
    assert list(found) == list(study.RESPONSE_HZ)
    for frequency_hz, (level_db, difference_percent) in found.items():
        assert level_db < 0.5, frequency_hz
        if frequency_hz < 0.7 * study.HIGHEST_HZ:
            assert level_db < 0.05
            assert difference_percent < 2.0


def test_the_correction_is_worth_having(study, record):
    for reach in (1.0, 1.2):
        with_it, without = (response(record, reach * study.HIGHEST_HZ, corrected) for corrected in (True, False))
        for frequency_hz in study.RESPONSE_HZ:
            assert with_it[frequency_hz][1] < without[frequency_hz][1]
