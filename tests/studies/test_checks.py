"""Numbers and features of another source beside made-up numbers of a model."""

import math
from pathlib import Path

import numpy as np
import pytest
from plain_fleets import plain_fleet

from tdacoustic.fleet import load_fleet
from tdacoustic.fleet.studies import Feature, Reference
from tdacoustic.studies import QUANTITIES, Case, Variation, check_feature, check_reference
from tdacoustic.studies.responses import SCAN_DB, SCAN_FACTORS, STEP_DB, STEP_RELATIVE, Responses
from tdacoustic.studies.words import feature_words, number_words, reference_words

LEVELS = np.array([81.0, 84.0, 88.0, 77.0])
GAIN = Variation("model.structure_gain_db", "assumed", 0.0, "level")
DAMPING = Variation("gear_dynamics.mesh_damping_ratio", "assumed", 0.05, "relative")
KNOWN = Variation("operation.torque_n_m", "drawing 12", 5913.0, "relative")
CASES = tuple(Case("conditions", str(number), 20.0 * number) for number in (1, 2, 3, 4))


def made_up(levels=LEVELS, alike=0.9):
    """Level of condition 3 follows the gain, that of condition 4 minus 10 lg of the damping; nothing else moves."""

    def values(gain_db=0.0, factor=1.0):
        found = np.full((4, len(QUANTITIES)), math.nan)
        found[:, QUANTITIES.index("spl_4m_db")] = levels + np.array([0.0, 0.0, gain_db, -10.0 * math.log10(factor)])
        found[:, QUANTITIES.index("dte_pp_um")] = 10.0 ** (levels / 20.0)
        found[:, QUANTITIES.index("loudest_deg")] = (90.0, 100.0, 80.0, 270.0)
        return found

    gains = [values(gain_db=amount) for amount in (-STEP_DB, STEP_DB, *SCAN_DB)]
    factors = [values(factor=amount) for amount in (1.0 - STEP_RELATIVE, 1.0 + STEP_RELATIVE, *SCAN_FACTORS)]
    known = [values(-5.0), values(5.0)] + [np.full((4, len(QUANTITIES)), math.nan)] * len(SCAN_DB)
    stacked = np.stack([np.stack(rows) for rows in (gains, factors, known)])
    return Responses(
        CASES, values(), np.array([alike, math.nan]), (GAIN, DAMPING, KNOWN), stacked,
        np.full((3, len(gains), 2), alike), (),
    )  # fmt: skip


def feature(**values):
    return Feature(**{"quantity": "spl_4m_db", "origin": "a book", **values})


def test_a_feature_that_no_single_number_takes_away():
    levels = np.array([81.0, 84.0, 86.0, 70.0])
    check = check_feature(feature(shape="rises_then_falls"), made_up(levels))
    assert check.holds is True
    assert check.margin == pytest.approx(86.0 - 84.0 + 0.5)  # the least of its steps
    gain = check.findings.influences[0]
    assert (gain.key, gain.per) == (GAIN.key, "+1 dB")
    assert gain.change == pytest.approx(1.0)
    # however low condition 3 comes, condition 2 stays a peak
    assert check.findings.moves == ()
    assert check.findings.closest is not None
    assert check.findings.closest.margin == pytest.approx(0.5)  # both at 84 dB: half a decibel of dip is allowed


def test_a_feature_that_is_there_and_what_takes_it_away():
    levels = np.array([78.0, 81.5, 88.0, 82.0])
    check = check_feature(feature(shape="rises_then_falls"), made_up(levels))
    (move,) = check.findings.moves
    assert (move.key, move.kind) == (GAIN.key, "level")
    assert move.amount == pytest.approx(-5.5)  # 88 - 5.5 is half a decibel above the last
    assert move.value == pytest.approx(-5.5)
    assert move.size == pytest.approx(5.5 / 12.0)


