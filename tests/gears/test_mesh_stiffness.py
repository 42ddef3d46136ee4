"""Stiffness of the mesh: ISO 6336-1 method B by hand, and the printed example of ISO/TR 6336-30."""

import math
import re
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from reference_drive import reference_geometry

from tdacoustic.errors import GearError
from tdacoustic.gears import GearGeometry, mesh_stiffness

N_PER_MM_UM = 1e9

SPUR = GearGeometry((40, 40), 3e-3, math.radians(20), 0.0, (0.0, 0.0), 1.0, 0.25, 0.02)
SHIFTED = GearGeometry((25, 60), 3e-3, math.radians(20), math.radians(15), (0.3, 0.1), 1.0, 0.25, 0.05)


def test_spur_pair_by_hand(conformance):
    # q' = 0.04723 + 0.15551/40 + 0.25791/40 = 0.0575655 mm um/N; C_B = 1 + 0.5 (1.2 - 1.25) = 0.975
    # c' = 0.8 x 0.975 / 0.0575655 = 13.549783; contact ratio 2 (sqrt(21^2 - 18.793852^2) - 20 sin 20) / 2.952131
    # = 2 (9.369691 - 6.840403) / 2.952131 = 1.713534; c_g = 13.549783 (0.75 x 1.713534 + 0.25) = 20.800961
    found = mesh_stiffness(SPUR)
    source = "standard: ISO 6336-1, method B, by hand"
    conformance(
        "tooth stiffness c', z = 40/40", 13.549783, found.single_n_per_m2 / N_PER_MM_UM, 1e-6, "N/(mm um)", source
    )
    conformance(
        "mesh stiffness c_gamma, z = 40/40", 20.800961, found.mesh_n_per_m2 / N_PER_MM_UM, 1e-5, "N/(mm um)", source
    )
    assert found.normal_n_per_m == pytest.approx(found.mesh_n_per_m2 * 0.02, rel=1e-14)
    assert found.doubts == ()


def test_shifted_helical_pair_by_hand(conformance):
    # sin beta_b = sin 15 cos 20 = 0.2432103; cos^2 beta_b cos beta = 0.9408487 x 0.9659258 = 0.9087901
    # z_n = 27.50910, 66.02183
    # q' = 0.04723 + 0.15551/27.50910 + 0.25791/66.02183 - 0.00635 x 0.3 - 0.11654 x 0.3/27.50910
    #      - 0.00193 x 0.1 - 0.24188 x 0.1/66.02183 + 0.00529 x 0.09 + 0.00182 x 0.01
    #    = 0.04723 + 0.00565304 + 0.00390643 - 0.001905 - 0.00127092 - 0.000193 - 0.00036636 + 0.0004761 + 0.0000182
    #    = 0.05354849; c' = 0.8 x 0.975 x 0.9659258 / 0.05354849 = 14.069906
    found = mesh_stiffness(SHIFTED)
    source = "standard: ISO 6336-1, method B, by hand"
    # Seven digits of the hand's figures.
    conformance(
        "tooth stiffness c', z = 25/60, 15 deg",
        14.069906,
        found.single_n_per_m2 / N_PER_MM_UM,
        2e-5,
        "N/(mm um)",
        source,
    )


def test_first_example_of_the_technical_report(conformance):
    # Example 1: z = 17/103, m_n = 8 mm, beta = 15.8 deg, x = 0.145/0, basic rack D of ISO 53 (h_fP = 1.4 m_n).
    # Its tips are rounded to what a drawing has: 0.03 % in the contact ratio.
    pair = GearGeometry((17, 103), 8e-3, math.radians(20), math.radians(15.8), (0.145, 0.0), 1.0, 0.4, 0.1)
    found = mesh_stiffness(pair)
    source = "standard: ISO/TR 6336-30:2017, example 1"
    conformance("c'", 12.37047, found.single_n_per_m2 / N_PER_MM_UM, 0.0001, "N/(mm um)", source)
    conformance("c_gamma_alpha", 17.46485, found.mesh_n_per_m2 / N_PER_MM_UM, 0.0004 * 17.46, "N/(mm um)", source)


