"""The CSV contracts: columns, order, spelling of numbers and of what is not determined."""

import csv
import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.tables import COLUMNS, csv_text
from tdacoustic.tables.schema import TEXT_COLUMNS

DESIGN = Path(__file__).resolve().parents[3] / "shared" / "design.md"

CONTRACT = {
    "quality": "run channel check verdict detail",
    "levels": "run condition train_speed_km_h channel component quantity rms level_db reference laeq_db background_db "
    "correction",
    "bands": "run condition channel band_hz level_db filter_dependent",
    "lines": "run condition channel component frequency_hz frequency_error_hz level_db prominence_db order family",
    "sources": "condition channel frequency_hz level_db radiator excitation source conflict confidence evidence",
    "dominance": "condition train_speed_km_h weighting dominant motor_share gearbox_share ambiguous_share "
    "unassigned_share line_fraction dominant_excitation confidence",
}
"""design.md, section Tables."""


@pytest.mark.parametrize("name", CONTRACT)
def test_columns_are_those_of_the_contract_and_then_more(name):
    columns = CONTRACT[name].split()
    assert COLUMNS[name].split()[: len(columns)] == columns
    assert len(set(COLUMNS[name].split())) == len(COLUMNS[name].split())


@pytest.mark.parametrize("name", CONTRACT)
def test_the_contract_here_is_that_of_the_design(name):
    if not DESIGN.is_file():
        pytest.skip("the design is not beside this checkout")
    (line,) = [line for line in DESIGN.read_text(encoding="utf-8").splitlines() if line.startswith(f"| `{name}.csv` |")]
    said = re.sub(r"\([^()]*\)", "", line.split("|")[2])
    assert said.replace(",", " ").split() == CONTRACT[name].split()


def test_no_number_is_kept_as_text():
    numeric = [c for c in TEXT_COLUMNS if c.endswith(("_hz", "_db", "_km_h", "_share")) or c in ("rms", "confidence")]
    assert numeric == []


def test_spelling():
    frame = pd.DataFrame(
        {
            "condition": pd.Series(["1", "ä, ö", 'say "x"'], dtype="str"),
            "level_db": [1 / 3, np.nan, -0.5],
            "conflict": [True, False, True],
            "family": pd.Series(["a", None, ""], dtype="str"),
        }
    )
    assert csv_text(frame) == (
        'condition,level_db,conflict,family\n1,0.333333333,true,a\n"ä, ö",,false,\n"say ""x""",-0.5,true,\n'
    )


def test_an_empty_table_keeps_its_header():
    assert csv_text(pd.DataFrame({"a": pd.Series([], dtype="str"), "b": pd.Series([], dtype="float64")})) == "a,b\n"


@given(st.lists(st.floats(-1e9, 1e9), min_size=1), st.lists(st.text(st.characters(categories=["L", "N"])), min_size=1))
def test_what_is_written_is_read_back(numbers, words):
    n = min(len(numbers), len(words))
    frame = pd.DataFrame({"x": numbers[:n], "word": pd.Series(words[:n], dtype="str")})
    text = csv_text(frame)
    assert "\r" not in text
    back = pd.read_csv(io.StringIO(text), dtype={"word": str}, keep_default_na=False)
    assert np.allclose(back["x"], frame["x"], rtol=1e-8, atol=0.0)
    assert list(back["word"]) == list(frame["word"])


HOSTILE = [
    "=1+1",
    "+1+1",
    "-1+1",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "\n=1",
    "＝1+1",
    "a;=1+1",
    'a";=cmd|" /C calc"!A0',
    "x\n=1",
]


def test_no_text_is_a_formula_and_numbers_stay():
    frame = pd.DataFrame(
        {
            "detail": pd.Series([*HOSTILE, "-3.5", "+7", "plain", None], dtype="str"),
            "mixed": pd.Series([*HOSTILE, -3.5, "-x", True, None], dtype=object),
            "level_db": np.arange(len(HOSTILE) + 4) - 20.0,
        }
    )
    text = csv_text(frame)
    read = pd.read_csv(io.StringIO(text), dtype="str", keep_default_na=False)
    for before, after in zip(HOSTILE, read["detail"], strict=False):
        assert after != before and after.replace("'", "").split() == before.replace("'", "").split()
    assert list(read["detail"])[-4:] == ["-3.5", "+7", "plain", ""]
    assert list(read["mixed"])[-4:] == ["-3.5", "'-x", "True", ""]
    assert list(read["level_db"])[:2] == ["-20", "-19"]
    assert len(text.splitlines()) == 1 + len(frame)
    # however a spreadsheet splits the lines, at commas or at semicolons, no cell begins with what it would run
    for separator in (",", ";", "\t"):
        cells = [cell.strip('"') for line in text.splitlines()[: len(HOSTILE)] for cell in line.split(separator)]
        assert not [cell for cell in cells if cell[:1] in tuple("=@＝") or re.match(r"[+-].*[^\d.+-]", cell)]


@given(st.text(max_size=40))
def test_a_text_comes_back_but_for_line_breaks_and_formulas(text):
    frame = pd.DataFrame({"a": pd.Series([text, "x"], dtype="str")})
    first, *others = list(csv.reader(io.StringIO(csv_text(frame).split("\n", 1)[1], newline="")))
    assert others == [["x"]]
    held = re.sub("[\x00-\x1f\x7f-\x9f\u2028\u2029]+", " ", text).strip() if not text.isprintable() else text
    assert first in ([], [""], [held], [text]) or "'" in first[0]
    assert not (first or [""])[0].startswith(("=", "@"))
