"""The comparisons with outside truths: what is a row, when a committed one is stale, and CONFORMANCE.md itself."""

import importlib.util
import math
import re
from pathlib import Path

import pytest
from conformance_page import AREAS, area_of, number, page, table_of_a_run
from conformance_rows import Kept, Row, differences, load, numbered, save
from hypothesis import example, given
from hypothesis import strategies as st

pytest_plugins = "pytester"
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
        ({"note": "a reason"}, "gravity: note is 'a reason', was ''"),
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


@pytest.mark.parametrize(
    ("values", "wide"),
    [
        ({"expected": 60.0, "tolerance": 0.5, "unit": "dB"}, False),
        ({"expected": 60.0, "tolerance": 0.6, "unit": "dB"}, True),
        ({"expected": 0.0, "tolerance": 0.6, "unit": "dB/km"}, True),
        ({"expected": 0.0, "tolerance": 2.0, "unit": "%"}, False),
        ({"expected": 0.0, "tolerance": 2.1, "unit": "%"}, True),
        ({"expected": -10.0, "tolerance": 1.0, "unit": "Hz"}, False),
        ({"expected": -10.0, "tolerance": 1.1, "unit": "Hz"}, True),
        ({"expected": 0.0, "tolerance": 0.01, "unit": "1"}, False),
        ({"expected": 0.0, "tolerance": 0.02, "unit": "1"}, True),
        ({"expected": 0.0, "tolerance": 0.02, "unit": "of the swing"}, True),
        ({"expected": 0.0, "tolerance": 5.0, "unit": "Hz"}, False),
    ],
)
def test_what_a_wide_tolerance_is(values, wide):
    assert changed(**values).wide is wide


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
    rows = {GRAVITY.test: [GRAVITY, changed(what='a "b" | c', unit="1", expected=0.0, note="a reason")]}
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
    assert "2 comparisons by 2 tests: 1 hold, 1 do not." in text
    assert "## Spectra, third octaves, weightings, background" in text and "## A\n" in text
    assert "| a\\|b &lt;i> |" in text and "**does not hold**" in text
    assert "[test_b](tests/spectra/test_s.py)" in text
    assert "| **all** | 2 | 1 | 2 |" in text


def test_what_does_not_hold_comes_first_with_its_reason():
    text = table_of_a_run([GRAVITY, changed(what="weight", got=99.0, note="no data are printed")])
    first, _, rest = text.partition("## By area and kind of truth")
    assert "| weight | 9.8066 | 99 | 0.001 | m/s² | no data are printed | standard: 3rd CGPM (1901) |" in first
    assert "gravity" not in first and "| weight |" in rest and "wide" not in text
    assert "## What does not hold\n\nNothing.\n" in table_of_a_run([GRAVITY])


def test_the_reason_of_a_wide_tolerance_stands_beside_the_source():
    text = table_of_a_run([changed(tolerance=2.0, note="measured with a pendulum")])
    assert "| standard: 3rd CGPM (1901) (wide: measured with a pendulum) |" in text


def test_rows_of_an_area_are_sorted_by_kind_source_and_number():
    names = ["order 10", "order 9.5", "order 2"]
    rows = [changed(what=name, source="analytic: rings") for name in names] + [changed(what="order 11")]
    text = table_of_a_run(rows)
    places = [text.index(f"| {name} |") for name in ("order 11", "order 2", "order 9.5", "order 10")]
    assert places == sorted(places)


def test_studies_stand_in_the_area_of_what_they_study():
    assert area_of("tests/evidence/test_orders_evidence.py::test_a") == AREAS["orders"]
    assert area_of("tests/evidence/test_tacholess_evidence.py::test_a") == AREAS["speed"]


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
    assert [row for row in rows if not row.holds and not row.note] == []
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
    conformance("half", 0.5, {got}, 0.1, "1", "analytic: 1 / 2", "a reason")

@pytest.mark.skipif({skip}, reason="not at hand")
def test_two(conformance):
    conformance("third", 0.333, 0.333, 0.001, "1", "program: bc")
"""
CONFTEST = f"""
import sys