def test_a_feature_that_is_missing_and_what_brings_it():
    levels = np.array([81.0, 84.0, 86.0, 87.0])
    check = check_feature(feature(shape="rises_then_falls"), made_up(levels))
    assert check.holds is False
    assert check.margin == pytest.approx(86.0 - 87.0 - 0.5)
    by_gain, by_damping = check.findings.moves
    assert by_gain.amount == pytest.approx(1.5)
    # between two values of the scan the place is interpolated: 20 % apart, and here linear in lg
    assert by_damping.amount == pytest.approx(10.0**0.15, rel=1e-9)
    assert by_damping.value == pytest.approx(0.05 * 10.0**0.15, rel=1e-9)
    assert KNOWN.key not in {one.key for one in (*check.findings.moves, *check.findings.influences)}


def test_nothing_brings_it_and_what_comes_nearest():
    levels = np.array([81.0, 60.0, 50.0, 100.0])
    check = check_feature(feature(shape="rises_then_falls"), made_up(levels))
    assert check.findings.moves == ()
    assert check.findings.closest is not None
    # the best peak is condition 3 with all the gain of the scan, still below the last
    assert check.findings.closest.key == GAIN.key
    assert check.findings.closest.margin == pytest.approx(50.0 + 12.0 - 100.0 - 0.5)


@pytest.mark.parametrize(
    ("values", "margin"),
    [
        ({"shape": "highest_at", "at": ("3", "4")}, 4.0),
        ({"shape": "highest_at", "at": ("1",)}, -7.0),
        ({"shape": "lowest_at", "at": ("4",)}, 4.0),
        ({"shape": "span", "value": 10.0}, 2.0 - 1.0),
        ({"shape": "span", "value": 10.0, "tolerance": 0.5}, 0.5 - 1.0),
        ({"shape": "above", "quantity": "spl_4m_db", "than": ("spl_4m_db",)}, 0.0),
        ({"shape": "rises_then_falls", "quantity": "dte_pp_um"}, 3.5),  # in 20 lg
        ({"shape": "toward", "quantity": "loudest_deg", "value": 90.0}, 22.5 - 180.0),
        ({"shape": "alike", "quantity": "pattern", "value": 0.8}, 0.1),
    ],
    ids=str,
)
def test_margins_of_features(values, margin):
    assert check_feature(feature(**values), made_up()).margin == pytest.approx(margin)


def test_what_cannot_be_said():
    silent = check_feature(feature(shape="rises_then_falls", quantity="motor_spl_4m_db"), made_up())
    assert silent.holds is None
    assert math.isnan(silent.margin)
    assert check_feature(feature(shape="flat", over="helix"), made_up()).holds is None
    assert check_feature(feature(shape="alike", quantity="pattern", over="helix", value=0.8), made_up()).holds is None


def test_numbers_beside_the_models():
    check = check_reference(Reference(quantity="spl_4m_db", condition=("3",), value=91.0, origin="a book"), made_up())
    assert (check.value, check.difference, check.holds) == (88.0, -3.0, False)
    (move,) = check.findings.moves
    assert (move.key, move.amount) == (GAIN.key, pytest.approx(3.0))
    near = check_reference(Reference(quantity="spl_4m_db", condition=("3",), value=88.5, origin="a book"), made_up())
    assert near.holds is True
    assert near.findings.moves == ()


def test_where_the_source_leaves_the_condition_open_the_nearest_counts():
    either = Reference(quantity="spl_4m_db", condition=("2", "3"), value=83.0, origin="a book")
    check = check_reference(either, made_up())
    assert check.case is not None
    assert (check.case.name, check.difference) == ("2", 1.0)


def test_amplitudes_differ_in_decibels_and_directions_the_short_way_round():
    level = Reference(quantity="dte_pp_um", condition=("1",), value=10.0 ** (75.0 / 20.0), origin="a book")
    assert check_reference(level, made_up()).difference == pytest.approx(6.0)
    turned = Reference(quantity="loudest_deg", condition=("4",), value=350.0, origin="a book")
    assert check_reference(turned, made_up()).difference == pytest.approx(-80.0)


