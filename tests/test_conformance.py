"""The comparisons with outside truths: what is a row, when a committed one is stale, and CONFORMANCE.md itself."""

import importlib.util
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conformance_page import AREAS, area_of, number, page, table_of_a_run
from conformance_rows import Kept, Row, differences, load, numbered, save
from hypothesis import example, given
from hypothesis import strategies as st

TESTS = Path(__file__).parent
ROOT = TESTS.parent
GRAVITY = Row("tests/a/test_a.py::test_g", "gravity", 9.80665, 9.8066, 0.001, "m/s²", "standard: 3rd CGPM (1901)")


def changed(**values):
    return Row(**{**GRAVITY.__dict__, **values})


# ---------------------------------------------------------------- rows


@pytest.mark.parametrize("source", ["analytic", "analytic:", "analytic: ", "hearsay: a friend", ""])
def test_a_source_says_its_kind_and_where_to_look(source):
    with pytest.raises(ValueError, match=r"gravity: source .* is no 'kind: reference', kinds: standard, paper"):
        changed(source=source)


@pytest.mark.parametrize("values", [{"tolerance": -1.0}, {"tolerance": math.inf}, {"expected": math.nan}])
def test_what_is_expected_is_a_number_with_a_tolerance(values):
    with pytest.raises(ValueError, match=r"gravity: expected .* is no statement"):
        changed(**values)


@pytest.mark.parametrize(("got", "holds"), [(9.80665, True), (9.8076, True), (9.8078, False), (math.nan, False)])
def test_the_verdict_is_the_distance_against_the_tolerance(got, holds):
    assert changed(got=got).holds is holds


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, None),
        ({"got": 9.8068}, None),  # a fifth of the tolerance: another machine
        ({"got": 9.80695}, "gravity: got 9.80695, was 9.8066"),
        ({"got": 9.9}, "gravity: does not hold now: got 9.9, was 9.8066"),
        ({"expected": 9.8067}, "gravity: expected is 9.8067, was 9.80665"),
        ({"tolerance": 0.002}, "gravity: tolerance is 0.002, was 0.001"),
        ({"unit": "N/kg"}, "gravity: unit is 'N/kg', was 'm/s²'"),
        ({"source": "literature: a book"}, "gravity: source is 'literature: a book', was 'standard: 3rd CGPM"),
    ],
)
def test_what_is_stale_is_said(values, said):
    found = differences([GRAVITY], [changed(**values)])
    assert found == [] if said is None else len(found) == 1 and said in found[0]


def test_rows_that_came_and_went_are_said():
    other = changed(what="density")
    assert differences([GRAVITY, other], [GRAVITY]) == ["tests/a/test_a.py::test_g: density: no longer recorded"]
    assert differences([GRAVITY], [GRAVITY, other]) == ["tests/a/test_a.py::test_g: density: not in the committed rows"]
    assert differences([GRAVITY, GRAVITY], [GRAVITY])[0].endswith("no longer recorded")


numbers = st.floats(-1e12, 1e12, allow_subnormal=False)


@example(0.3125, 0.0, 0.99999)  # its tolerance is kept as 1
@given(numbers, st.floats(-3.0, 3.0), st.floats(1e-12, 1e6))
def test_what_is_kept_of_a_row_is_still_that_row(expected, of_tolerance, tolerance):
    """Rounding to the digits that mean something moves neither number so far that the next run finds it stale."""
    row = changed(expected=expected, got=expected + of_tolerance * tolerance, tolerance=tolerance)
    kept = row.kept()
    if kept.holds == row.holds:  # on the very edge of the tolerance a verdict may turn by rounding
        assert differences([kept], [row]) == []
    assert kept.kept() == kept


def test_rows_come_back_from_their_file(tmp_path):
    rows = {GRAVITY.test: [GRAVITY, changed(what='a "b" | c', unit="", expected=0.0)]}
    for whole in (True, False):
        save(Kept(rows, {"Python": "3"}, whole), tmp_path / "rows.json")
        assert load(tmp_path / "rows.json") == Kept(rows, {"Python": "3"}, whole)
    assert load(tmp_path / "none.json").all() == []


# ---------------------------------------------------------------- the page


@pytest.mark.parametrize(
    ("value", "tolerance", "shown"),
    [
        (0.0, 1e-9, "0"),
        (88.3, 0.1, "88.3"),
        (127352.04, 0.5, "127352.04"),
        (9.08, 0.01, "9.08"),
        (1.0 / 3.0, 0.01, "0.333"),
        (-1e-9, 0.1, "-1e-09"),
        (2.1e9, 3e8, "2.1e+09"),
        (5.0, 0.0, "5"),
        (math.nan, 1.0, "nan"),
    ],
)
def test_numbers_have_the_digits_that_their_tolerance_leaves(value, tolerance, shown):
    assert number(value, tolerance) == shown