sys.path.insert(0, {str(TESTS)!r})
from conformance_plugin import conformance, pytest_addoption, pytest_configure
"""
STALE = "CONFORMANCE.md is not what this run found"
TWO = pytest.mark.skipif(importlib.util.find_spec("xdist") is None, reason="pytest-xdist is not installed")


class Suite:
    """A small project with two rows, committed. It runs in this process; its workers, where it has any, do not."""

    def __init__(self, pytester):
        self.pytester, self.folder = pytester, pytester.path
        self.tests = self.folder / "tests"
        self.tests.mkdir()
        self.rows_file, self.page_file = self.tests / "conformance.json", self.folder / "CONFORMANCE.md"
        (self.tests / "conftest.py").write_text(CONFTEST, encoding="utf-8")
        settings = '[tool.pytest.ini_options]\ntestpaths = ["tests"]\n'
        (self.folder / "pyproject.toml").write_text(settings, encoding="utf-8")
        self.write()
        assert self.run("--conformance-update")[0] == 0

    def write(self, got="0.5", skip="False", name="test_suite.py"):
        (self.tests / name).write_text(SUITE.format(got=got, skip=skip), encoding="utf-8")

    def run(self, *arguments):
        """Return the exit code of pytest and what it said."""
        options = ("-q", "-p", "no:cacheprovider", "--import-mode=prepend")
        done = self.pytester.runpytest_inprocess(*options, *arguments)
        return int(done.ret), done.stdout.str()

    def rows(self):
        return load(self.rows_file).all()

    def page(self):
        return self.page_file.read_text(encoding="utf-8")


@pytest.fixture
def suite(pytester, monkeypatch):
    monkeypatch.setattr("sys.dont_write_bytecode", True)  # else a test written twice in a second is the older one
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    return Suite(pytester)


def test_a_run_that_finds_the_committed_rows_passes(suite):
    assert "| third | 0.333 | 0.333 |" in suite.page()
    code, said = suite.run("--conformance", "reports/table.md")
    assert code == 0 and STALE not in said
    table = (suite.folder / "reports" / "table.md").read_text(encoding="utf-8")
    assert "2 comparisons by 2 tests: 2 hold, 0 do not." in table


def test_a_number_that_moved_fails_the_whole_suite_and_no_part_of_it(suite):
    suite.write(got="0.55")
    code, said = suite.run()
    assert code == 1 and STALE in said and "half: got 0.55, was 0.5" in said
    assert "`python -m pytest --conformance-update`" in said
    assert suite.run("tests/test_suite.py")[0] == 0
    assert suite.run("-k", "one")[0] == 0
    assert suite.run("tests/test_suite.py::test_one", "--conformance-update")[0] == 0
    assert "| third |" in suite.page()  # it did not run: its row stays
    assert suite.run()[0] == 0


def test_a_verdict_that_turned_fails_by_its_own_test(suite):
    before = suite.rows_file.read_bytes()
    suite.write(got="0.7")
    code, said = suite.run()
    assert code == 1 and "half: expected 0.5 ± 0.1 1 (analytic: 1 / 2), got 0.7" in said
    assert suite.run("--conformance-update")[0] == 1
    assert suite.rows_file.read_bytes() == before  # nothing broken is committed


DEVIATION = '0.7, 0.1, "1", "paper: Table 9", {note}, deviates=True)\n    conformance("half again", 0.5, 0.5'


def test_a_deviation_is_stated_with_its_reason_and_held_like_any_row(suite):
    suite.write(got=DEVIATION.format(note='"no data are printed"'))
    code, said = suite.run()
    assert code == 1 and "half: source is 'paper: Table 9', was 'analytic: 1 / 2'" in said
    assert suite.run("--conformance-update")[0] == 0 and suite.run()[0] == 0
    assert "| half | 0.5 | 0.7 | 0.1 | 1 | no data are printed | paper: Table 9 |" in suite.page()
    suite.write(got=DEVIATION.format(note='"no data are printed"').replace("0.7", "0.9"))
    code, said = suite.run()
    assert code == 1 and STALE in said and "half: got 0.9, was 0.7" in said
    suite.write(got=DEVIATION.format(note='"no data are printed"').replace("0.7", "0.55"))
    code, said = suite.run()
    assert code == 1 and "half: stated as a deviation, but it holds: got 0.55" in said
    suite.write(got=DEVIATION.format(note='""'))
    assert "half: a deviation needs a note that says why" in suite.run()[1]


AGAIN = '")\n    conformance("half again", 0.5, 0.5'


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ('0.5, 0.2, "1", "analytic: 1 / 2', "half: ± 0.2 1 is wide and needs a note that says why"),
        ('0.5, 0.01, "", "analytic: 1 / 2', "half: the unit is missing; of a plain number it is '1'"),
    ],
)
def test_a_row_without_the_reason_of_a_wide_tolerance_or_a_unit_is_refused(suite, row, said):
    suite.write(got=row + AGAIN)
    code, found = suite.run()
    assert code == 1 and said in found


def test_rows_of_a_test_that_cannot_run_here_stay(suite):
    suite.write(skip="True")
    assert suite.run()[0] == 0
    assert suite.run("--conformance-update")[0] == 0
    assert "| third |" in suite.page()


ABSENT = """
from absent import a_program

a_program()
{tests}
"""


def absent_program(suite):
    """Two files are left out by one and the same line of a third; returns what takes the program away."""
    module = suite.tests / "absent.py"
    module.write_text("def a_program():\n    pass\n", encoding="utf-8")
    importlib.invalidate_caches()  # this process has looked into the folder before
    for name, what in (("test_b.py", "fourth"), ("test_c.py", "fifth")):
        test = f'def test_it(conformance):\n    conformance("{what}", 1, 1, 0, "1", "program: bc")'
        (suite.tests / name).write_text(ABSENT.format(tests=test), encoding="utf-8")
    assert suite.run("--conformance-update")[0] == 0
    skip = 'import pytest\n\ndef a_program():\n    pytest.skip("not at hand", allow_module_level=True)\n'
    return lambda: module.write_text(skip, encoding="utf-8")


def test_rows_of_files_that_cannot_be_collected_here_stay(suite):
    absent_program(suite)()
    code, said = suite.run()
    assert code == 0 and "2 skipped" in said
    assert suite.run("--conformance-update")[0] == 0
    assert len(suite.rows()) == 4


CASES = """
import pytest