@pytest.mark.parametrize(("teeth", "helix_deg", "shift"), [
    ((25, 60), 0.0, (0.2, 0.0)), ((25, 60), 10.0, (0.2, 0.0)), ((40, 80), 20.0, (0.0, 0.0)),
    ((20, 100), 15.0, (0.4, 0.2)), ((31, 104), 4.0, (0.3, 0.1)),
])  # fmt: skip
def test_typical_gears_have_about_the_simplified_stiffness(teeth, helix_deg, shift, conformance):
    # ISO 6336-1, method C: c' = 14 and c_gamma = 20 N/(mm um) for steel, 1.2 < epsilon < 1.9, rough by its own word.
    pair = GearGeometry(teeth, 4e-3, math.radians(20), math.radians(helix_deg), shift, 1.0, 0.25, 0.05)
    found = mesh_stiffness(pair)
    source = "standard: ISO 6336-1, method C"
    conformance(
        f"tooth stiffness c', {teeth}, {helix_deg} deg",
        14.0,
        found.single_n_per_m2 / N_PER_MM_UM,
        1.4,
        "N/(mm um)",
        source,
    )
    rough, mesh = "method C is one value for all gears, rough by its own word", found.mesh_n_per_m2 / N_PER_MM_UM
    conformance(f"mesh stiffness c_gamma, {teeth}, {helix_deg} deg", 20.0, mesh, 3.0, "N/(mm um)", source, rough)


@given(st.floats(0.05, 0.5), st.floats(17.0, 25.0))
def test_basic_rack_factor(clearance, pressure_angle_deg):
    # C_B = (1 + 0.5 (1.2 - h_fP/m_n)) (1 - 0.02 (20 deg - alpha_n)), one and the same q'.
    angle = math.radians(pressure_angle_deg)
    found = mesh_stiffness(replace(SPUR, clearance_coefficient=clearance, pressure_angle_rad=angle))
    factor = (1.0 + 0.5 * (0.2 - clearance)) * (1.0 + 0.02 * (pressure_angle_deg - 20.0))
    assert found.single_n_per_m2 / N_PER_MM_UM == pytest.approx(0.8 * factor / 0.0575655, rel=1e-6)


@given(st.floats(0.0, math.radians(35.0)), st.floats(0.01, 0.3))
def test_stiffness_along_the_normal_line_is_that_of_the_same_energy(helix, width):
    pair = replace(SHIFTED, helix_angle_rad=helix, face_width_m=width)
    found = mesh_stiffness(pair)
    # A transverse compression d_t has the normal part d_n = d_t cos beta_b, and both hold the energy k d²/2.
    transverse = found.mesh_n_per_m2 * width
    normal = math.cos(math.asin(math.sin(helix) * math.cos(math.radians(20.0))))
    assert 0.5 * found.normal_n_per_m * normal**2 == pytest.approx(0.5 * transverse, rel=1e-13)


@given(st.floats(0.5, 50.0))
def test_stiffness_of_a_width_does_not_depend_on_the_size_of_the_teeth(factor):
    larger = mesh_stiffness(replace(SHIFTED, normal_module_m=factor * SHIFTED.normal_module_m))
    assert larger.single_n_per_m2 == pytest.approx(mesh_stiffness(SHIFTED).single_n_per_m2, rel=1e-12)


@given(st.integers(17, 60), st.integers(20, 100), st.floats(0.0, 0.5), st.floats(-0.4, 0.4))
def test_more_teeth_are_stiffer(z1, z2, x1, x2):
    try:
        few = GearGeometry((z1, z2), 3e-3, math.radians(20), 0.0, (x1, x2), 1.0, 0.25, 0.02)
        many = replace(few, teeth=(z1 + 5, z2 + 5))
    except GearError:
        assume(False)
    # The coefficients of 1/z, 0.15551 - 0.11654 x1 and 0.25791 - 0.24188 x2, are above zero for these shifts.
    assert mesh_stiffness(many).single_n_per_m2 > mesh_stiffness(few).single_n_per_m2


# ------------------------------------------------------------------------------ doubts and refusals


@pytest.mark.parametrize(("pair", "doubt"), [
    (reference_geometry(), r"transverse contact ratio 2\.052 is above 2; ISO 6336-1 was made for lower ones"),
    (replace(SPUR, addendum_coefficient=0.6), r"contact ratio 1\.\d+ is below 1\.2, .* may give too stiff a mesh"),
    (replace(SHIFTED, helix_angle_rad=math.radians(33)), "helix angle 33° is above the 30° of ISO 6336-1"),
    (replace(SHIFTED, profile_shift=(0.1, 0.3)), r"profile shifts 0\.1 and 0\.3 are outside .*x1 >= x2"),
    (replace(SHIFTED, profile_shift=(-0.3, -0.3)), r"profile shifts -0\.3 and -0\.3 are outside .*-0\.5 <= x1 \+ x2"),
])  # fmt: skip
def test_pair_outside_of_the_method_is_doubted(pair, doubt):
    found = mesh_stiffness(pair).doubts
    assert len(found) == 1
    assert re.search(doubt, found[0])


def test_teeth_without_stiffness_in_the_series_are_refused():
    deep = replace(SPUR, clearance_coefficient=2.3)
    with pytest.raises(GearError, match=r"gives no stiffness for 40 and 40 teeth .* dedendum of 3\.3 modules"):
        mesh_stiffness(deep)