def test_a_page_counts_groups_and_escapes():
    rows = [GRAVITY, changed(what="a|b <i>", test="tests/spectra/test_s.py::test_b[x]", got=99.0)]
    text = table_of_a_run(rows)
    assert "2 comparisons by 2 tests, 1 of them do not hold." in text
    assert "## Spectra, third octaves, weightings, background" in text and "## A\n" in text
    assert "| a\\|b &lt;i> |" in text and "**does not hold**" in text
    assert "[test_b](tests/spectra/test_s.py)" in text


# ---------------------------------------------------------------- what is committed


@pytest.fixture(scope="module")
def committed():
    return load(TESTS / "conformance.json")


def test_the_page_is_made_of_the_rows(committed):
    assert (ROOT / "CONFORMANCE.md").read_text(encoding="utf-8") == page(committed), "edited by hand?"


def test_every_row_can_be_told_from_the_others_and_looked_up(committed):
    rows = committed.all()
    assert len(rows) > 50
    twice = [row.test + row.what for held in committed.rows.values() for (_, n), row in numbered(held).items() if n > 1]
    assert twice == []
    assert [row for row in rows if not row.holds] == []
    assert [row for row in rows if "physics.md" in row.source] == []
    assert {area_of(row.test) for row in rows} <= set(AREAS.values())


def test_links_of_the_page_lead_somewhere(committed):
    text = page(committed)
    titles = re.findall(r"^## (.*)$", text, re.M)
    for shown, anchor in re.findall(r"\[([^\]]+)\]\(#([^)]+)\)", text):
        assert shown in titles and re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-") == anchor
    for file in set(re.findall(r"\]\((tests/[^)]+)\)", text)):
        assert (ROOT / file).is_file(), file


# ---------------------------------------------------------------- a suite of its own

SUITE = """
import pytest

def test_one(conformance):
    conformance("half", 0.5, {got}, 0.1, "1", "analytic: 1 / 2")

@pytest.mark.skipif({skip}, reason="not at hand")
def test_two(conformance):
    conformance("third", 0.333, 0.333, 0.001, "1", "program: bc")
"""


def project(folder, *options):
    """A small project with two rows, committed: ``write(got, skip)`` changes it, ``run(*arguments)`` tests it."""
    (folder / "tests").mkdir()
    for name in ("conftest.py", "conformance_rows.py", "conformance_page.py", "conformance_plugin.py"):
        shutil.copy(TESTS / name, folder / "tests")
    (folder / "pyproject.toml").write_text('[tool.pytest.ini_options]\ntestpaths = ["tests"]\n', encoding="utf-8")

    def write(got="0.5", skip="False", name="test_suite.py"):
        (folder / "tests" / name).write_text(SUITE.format(got=got, skip=skip), encoding="utf-8")

    def run(*arguments, options=options):
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--import-mode=importlib"]
        command += [*options, *arguments]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    write()
    assert run("--conformance-update", options=())[0] == 0
    return write, run, folder


TWO = pytest.mark.skipif(importlib.util.find_spec("xdist") is None, reason="pytest-xdist is not installed")


@pytest.fixture(params=[(), pytest.param(("-n", "2"), marks=TWO)], ids=["one process", "two processes"])
def suite(tmp_path, request):
    return project(tmp_path, *request.param)


STALE = "CONFORMANCE.md is not what this run found"


def test_a_run_that_finds_the_committed_rows_passes(suite):
    _, run, folder = suite
    assert "| third | 0.333 | 0.333 |" in (folder / "CONFORMANCE.md").read_text(encoding="utf-8")
    code, said = run("--conformance", "reports/table.md")
    assert code == 0 and STALE not in said
    assert "2 comparisons by 2 tests, 0 of them" in (folder / "reports" / "table.md").read_text(encoding="utf-8")


def test_a_number_that_moved_fails_the_whole_suite_and_no_part_of_it(suite):
    write, run, folder = suite
    write(got="0.55")
    code, said = run()
    assert code == 1 and STALE in said and "half: got 0.55, was 0.5" in said
    assert "`python -m pytest --conformance-update`" in said
    assert run("tests/test_suite.py")[0] == 0
    assert run("-k", "one")[0] == 0
    assert run("tests/test_suite.py::test_one", "--conformance-update")[0] == 0
    assert "| third |" in (folder / "CONFORMANCE.md").read_text(encoding="utf-8")  # it did not run: its row stays
    assert run()[0] == 0


def test_a_verdict_that_turned_fails_by_its_own_test(suite):
    write, run, folder = suite
    before = (folder / "tests" / "conformance.json").read_bytes()
    write(got="0.7")
    code, said = run()
    assert code == 1 and "half: expected 0.5 ± 0.1 1 (analytic: 1 / 2), got 0.7" in said
    assert run("--conformance-update")[0] == 1
    assert load(folder / "tests" / "conformance.json").all()[0].got == 0.5 and before  # nothing broken is committed


