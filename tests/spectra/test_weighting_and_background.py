"""The A curve against the standard's table; levels corrected for background."""

import numpy as np
import pytest

from tdacoustic.spectra import a_weighting_db, correct_for_background

IEC_61672_1_TABLE_3 = {  # nominal frequency in Hz: (exponent of the exact one re 1 kHz in tenths of a decade, dB)
    31.5: (-15, -39.4),
    63.0: (-12, -26.2),
    125.0: (-9, -16.1),
    250.0: (-6, -8.6),
    500.0: (-3, -3.2),
    1000.0: (0, 0.0),
    2000.0: (3, 1.2),
    4000.0: (6, 1.0),
    8000.0: (9, -1.1),
    16000.0: (12, -6.6),
}


@pytest.mark.parametrize("nominal", IEC_61672_1_TABLE_3)
def test_the_a_curve_is_the_standards(nominal, conformance):
    exponent, expected = IEC_61672_1_TABLE_3[nominal]
    got = float(a_weighting_db(1000.0 * 10.0 ** (exponent / 10.0)))
    # The table is rounded to 0.1 dB.
    conformance(
        f"A-weighting at {nominal:g} Hz", expected, got, 0.05 + 1e-9, "dB", "standard: IEC 61672-1:2013, table 3"
    )


def test_the_a_curve_falls_off_at_zero_and_at_one_kilohertz_is_zero():
    assert a_weighting_db(0.0) == -np.inf
    assert float(a_weighting_db(1000.0)) == 0.0
    assert a_weighting_db(np.array([10.0, 20.0])).shape == (2,)


@pytest.mark.parametrize(
    ("difference", "subtract", "kind"),
    # K1 = -10 lg(1 - 10^(-0.1 dL)), evaluated by hand to 0.01 dB: from 6 dB on by ISO 3744, down to 3 dB by ISO 3746.
    [
        (3.0, 3.02, "marginal"),
        (4.0, 2.20, "marginal"),
        (5.0, 1.65, "marginal"),
        (6.0, 1.26, "applied"),
        (7.0, 0.97, "applied"),
        (8.0, 0.75, "applied"),
        (9.0, 0.58, "applied"),
        (10.0, 0.46, "applied"),
        (15.0, 0.14, "applied"),
    ],
)
def test_background_is_taken_off_by_energy(difference, subtract, kind, conformance):
    corrected = correct_for_background(70.0 + difference, 70.0)
    conformance(
        f"correction for a background {difference:g} dB below",
        -subtract,
        corrected.level_db - 70.0 - difference,
        0.006,
        "dB",
        "standard: K1 of " + ("ISO 3744:2010, 8.2.3, formula (16)" if difference >= 6.0 else "ISO 3746:2010, 8.3.3"),
    )
    assert corrected.kind == kind


def test_a_background_too_near_leaves_the_level_and_says_so():
    for background in (77.01, 80.0, 90.0, float("nan")):
        assert correct_for_background(80.0, background) == type(correct_for_background(1.0, None))(80.0, "impossible")
    assert correct_for_background(80.0, None).kind == "none"


def test_correction_and_addition_are_inverse():
    both = 10.0 * np.log10(10**8.0 + 10**7.2)
    assert correct_for_background(float(both), 72.0).level_db == pytest.approx(80.0, abs=1e-9)
