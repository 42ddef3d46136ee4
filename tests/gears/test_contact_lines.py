"""Contact lines over the mesh: the trapezoids of the paper's equation (5) against their exact Fourier series."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from printed_equations import breaks, line_length, trapezoid
from reference_drive import reference_geometry
from scipy.integrate import quad
from scipy.optimize import brentq

from tdacoustic.errors import GearError
from tdacoustic.gears import ContactLines

RATIOS = {
    "spur": (1.6, 0.0),
    "spur, high contact ratio": (2.3, 0.0),
    "helical": (1.53, 0.36),
    "overlap larger": (1.4, 1.85),
    "both below 1": (0.7, 0.6),
    "equal": (1.25, 1.25),
    "reference drive": (2.0523, 0.3625),
}
CONSTANT = {"transverse 2": (2.0, 0.37), "transverse 1": (1.0, 0.4), "overlap 1": (1.43, 1.0), "spur 2": (2.0, 0.0)}

ratios = st.tuples(st.floats(0.4, 3.0), st.floats(0.0, 3.0)).filter(lambda pair: sum(pair) >= 1.0)


def coefficient(k, alpha, beta):
    """Fourier coefficient k of the total over its mean, by quadrature of one trapezoid from its start to its end."""
    ends = sorted({0.0, min(alpha, beta), max(alpha, beta), alpha + beta})
    found = 0j
    for start, end in itertools.pairwise(ends):
        for unit, wave in ((1.0, math.cos), (-1j, math.sin)):
            part = quad(lambda t, wave=wave: trapezoid(t, alpha, beta) * wave(2.0 * math.pi * k * t), start, end)
            found += unit * part[0]
    return found / max(alpha, beta)


@pytest.mark.parametrize("name", [*RATIOS, *CONSTANT])
def test_fourier_coefficients_are_those_of_the_trapezoid(name, conformance):
    alpha, beta = (RATIOS | CONSTANT)[name]
    found = ContactLines(alpha, beta).fourier(12)
    assert found[0] == 1.0
    worst = max(abs(found[k] - coefficient(k, alpha, beta)) for k in range(1, 13))
    what = f"Fourier coefficients of the contact lines, {name} ({alpha:g}, {beta:g}), worst of 12"
    # What the quadrature claims for itself is 1e-14 to 1e-9.
    conformance(what, 0.0, worst, 1e-9, "1", "independent: quadrature of the trapezoid of the paper's equation (5)")


@pytest.mark.parametrize("name", [name for name in RATIOS if "spur" not in name])
def test_fourier_series_is_the_spectrum_of_the_sampled_total(name):
    lines = ContactLines(*RATIOS[name])
    size = 2**14
    spectrum = np.fft.rfft(lines.relative(np.arange(size) / size), norm="forward")
    # Harmonics k + j size fold back, each at most 1/(pi² (j size)² alpha beta): together 1/(3 alpha beta size²).
    assert np.abs(spectrum[:65] - lines.fourier(64)).max() < 1.05 / (3.0 * math.prod(RATIOS[name]) * size**2)


@pytest.mark.parametrize("alpha", [1.6, 2.3])
def test_fourier_series_of_spur_teeth_is_the_spectrum_of_a_square_wave(alpha):
    # With the jump half way between two samples the samples are a square wave's, whose series aliases in phase.
    size = 2000
    times = (np.arange(size) + 0.5) / size
    spectrum = np.fft.rfft(ContactLines(alpha, 0.0).relative(times), norm="forward")
    k = np.arange(41)
    aligned = spectrum[:41] * np.exp(-1j * np.pi * k / size) * np.sinc(k / size)
    assert np.abs(aligned - ContactLines(alpha, 0.0).fourier(40)).max() < 1e-12


@given(ratios)
def test_total_is_the_sum_of_all_pairs_of_teeth(ratio):
    lines = ContactLines(*ratio)
    times = np.linspace(-1.37, 2.41, 41)
    expected = [line_length(t, *ratio) for t in times]
    # A very short ramp of a nearly spur pair makes a rounded time a rounded length.
    assert lines.relative(times) == pytest.approx(
        expected, abs=1e-9 if min(ratio) == 0.0 else 1e-11 / min(1.0, min(ratio))
    )


@given(ratios.filter(lambda pair: pair[1] > 0.01))
def test_total_has_mean_1_and_no_jumps(ratio):
    lines = ContactLines(*ratio)
    at = breaks(*ratio)
    # Between its kinks the total is a straight line: the trapezoidal rule is exact.
    mean = sum(0.5 * float(lines.relative([a, b]).sum()) * (b - a) for a, b in itertools.pairwise(at))
    assert mean == pytest.approx(1.0, abs=1e-9)
    tiny = 1e-9
    steepest = 2.0 * math.ceil(sum(ratio)) / (min(ratio) * max(ratio))
    for t in at:
        left, right = lines.relative([t - tiny, t + tiny])
        assert abs(right - left) <= 2.0 * tiny * steepest + 1e-12


@given(ratios, st.floats(-5.0, 5.0))
def test_both_ratios_may_change_places(ratio, t):
    if min(ratio) == 0.0:
        return
    lines, turned = ContactLines(*ratio), ContactLines(*ratio[::-1])
    assert turned.relative(t) == lines.relative(t)
    assert turned.fourier(5) == pytest.approx(lines.fourier(5), abs=1e-15)


@pytest.mark.parametrize("name", CONSTANT)
def test_length_is_constant_where_a_ratio_is_a_whole_number(name):
    lines = ContactLines(*CONSTANT[name])
    assert lines.is_constant
    assert lines.relative(np.linspace(0.0, 1.0, 101)) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(lines.fourier(50)[1:]).max() < 1e-15


@pytest.mark.parametrize("name", RATIOS)
def test_length_is_not_constant_elsewhere(name):
    lines = ContactLines(*RATIOS[name])
    assert not lines.is_constant
    assert np.ptp(lines.relative(np.linspace(0.0, 1.0, 101))) > 1e-3


def test_overlap_far_below_one_is_no_whole_number():
    assert not ContactLines(1.5, 1e-13).is_constant
    assert not ContactLines(1.5, 0.0).is_constant


def test_square_wave_of_spur_teeth_has_one_pair_or_two():
    lines = ContactLines(1.6, 0.0)
    assert lines.relative([0.0, 0.3, 0.599]) == pytest.approx(2.0 / 1.6)
    assert lines.relative([0.601, 0.999]) == pytest.approx(1.0 / 1.6)


# ------------------------------------------------------------------------------ lengths in m


def longest_on_one_pair(pair):
    """Longest line in the rectangle of the field of action, face width by path of contact, at the base helix angle.

    The line of all points with u = c + w tan beta_b, u along the path of contact and w across the face; the largest
    part of it inside of the rectangle is looked for over c.
    """
    path, width, slope = pair.path_of_contact_m, pair.face_width_m, math.tan(pair.base_helix_angle_rad)

    def inside(c):
        w = np.linspace(0.0, width, 100_001)
        held = (c + slope * w >= 0.0) & (c + slope * w <= path)
        return held.mean() * width / math.cos(pair.base_helix_angle_rad)

    return max(inside(c) for c in np.linspace(-slope * width, path, 101))


@pytest.mark.parametrize("helix_deg", [4.0, 12.0, 30.0])
def test_longest_line_of_one_pair_is_that_in_the_field_of_action(helix_deg):
    pair = reference_geometry(helix_deg)
    lines = ContactLines(pair.transverse_contact_ratio, pair.overlap_ratio)
    alpha, beta = pair.transverse_contact_ratio, pair.overlap_ratio
    width, helix = pair.face_width_m, pair.base_helix_angle_rad
    # The total is the sum of trapezoids of this height: half way up, one pair alone, where no other is.
    longest = width / math.cos(helix) if beta <= alpha else pair.path_of_contact_m / math.sin(helix)
    assert longest == pytest.approx(longest_on_one_pair(pair), rel=1e-4)
    times = np.linspace(0.0, 1.0, 33)
    expected = [longest * sum(float(lines.on_one_pair(t + n)) for n in range(math.ceil(alpha + beta))) for t in times]
    assert lines.length_m(times, width, helix) == pytest.approx(expected, rel=1e-12)


def test_overlap_of_the_steep_pair_is_the_larger_ratio():
    pair = reference_geometry(40.0)
    assert pair.overlap_ratio > pair.transverse_contact_ratio
    lines = ContactLines(pair.transverse_contact_ratio, pair.overlap_ratio)
    longest = pair.path_of_contact_m / math.sin(pair.base_helix_angle_rad)
    assert longest == pytest.approx(longest_on_one_pair(pair), rel=1e-4)
    mean = lines.length_m(np.arange(4096) / 4096, pair.face_width_m, pair.base_helix_angle_rad).mean()
    # Each trapezoid has the area longest x overlap.
    assert mean == pytest.approx(longest * pair.overlap_ratio, rel=1e-6)


def test_spur_teeth_touch_over_the_face_width():
    lines = ContactLines(1.4, 0.0)
    assert lines.length_m([0.2, 0.7], 0.05, 0.0) == pytest.approx([0.1, 0.05])


def test_line_of_one_pair_grows_to_half_where_the_trapezoid_says():
    lines = ContactLines(1.5, 0.4)
    half = brentq(lambda t: float(lines.on_one_pair(t)) - 0.5, 0.0, 0.4)
    assert half == pytest.approx(0.2, abs=1e-12)
    assert lines.on_one_pair([-0.1, 0.0, 0.4, 1.5, 1.7, 1.9, 2.5]) == pytest.approx([0.0, 0.0, 1.0, 1.0, 0.5, 0.0, 0.0])


@pytest.mark.parametrize("ratio", [(0.6, 0.3), (0.0, 1.5), (-1.0, 3.0), (1.5, -0.1), (math.nan, 0.0), (1.5, math.inf)])
def test_impossible_ratios_are_refused(ratio):
    with pytest.raises(GearError, match=r"contact ratios must be > 0 .* together >= 1, got"):
        ContactLines(*ratio)