def test_a_number_that_the_model_does_not_have():
    check = check_reference(Reference(quantity="spl_4m_db", condition=("9",), value=80.0, origin="a book"), made_up())
    assert check.holds is None
    silent = Reference(quantity="motor_spl_4m_db", condition=("1",), value=80.0, origin="a book")
    assert check_reference(silent, made_up()).holds is None


@pytest.fixture(scope="module")
def fleet():
    return load_fleet(plain_fleet("crrc-freight"))


def test_sentences_of_features(fleet):
    levels = np.array([81.0, 84.0, 86.0, 87.0])
    words = feature_words(check_feature(feature(shape="rises_then_falls"), made_up(levels)), fleet)
    assert words.claim == "Level at 4 m rises, then falls with speed (a book)"
    assert words.verdict == (
        "not reproduced; the model has 81.0, 84.0, 86.0, 87.0 dB in conditions 1, 2, 3, 4, 1.5 dB short."
    )
    assert words.hangs_on == (
        "Of the assumed parameters it depends most on structure gain (+1.00 dB for +1 dB) and mesh damping ratio "
        "(+0.43 dB for +10 %)."
    )
    assert words.moved == (
        "A single assumed parameter brings it: structure gain +1.5 dB or mesh damping ratio at 0.0706 (×1.41)."
    )
    said = feature_words(check_feature(feature(shape="alike", quantity="pattern", value=0.95), made_up()), fleet)
    assert said.verdict == (
        "not reproduced; the least alike two correlate with 0.90, asked are 0.95, 0.05 in correlation short."
    )
    gone = feature_words(check_feature(feature(shape="flat", quantity="motor_spl_4m_db"), made_up()), fleet)
    assert gone.verdict == "cannot be said: there is no value of the motor's level at 4 m in conditions 1, 2, 3, 4."


def test_sentences_of_numbers(fleet):
    told = Reference(quantity="spl_4m_db", condition=("3",), value=91.0, kind="measured", origin="a book")
    words = reference_words(check_reference(told, made_up()), fleet)
    assert words.text.startswith(
        "Level at 4 m, condition 3, measured 91 dB (a book): the model has 88.0 dB, \u22123.0 dB."
    )
    assert words.moved == "A single assumed parameter brings it there: structure gain +3.0 dB."


def test_parameters_in_words(fleet):
    assert number_words("gear_dynamics.pinion_bearing_stiffness_n_per_m.2", fleet) == "pinion bearing stiffness y"
    assert number_words("gear_dynamics.mass_kg.1", fleet) == "pinion mass"
    assert number_words("motor.excitation.2.sound_power_level_db", fleet) == "sound power level of carrier x2"
    assert number_words("gear_pair.1.transmission_error_um.1", fleet) == "transmission error"
    assert number_words("housing.loss_factor", fleet) == "housing loss factor"
    assert number_words("gear_pair.1.helix_angle_deg", fleet) == "helix angle"


def test_the_papers_numbers_stand_in_its_fleet():
    """Against the table of the paper's numbers beside the checkout, where it is at hand."""
    fleet = load_fleet(Path(__file__).resolve().parents[2] / "calibration" / "crrc-freight")
    values = {(one.quantity, one.condition, one.kind): one.value for one in fleet.reference}
    table = Path(__file__).resolve().parents[3] / "shared" / "paper" / "table5_masuda.csv"
    if not table.is_file():
        pytest.skip("the paper's tables are not at hand")
    for line in table.read_text(encoding="utf-8").splitlines()[1:]:
        condition, _, _, level = line.split(",")
        assert values["masuda_spl_1m_db", (condition,), "model"] == float(level)
    assert values["spl_4m_db", ("3",), "measured"] == 88.3
    assert len(fleet.feature) >= 10
