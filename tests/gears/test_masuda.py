"""Masuda's meshing noise, equation (8) of the paper: by hand, its laws, and what the paper's numbers imply."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_drive import reference_geometry
from scipy.optimize import brentq

from tdacoustic.errors import GearError
from tdacoustic.gears import masuda_level_db
from tdacoustic.gears.masuda import SPHERE_OF_1_M_DB

PLAIN = {
    "helix_angle_rad": 0.0,
    "ratio": 1.0,
    "transverse_contact_ratio": 1.0,
    "pitch_line_speed_m_s": 0.0,
    "power_w": 1e3,
    "displacement": 1.0,
    "constant_db": 0.0,
}


@pytest.mark.parametrize(
    ("change", "by_hand"),
    [
        ({}, 20.0),
        ({"constant_db": 20.0}, 40.0),
        ({"pitch_line_speed_m_s": 5.56**2}, 20.0 * math.sqrt(2.0)),  # sqrt((5.56 + 5.56)/5.56)
        ({"pitch_line_speed_m_s": (3.0 * 5.56) ** 2}, 40.0),
        ({"ratio": 256.0}, 40.0),  # 256^(1/8) = 2
        ({"transverse_contact_ratio": 16.0}, 10.0),  # 16^(1/4) = 2
        ({"helix_angle_rad": 2.0 * math.atan(0.5)}, 10.0),  # tan(beta/2) = 1/2
        ({"power_w": 1e6}, 80.0),  # 1000 kW
        ({"power_w": -1e6}, 80.0),
        ({"displacement": 10.0}, 40.0),
        # All at once: 20 x 0.5 x 2 / 2 x 2 + 20 lg 100 + 20 lg 5 + 20
        (
            {"helix_angle_rad": 2.0 * math.atan(0.5), "ratio": 256.0, "transverse_contact_ratio": 16.0,
             "pitch_line_speed_m_s": (3.0 * 5.56) ** 2, "power_w": 1e5, "displacement": 5.0, "constant_db": 20.0},
            20.0 + 40.0 + 13.979400 + 20.0,
        ),
    ],
)  # fmt: skip
def test_level_by_hand(change, by_hand, conformance):
    what = ", ".join(f"{name} {value:.4g}" for name, value in change.items()) or "all 1"
    source = "paper: equation (8), by hand"
    conformance(f"Masuda's level, {what}", by_hand, masuda_level_db(**PLAIN | change), 1e-6, "dB", source)


def test_root_of_the_speed_is_that_of_agma():
    # AGMA's sqrt((78 + sqrt(v in ft/min))/78): 1 m/s is 196.85 ft/min.
    feet_per_minute = 10.0 / 0.3048 * 60.0
    agma = 20.0 * math.sqrt((78.0 + math.sqrt(feet_per_minute)) / 78.0)
    # 5.56 is 5.5594 rounded.
    assert masuda_level_db(**PLAIN | {"pitch_line_speed_m_s": 10.0}) == pytest.approx(agma, abs=1e-3)


@given(st.floats(1e-3, 1e3), st.floats(1.0, 1e7), st.floats(0.0, 60.0), st.floats(-30.0, 60.0))
def test_twice_the_power_or_the_displacement_is_6_db_more(displacement, power, speed, constant):
    here = PLAIN | {
        "displacement": displacement, "power_w": power, "pitch_line_speed_m_s": speed, "constant_db": constant
    }  # fmt: skip
    level, twice = masuda_level_db(**here), 20.0 * math.log10(2.0)
    assert masuda_level_db(**here | {"displacement": 2.0 * displacement}) - level == pytest.approx(twice, abs=1e-9)
    assert masuda_level_db(**here | {"power_w": 2.0 * power}) - level == pytest.approx(twice, abs=1e-9)
    assert masuda_level_db(**here | {"constant_db": constant + 3.0}) - level == pytest.approx(3.0, abs=1e-9)


@given(st.floats(0.0, 0.7), st.floats(0.01, 0.05))
def test_more_helix_angle_and_contact_are_quieter_more_speed_and_ratio_louder(helix, step):
    at = PLAIN | {"helix_angle_rad": helix, "ratio": 3.0, "transverse_contact_ratio": 1.5, "pitch_line_speed_m_s": 10.0}
    level = masuda_level_db(**at)
    assert masuda_level_db(**at | {"helix_angle_rad": helix + step}) < level
    assert masuda_level_db(**at | {"transverse_contact_ratio": 1.5 + step}) < level
    assert masuda_level_db(**at | {"ratio": 3.0 + step}) > level
    assert masuda_level_db(**at | {"pitch_line_speed_m_s": 10.0 + step}) > level


def condition_5(power_kw, displacement_um=14.8491):
    """Condition 5 of the paper: 1015.90 rpm of the motor, X as printed in section 4.3."""
    pair = reference_geometry()
    speed = 2.0 * math.pi * pair.pitch_radii_m[0] * 1015.90 / 60.0
    return masuda_level_db(
        pair.helix_angle_rad, pair.ratio, pair.transverse_contact_ratio, speed, 1e3 * power_kw, displacement_um, 20.0
    )


def test_printed_level_of_condition_5_needs_a_power_of_9(conformance):
    # physics.md section 4, where it was computed by hand: the power that is printed nowhere.
    power = brentq(lambda power: condition_5(power) - 86.517, 0.1, 1000.0)
    source = "paper: section 4.3 (86.517 dB, 14.8491 um), equation (8) solved for W by hand"
    conformance("power that the printed level of condition 5 needs", 9.08, power, 0.01, "kW", source)


def test_printed_levels_of_condition_5_contradict_each_other(conformance):
    once, table = (
        brentq(lambda power, level=level: condition_5(power) - level, 0.1, 1e4) for level in (86.517, 93.6556)
    )
    source = "paper: section 4.3 (86.517 dB) against Table 5 (93.6556 dB), 10^(7.1386/20)"
    conformance("factor in W X between section 4.3 and Table 5", 2.27, table / once, 0.01, "1", source)


def test_rated_power_of_an_axle_gives_far_more_than_is_printed():
    # physics.md section 4: 629 kW and um give 123 dB.
    assert condition_5(629.0) == pytest.approx(123.3, abs=0.5)


@pytest.mark.parametrize("change", [{"power_w": 0.0}, {"displacement": 0.0}])
def test_no_power_or_no_vibration_has_no_level(change):
    assert masuda_level_db(**PLAIN | change) is None


def test_sphere_at_1_m():
    # 4 pi m² over 1 m²: 11 dB.
    assert pytest.approx(10.992, abs=1e-3) == SPHERE_OF_1_M_DB


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ratio": 0.0}, r"ratio must be > 0, got 0\.0"),
        ({"transverse_contact_ratio": -1.0}, r"transverse_contact_ratio must be > 0, got -1\.0"),
        ({"pitch_line_speed_m_s": -1.0}, r"pitch-line speed and displacement must be >= 0, got -1\.0 and 1\.0"),
        ({"displacement": -1.0}, r"must be >= 0, got 0\.0 and -1\.0"),
        ({"displacement": math.nan}, "must be >= 0, got .* and nan"),
    ],
)
def test_value_out_of_range_is_refused(change, message):
    with pytest.raises(GearError, match=message):
        masuda_level_db(**PLAIN | change)
