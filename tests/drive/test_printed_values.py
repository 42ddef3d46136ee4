"""The demonstration's drive beside what the paper prints of its own: what is met, and openly what is not.

The paper prints no stiffness, damping, mass, transmission error or motor data; the demonstration assumes them
(calibration/crrc-freight/fleet.toml), so that most of these numbers can be met by chance only. The levels at 4 m take
boundary elements and a calibration: they are read from the demonstration's committed tables.
"""

import csv
from pathlib import Path

import pytest

from tdacoustic.drive import DriveModel
from tdacoustic.fleet import load_fleet

ROOT = Path(__file__).resolve().parents[2]
TABLE_5_DB = {"1": 70.7811, "2": 85.5865, "3": 84.9987, "4": 92.8384, "5": 93.6556, "6": 88.5417}
OPEN = (
    "power, definition of the displacement and constant of equation (8) are open, and the paper's own two levels of "
    "condition 5 differ by 7.1 dB; bearings, masses and damping are not printed but assumed"
)
WITHIN = "the original formula states 5 dB about measured gear units; 1 dB is what the demonstration asks of its model"
CHOSEN = (
    "1 dB is what the demonstration asks of its model; its motor's sound powers are assumed, and chosen for this level"
)
HOUSING = "no housing, bearing or motor data are printed; ours are assumed"


@pytest.fixture(scope="module")
def states():
    model = DriveModel(load_fleet(ROOT / "calibration" / "crrc-freight"))
    return {condition.name: model.gears(condition) for condition in model.conditions}


@pytest.mark.parametrize("condition", TABLE_5_DB)
def test_masudas_level_of_table_5(condition, states, conformance):
    met = condition == "2"
    what, got = f"Masuda's level at 1 m, condition {condition}", states[condition].masuda_db
    printed, note = TABLE_5_DB[condition], WITHIN if met else OPEN
    conformance(what, printed, got, 1.0, "dB", "paper: Table 5", note, deviates=not met)


def test_what_section_4_3_prints_of_condition_5(states, conformance):
    state = states["5"]
    what, source = "Masuda's level at 1 m, condition 5, by the text", "paper: section 4.3"
    conformance(what, 86.517, state.masuda_db, 1.0, "dB", source, OPEN, deviates=True)
    what, dte_um = "dynamic transmission error, peak to peak, condition 5", 1e6 * state.steady.dte_pp_m
    why = "no transmission error of the teeth is printed; a sine of 5 um is assumed"
    conformance(what, 14.8491, dte_um, 0.5, "um", "paper: section 4.3, Fig. 11", why, deviates=True)


@pytest.mark.parametrize(
    ("condition", "kind", "printed", "note", "deviates"),
    [
        ("1", "model", 81.3, CHOSEN, False),
        ("3", "model", 84.2, CHOSEN, False),
        ("4 or 5", "model", 88.0, HOUSING, True),
        ("6", "model", 77.3, HOUSING, True),
        ("3", "measured", 88.3, "measured, where the paper's own model has 84.2 dB and ours was brought there", True),
    ],
)
def test_levels_at_4_m_of_figure_16(condition, kind, printed, note, deviates, conformance):
    text = (ROOT / "reports" / "example" / "references.csv").read_text(encoding="utf-8")
    asked = ("spl_4m_db", condition, kind)
    (row,) = [r for r in csv.DictReader(text.splitlines()) if (r["quantity"], r["condition"], r["kind"]) == asked]
    what = f"mean level at 4 m, condition {condition}, {kind}, beside the demonstration's"
    source = "paper: section 5.1, Fig. 16"
    conformance(what, printed, float(row["model_value"]), 1.0, "dB", source, note, deviates=deviates)
    assert row["verdict"] == ("not reproduced" if deviates else "reproduced")