@pytest.mark.parametrize("case", {cases})
def test_case(conformance, case):
    conformance(case, 1, 1, 0, "1", "known input: a list")
"""


def test_rows_of_cases_that_are_not_at_hand_here_stay(suite):
    """A test without any case is skipped under another name."""
    file = suite.tests / "test_cases.py"
    file.write_text(CASES.format(cases=["a", "b"]), encoding="utf-8")
    assert suite.run("--conformance-update")[0] == 0
    assert len(suite.rows()) == 4
    file.write_text(CASES.format(cases=[]), encoding="utf-8")
    assert suite.run()[0] == 0
    assert suite.run("--conformance-update")[0] == 0
    assert len(suite.rows()) == 4


def test_rows_that_a_test_records_no_longer_are_stale(suite):
    (suite.tests / "test_suite.py").write_text("def test_one():\n    pass\n", encoding="utf-8")
    code, said = suite.run()
    assert code == 1 and "test_one: half: no longer recorded" in said
    assert suite.run("--conformance-update")[0] == 0
    assert suite.rows() == []


def test_rows_of_a_test_that_is_gone_are_stale_and_new_ones_missing(suite):
    (suite.tests / "test_suite.py").unlink()
    suite.write(name="test_other.py")
    code, said = suite.run()
    assert code == 1 and said.count("there is no such test any more, but rows of it") == 2
    assert said.count("not in the committed rows") == 2
    assert suite.run("--conformance-update")[0] == 0
    assert "test_suite" not in suite.rows_file.read_text(encoding="utf-8")
    assert suite.run()[0] == 0


def test_rows_collected_in_parts_are_held_and_others_are_not_missed(suite):
    suite.rows_file.unlink()
    assert suite.run("tests/test_suite.py::test_one", "--conformance-update")[0] == 0
    assert "**Not complete yet**" in suite.page()
    assert suite.run()[0] == 0
    assert suite.run("--conformance-update")[0] == 0
    assert "**Not complete yet**" not in suite.page()
    assert load(suite.rows_file).whole


def test_a_row_that_fails_is_shown_with_those_before_it(suite):
    suite.write(got='0.5, 0.01, "1", "analytic: 1 / 2")\n    conformance("half again", 0.5, 0.7')
    assert suite.run("--conformance", "table.md")[0] == 1
    table = (suite.folder / "table.md").read_text(encoding="utf-8")
    assert "3 comparisons by 2 tests: 2 hold, 1 do not" in table


# ---------------------------------------------------------------- several processes

WHERE = """
import os
import pytest

@pytest.mark.parametrize("case", range(4))
def test_where(conformance, case):
    conformance("process", os.getpid(), os.getpid(), 0, "1", "known input: the operating system")
"""


@TWO
def test_what_two_workers_found_is_what_one_process_finds(suite):
    files = suite.rows_file, suite.page_file
    alone = [file.read_bytes() for file in files]
    for file in files:
        file.unlink()
    assert suite.run("-n", "2", "--conformance-update")[0] == 0
    assert [file.read_bytes() for file in files] == alone


@TWO
def test_each_worker_tells_the_rows_of_its_tests(suite):
    (suite.tests / "test_where.py").write_text(WHERE, encoding="utf-8")
    assert suite.run("-n", "2", "tests/test_where.py", "--conformance-update")[0] == 0
    pids = [row.got for row in suite.rows() if row.what == "process"]
    assert len(pids) == 4 and len(set(pids)) == 2


@TWO
def test_two_workers_find_what_is_stale_gone_missing_and_what_cannot_run_here(suite):
    suite.write(name="test_gone.py")
    absent_program(suite)()
    suite.write(got="0.55")
    (suite.tests / "test_gone.py").rename(suite.tests / "test_new.py")
    code, said = suite.run("-n", "2")
    assert code == 1 and STALE in said and "half: got 0.55, was 0.5" in said
    assert said.count("there is no such test any more, but rows of it") == 2
    assert said.count("not in the committed rows") == 2
    said = said.partition(STALE)[2]
    assert "test_b.py" not in said and "test_c.py" not in said  # skipped as a whole, which only the workers saw


@TWO
def test_a_part_of_the_suite_is_not_judged_by_two_workers_either(suite):
    suite.write(got="0.55")
    assert suite.run("-n", "2", "-k", "one")[0] == 0


@TWO
def test_rows_of_a_test_that_killed_its_worker_stay(suite):
    before = suite.rows_file.read_bytes()
    suite.write(got="__import__('os')._exit(3)")
    code, said = suite.run("-n", "2", "--conformance-update")
    assert code == 1 and "crashed while running 'tests/test_suite.py::test_one'" in said
    assert suite.rows_file.read_bytes() == before
