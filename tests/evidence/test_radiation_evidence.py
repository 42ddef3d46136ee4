"""The radiation study: what its record must hold, whether it is of these sources, and some of its rows again."""

import ast
from pathlib import Path

import numpy as np
import pytest
from studies import study_module

HERE = Path(__file__).parent
RERUN = "python tests/evidence/run_radiation_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("radiation_study") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


@pytest.fixture(scope="module")
def fields(record):
    return record["fields"]["cases"]


# ---------------------------------------------------------------- the record


def test_the_record_is_of_these_sources(study, record):
    """Who changes a module of the boundary elements runs our side again, which takes half a minute."""
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"
    others = record["fields"]["sources_sha256"]
    assert others == study.fields_sources(), f"the other codes' side is stale: {RERUN} --fields"


def test_the_other_codes_use_nothing_of_the_program():
    for name in ("radiation_cases", "radiation_bempp", "radiation_ngsolve"):
        tree = ast.parse((HERE / f"{name}.py").read_text(encoding="utf-8"))
        names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        names |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        assert not {name for name in names if name.startswith(("tdacoustic", "radiation_study"))}, name


def test_the_record_has_all_rows(study, record, fields):
    for case in study.CASES:
        assert "bempp-cl" in fields[case.name]
        for density in study.densities(case):
            rows = [row for row in rows_of(record, case) if row["panels_per_wavelength"] == density]
            assert {row["reference"] for row in rows} == set(study.others(case, fields))
    assert sum("ngsolve.bem" in result for result in fields.values()) == 4


def sourced(reference):
    """Return where the other side of a comparison comes from."""
    if reference == "series":
        return "analytic: series of the sphere in spherical Hankel functions"
    return f"program: {reference}, recorded by tests/evidence/run_radiation_study.py"


def rows_of(record, case):
    return [row for row in record["comparisons"] if row["case"] == case.name]


def test_the_other_codes_have_small_errors_of_their_own(record, fields):
    """Coarser grids differ from theirs by less than ours do, and the two codes agree."""
    for name, result in fields.items():
        for code, field in result.items():
            assert field["coarser_against_this"]["l2_at_4_m_percent"] < 1.0, (name, code)
            assert abs(field["coarser_against_this"]["mean_level_at_4_m_db"]) < 0.05, (name, code)
    for row in record["between_others"]:
        assert row["l2_at_4_m_percent"] < 1.0, row
        assert abs(row["mean_level_at_4_m_db"]) < 0.05, row


def test_ours_are_the_fields_of_other_codes(record):
    """Mean levels at 4 m: within 0.35 dB with 7.5 panels a wavelength and 500 in all, 0.1 dB with 15 and 2000.

    With fewer in all the claim fails, however long the wave: scattering needs the most. The program gives the box 648
    at the least (third row of 200 Hz).
    """
    for row in record["comparisons"]:
        density, panels = row["panels_per_wavelength"], row["panels"]
        band = 0.1 if density >= 15.0 and panels >= 2000 else 0.35 if density >= 15.0 or panels >= 500 else 0.75
        assert abs(row["mean_level_at_4_m_db"]) < band, row
    few = [row for row in record["comparisons"] if row["panels"] < 100]
    assert max(abs(row["mean_level_at_4_m_db"]) for row in few) > 0.35  # else the exception above is to go


def test_levels_converge_on_finer_grids(study, record):
    """Within 0.35 dB at 7.5 panels a wavelength and 0.1 dB at 11, and less and less."""
    for frequency in study.SWEEP_HZ:
        rows = [row for row in record["convergence"] if row["frequency_hz"] == frequency]
        worst = {row["panels_per_wavelength"]: row["worst_db"] for row in rows}
        assert list(worst) == list(study.SWEEP)
        assert all(len(row["off_db"]) == len(study.PATTERNS) for row in rows)
        assert worst[7.5] < 0.35
        assert worst[11.0] < 0.1
        assert list(worst.values()) == sorted(worst.values(), reverse=True)


def test_energy_is_kept(record):
    """Through 4 m passes what passes through 12 m, but for a near field of 1/(kr)²; the surface gives as much."""
    for row in record["energy"]:
        near_field = 10.0 * np.log10(1.0 + 1.0 / (2.0 * np.pi * row["frequency_hz"] / 343.2 * 4.0) ** 2)
        assert abs(row["through_4_m_over_12_m_db"]) < 0.03 + 3.0 * near_field, row
        if row["efficiency"] > 0.5:
            assert abs(row["out_of_surface_over_12_m_db"]) < 0.1, row


# ---------------------------------------------------------------- again


@pytest.mark.parametrize("name", ["panel of the box, 3 x 2 half waves, 525 Hz", "rigid box, point source, 525 Hz"])
def test_a_row_of_the_box_again(study, record, fields, conformance, name):
    case = next(case for case in study.CASES if case.name == name)
    recorded = {row["reference"]: row for row in rows_of(record, case) if row["panels_per_wavelength"] == 7.5}
    for row in study.comparison(case, 7.5, fields):
        for figure, value in row.items():
            expected = recorded[row["reference"]][figure]
            assert value == (pytest.approx(expected, abs=2e-3) if isinstance(value, float) else expected), figure
        level, source = row["mean_level_at_4_m_db"], sourced(row["reference"])
        conformance(
            f"{name}, 576 panels, against {row['reference']}: mean level at 4 m", 0.0, level, 0.35, "dB", source
        )


def test_a_row_of_the_sphere_again(study, record, fields, conformance):
    case = next(case for case in study.CASES if case.name == "sphere, ka = 2")
    for row in study.comparison(case, 15.0, fields):
        assert row in record["comparisons"] or row["reference"] == "series"
        what = f"sphere of five motions, ka = 2, 384 panels, against {row['reference']}: L2 difference at 4 m"
        source = sourced(row["reference"])
        note = "the coarsest grid of the study, 8 by 8 panels on each of six faces; the error falls with the grid"
        conformance(what, 0.0, row["l2_at_4_m_percent"], 4.0, "%", source, note)