def test_rows_of_a_test_that_cannot_run_here_stay(suite):
    write, run, folder = suite
    write(skip="True")
    assert run()[0] == 0
    assert run("--conformance-update")[0] == 0
    assert "| third |" in (folder / "CONFORMANCE.md").read_text(encoding="utf-8")


ABSENT = """
from absent import a_program

a_program()
{tests}
"""


def test_rows_of_files_that_cannot_be_collected_here_stay(suite):
    """Two files are left out by one and the same line of a third."""
    _, run, folder = suite
    tests = folder / "tests"
    (tests / "absent.py").write_text("def a_program():\n    pass\n", encoding="utf-8")
    for name, what in (("test_b.py", "fourth"), ("test_c.py", "fifth")):
        test = f'def test_it(conformance):\n    conformance("{what}", 1, 1, 0, "1", "program: bc")'
        (tests / name).write_text(ABSENT.format(tests=test), encoding="utf-8")
    assert run("--conformance-update")[0] == 0
    assert len(load(tests / "conformance.json").all()) == 4
    skip = 'import pytest\n\ndef a_program():\n    pytest.skip("not at hand", allow_module_level=True)\n'
    (tests / "absent.py").write_text(skip, encoding="utf-8")
    assert run()[0] == 0
    assert run("--conformance-update")[0] == 0
    assert len(load(tests / "conformance.json").all()) == 4


def test_rows_of_a_test_that_is_gone_are_stale_and_new_ones_missing(suite):
    write, run, folder = suite
    (folder / "tests" / "test_suite.py").unlink()
    write(name="test_other.py")
    code, said = run()
    assert code == 1 and said.count("there is no such test any more, but rows of it") == 2
    assert said.count("not in the committed rows") == 2
    assert run("--conformance-update")[0] == 0
    assert "test_suite" not in (folder / "tests" / "conformance.json").read_text(encoding="utf-8")
    assert run()[0] == 0


def test_rows_collected_in_parts_are_held_and_others_are_not_missed(suite):
    _, run, folder = suite
    (folder / "tests" / "conformance.json").unlink()
    assert run("tests/test_suite.py::test_one", "--conformance-update")[0] == 0
    assert "**Not complete yet**" in (folder / "CONFORMANCE.md").read_text(encoding="utf-8")
    assert run()[0] == 0
    assert run("--conformance-update")[0] == 0
    assert "**Not complete yet**" not in (folder / "CONFORMANCE.md").read_text(encoding="utf-8")
    assert load(folder / "tests" / "conformance.json").whole


def test_a_row_that_fails_is_shown_with_those_before_it(suite):
    write, run, folder = suite
    write(got='0.5, 0.1, "1", "analytic: 1 / 2")\n    conformance("half again", 0.5, 0.7')
    assert run("--conformance", "table.md")[0] == 1
    assert "3 comparisons by 2 tests, 1 of them do not hold" in (folder / "table.md").read_text(encoding="utf-8")


# ---------------------------------------------------------------- several processes

WHERE = """
import os
import pytest

@pytest.mark.parametrize("case", range(4))
def test_where(conformance, case):
    conformance("process", os.getpid(), os.getpid(), 0, "1", "known input: the operating system")
"""


@TWO
def test_what_two_workers_found_is_what_one_process_finds(tmp_path):
    write, run, folder = project(tmp_path)
    files = folder / "tests" / "conformance.json", folder / "CONFORMANCE.md"
    alone = [file.read_bytes() for file in files]
    (folder / "tests" / "conformance.json").unlink()
    write(got="0.45")
    assert run("-n", "2", "--conformance-update")[0] == 0
    assert [file.read_bytes() for file in files] != alone
    write()
    assert run("-n", "2", "--conformance-update")[0] == 0
    assert [file.read_bytes() for file in files] == alone


@TWO
def test_each_worker_tells_the_rows_of_its_tests(tmp_path):
    _, run, folder = project(tmp_path, "-n", "2")
    (folder / "tests" / "test_where.py").write_text(WHERE, encoding="utf-8")
    assert run("tests/test_where.py", "--conformance-update")[0] == 0
    rows = load(folder / "tests" / "conformance.json").rows
    pids = [held[0].got for test, held in rows.items() if "test_where" in test]
    assert len(pids) == 4 and len(set(pids)) == 2


@TWO
def test_rows_of_a_test_that_killed_its_worker_stay(tmp_path):
    write, run, folder = project(tmp_path, "-n", "2")
    before = (folder / "tests" / "conformance.json").read_bytes()
    write(got="__import__('os')._exit(3)")
    code, said = run("--conformance-update")
    assert code == 1 and "crashed while running 'tests/test_suite.py::test_one'" in said
    assert (folder / "tests" / "conformance.json").read_bytes() == before
