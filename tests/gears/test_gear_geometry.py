"""Involute pairs: against the paper, ISO/TR 6336-30, closed forms of textbooks, and gears cut by a rack in the test."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from reference_drive import (
    CENTRE_DISTANCE_M,
    NORMAL_MODULE_M,
    PRESSURE_ANGLE_RAD,
    PROFILE_SHIFT,
    TEETH,
    reference_geometry,
)
from scipy.optimize import brentq

from tdacoustic.errors import GearError
from tdacoustic.gears import GearGeometry, helix_angle_of
from tdacoustic.gears.involute import angle_of_involute, involute


def spur(teeth, addendum=1.0, clearance=0.25, shift=(0.0, 0.0), pressure_angle_deg=20.0, module_m=1e-3):
    return GearGeometry(teeth, module_m, math.radians(pressure_angle_deg), 0.0, shift, addendum, clearance, 0.02)


# ------------------------------------------------------------------------------ the involute function


@pytest.mark.parametrize(("degrees", "printed"), [(14.5, 0.0055448), (20.0, 0.0149044), (25.0, 0.0299753)])
def test_involute_function_is_that_of_the_tables(degrees, printed, conformance):
    source = "literature: tables of inv, e.g. Dudley's Gear Handbook"
    # Half the last printed digit.
    conformance(f"involute function of {degrees} deg", printed, involute(math.radians(degrees)), 5e-8, "1", source)


@given(st.floats(1e-3, 1.5))
def test_angle_of_an_involute_is_the_way_back(angle):
    # inv grows as angle³/3, so a relative error of it is a third of that in the angle.
    assert angle_of_involute(involute(angle)) == pytest.approx(angle, rel=1e-9)


def test_no_angle_has_a_negative_involute():
    assert angle_of_involute(0.0) == 0.0
    with pytest.raises(ValueError, match=r"an involute must be >= 0, got -0\.1"):
        angle_of_involute(-0.1)


# ------------------------------------------------------------------------------ the paper's pair


def test_centre_distance_of_the_paper_gives_its_helix_angle(conformance):
    angle = helix_angle_of(CENTRE_DISTANCE_M, TEETH, NORMAL_MODULE_M, PRESSURE_ANGLE_RAD, PROFILE_SHIFT)
    source = "paper: Table 3 (a = 495 mm) with 4 deg of section 5.2"
    # 0.001 deg is 0.6 um of centre distance, well inside of what a drawing's 495 mm can mean.
    conformance("helix angle at a = 495 mm", 4.0, math.degrees(angle), 1e-3, "deg", source)
    a = reference_geometry(4.0).centre_distance_m
    conformance("centre distance at 4 deg", 495.0, 1e3 * a, 1e-3, "mm", source)


@pytest.mark.parametrize(("helix_deg", "expected_mm"), [(0.1, 493.8), (12.0, 504.9)])
def test_centre_distance_follows_the_helix_sweep(helix_deg, expected_mm):
    assert 1e3 * reference_geometry(helix_deg).centre_distance_m == pytest.approx(expected_mm, abs=0.05)


def test_pair_of_the_paper_has_the_size_that_physics_md_states():
    pair = reference_geometry()
    assert pair.transverse_contact_ratio == pytest.approx(2.05, abs=0.005)
    assert pair.overlap_ratio == pytest.approx(0.36, abs=0.005)
    assert [1e3 * radius for radius in pair.base_radii_m] == pytest.approx([107.3, 359.9], abs=0.05)
    assert math.degrees(pair.working_pressure_angle_rad) == pytest.approx(19.29, abs=0.005)


# ------------------------------------------------------------------------------ published examples and closed forms


def test_first_example_of_the_technical_report(conformance):
    # Example 1: z = 17/103, m_n = 8 mm, beta = 15.8 deg, x = 0.145 (0.14522 unrounded), a = 500 mm, 9 kN m, 360 rpm.
    source = "standard: ISO/TR 6336-30:2017, example 1"
    pair = GearGeometry((17, 103), 8e-3, math.radians(20), math.radians(15.8), (0.14522, 0.0), 1.0, 0.4, 0.1)
    conformance("centre distance", 500.0, 1e3 * pair.centre_distance_m, 1e-3, "mm", source)
    # Half the last printed digit each.
    d1 = 2.0 * pair.reference_radii_m[0]
    conformance("tangential load on the reference circle", 127352.0, 2.0 * 9e3 / d1, 0.5, "N", source)
    conformance("speed on the reference circle", 2.664, math.pi * d1 * 360.0 / 60.0, 5e-4, "m/s", source)


@pytest.mark.parametrize("teeth", [(20, 20), (18, 54), (31, 104)])
def test_spur_pair_without_shifts_meshes_at_half_the_sum_of_teeth_times_module(teeth):
    pair = spur(teeth, module_m=4e-3)
    assert pair.centre_distance_m == pytest.approx(0.5 * 4e-3 * sum(teeth), rel=1e-13)
    assert pair.working_pressure_angle_rad == pytest.approx(math.radians(20.0), rel=1e-12)
    assert pair.pitch_radii_m == pytest.approx(pair.reference_radii_m, rel=1e-13)
    assert pair.tip_clearances_m == pytest.approx((1e-3, 1e-3), rel=1e-9)


def test_contact_ratio_of_a_textbook_pair(conformance):
    # z = 20 and 40, module 1, 20 deg: r = 10, 20; r_b = 9.396926, 18.793852; r_a = 11, 21; a sin = 30 x 0.342020
    # sqrt(121 - 88.302222) = 5.718197; sqrt(441 - 353.208889) = 9.369691; minus 10.260604 = 4.827284; p_b = 2.952131
    conformance(
        "contact ratio, z = 20/40",
        1.635186,
        spur((20, 40)).transverse_contact_ratio,
        1e-6,
        "1",
        "analytic: transverse contact ratio of ISO 21771, by hand",
    )


@pytest.mark.parametrize(("pressure_angle_deg", "printed"), [(20.0, 1.981), (25.0, 1.662)])
def test_contact_ratio_tends_to_that_of_two_racks(pressure_angle_deg, printed, conformance):
    # Limit of many teeth: 4 h_a* / (pi sin 2 alpha), the textbooks' greatest contact ratio of standard spur gears.
    limit = 4.0 / (math.pi * math.sin(2.0 * math.radians(pressure_angle_deg)))
    assert limit == pytest.approx(printed, abs=5e-4)
    got = spur((10**6, 10**6), pressure_angle_deg=pressure_angle_deg).transverse_contact_ratio
    # The next term of the expansion in 1/z is of size 4/z.
    conformance(
        f"contact ratio of racks, {pressure_angle_deg} deg",
        limit,
        got,
        2e-5,
        "1",
        "analytic: addendum of one module between two racks, 4 / (pi sin 2 alpha)",
    )


def test_overlap_ratio_counts_the_axial_pitches_in_the_face_width():
    pair = reference_geometry(12.0)
    lead = 2.0 * math.pi * pair.reference_radii_m[0] / math.tan(pair.helix_angle_rad)
    assert pair.overlap_ratio == pytest.approx(pair.face_width_m / (lead / TEETH[0]), rel=1e-12)
    # The same lead on the base cylinder.
    base_lead = 2.0 * math.pi * pair.base_radii_m[0] / math.tan(pair.base_helix_angle_rad)
    assert base_lead == pytest.approx(lead, rel=1e-12)


# ------------------------------------------------------------------------------ gears cut by a rack in the test


class CutGear:
    """A tooth flank that the straight flank of a rack generates in rolling on the reference circle.

    At each roll the rack's flank touches the tooth where the normal to it passes through the pitch point of cutting.
    Neither a base circle nor an involute function is used.
    """

    def __init__(self, teeth, normal_module, pressure_angle, helix, shift):
        module = normal_module / math.cos(helix)
        alpha = math.atan(math.tan(pressure_angle) / math.cos(helix))
        self.reference = 0.5 * teeth * module
        # The flank passes (r, travel) at the angle alpha to the radius; its foot below the pitch point (r, 0) touches.
        travel = np.linspace(0.999 * self.reference * math.tan(alpha), -8.0 * module, 100_001)
        x = self.reference - travel * math.sin(alpha) * math.cos(alpha)
        y = travel * math.cos(alpha) ** 2
        roll = travel / self.reference
        self.flank = np.stack([x * np.cos(roll) + y * np.sin(roll), y * np.cos(roll) - x * np.sin(roll)])
        self.radius, self.polar = np.hypot(*self.flank), np.unwrap(np.arctan2(self.flank[1], self.flank[0]))
        # A quarter of the rack's pitch and, moved out by the shift, what its flanks have narrowed by.
        half = 0.25 * math.pi * module + shift * normal_module * math.tan(alpha)
        self.half_at_reference = half / self.reference

    def thickness(self, radius):
        turned = np.interp(radius, self.radius, self.polar) - np.interp(self.reference, self.radius, self.polar)
        return 2.0 * radius * (self.half_at_reference - float(turned))

    def contact_ratio(self, teeth, tip, centre_distance, pitch_radius, mate_tip):
        """Angle between the first and the last contact over the angle of a tooth, by the law of gearing."""
        tangent = np.gradient(self.flank, axis=1)
        normal = np.stack([-tangent[1], tangent[0]]) / np.hypot(*tangent)
        across = (self.flank * normal).sum(axis=0)
        # The gear has turned so far that the normal passes through the pitch point.
        step = -across + np.sign(across) * np.sqrt(across**2 - self.radius**2 + pitch_radius**2)
        pole = self.flank + step * normal
        turned = -np.unwrap(np.arctan2(pole[1], pole[0]))
        contact = np.stack(
            [
                np.cos(turned) * self.flank[0] - np.sin(turned) * self.flank[1],
                np.sin(turned) * self.flank[0] + np.cos(turned) * self.flank[1],
            ]
        )
        from_mate = np.hypot(contact[0] - centre_distance, contact[1])
        at_own_tip = np.interp(tip, self.radius, turned)
        at_mates_tip = np.interp(mate_tip, from_mate[::-1], turned[::-1])
        return abs(at_own_tip - at_mates_tip) / (2.0 * math.pi / teeth)


PAIRS = {
    "paper": reference_geometry(),
    "ISO/TR example 1": GearGeometry(
        (17, 103), 8e-3, math.radians(20), math.radians(15.8), (0.14522, 0.0), 1.0, 0.4, 0.1
    ),
    "spur": spur((20, 40)),
    "steep": GearGeometry((25, 60), 3e-3, math.radians(22.5), math.radians(28), (0.4, -0.2), 0.9, 0.3, 0.05),
}


@pytest.mark.parametrize("name", PAIRS)
def test_gears_cut_by_a_rack_mesh_at_the_centre_distance_and_for_the_contact_ratio(name, conformance):
    pair = PAIRS[name]
    first, second = (
        CutGear(teeth, pair.normal_module_m, pair.pressure_angle_rad, pair.helix_angle_rad, shift)
        for teeth, shift in zip(pair.teeth, pair.profile_shift, strict=True)
    )
    share = pair.teeth[0] / sum(pair.teeth)

    def play(a):
        """Pitch on the rolling circles less both teeth."""
        pitch = 2.0 * math.pi * a * share / pair.teeth[0]
        return pitch - first.thickness(a * share) - second.thickness(a * (1.0 - share))

    a = brentq(play, 0.97 * pair.centre_distance_m, 1.03 * pair.centre_distance_m, xtol=1e-12)
    source = "independent: teeth cut by a rack in the test"
    # 100 001 points of a flank, joined by straight lines: a relative 1e-8 and less.
    conformance(f"centre distance without play, {name}", 1e3 * a, 1e3 * pair.centre_distance_m, 1e-5, "mm", source)
    tips = [
        0.5 * teeth * pair.normal_module_m / math.cos(pair.helix_angle_rad)
        + pair.normal_module_m * (shift + pair.addendum_coefficient)
        for teeth, shift in zip(pair.teeth, pair.profile_shift, strict=True)
    ]
    found = first.contact_ratio(pair.teeth[0], tips[0], a, a * share, tips[1])
    conformance(f"transverse contact ratio, {name}", found, pair.transverse_contact_ratio, 1e-5, "1", source)
    for gear, tip, thickness in zip((first, second), tips, pair.tip_thicknesses_m, strict=True):
        assert thickness == pytest.approx(gear.thickness(tip), abs=1e-8 * tip)


# ------------------------------------------------------------------------------ laws

teeth = st.tuples(st.integers(17, 60), st.integers(20, 150))
shifts = st.tuples(st.floats(-0.2, 0.5), st.floats(-0.3, 0.4))
helices = st.floats(0.0, math.radians(35.0))


def pair_of(teeth, shift, helix, module_m=5e-3):
    try:
        return GearGeometry(teeth, module_m, PRESSURE_ANGLE_RAD, helix, shift, 1.0, 0.3, 0.08)
    except GearError:
        assume(False)


@given(teeth, shifts, helices)
def test_helix_angle_of_a_centre_distance_is_the_way_back(teeth, shift, helix):
    pair = pair_of(teeth, shift, helix)
    angle = helix_angle_of(pair.centre_distance_m, teeth, 5e-3, PRESSURE_ANGLE_RAD, shift)
    # The distance grows as the square of a small angle: round-off of it is 1e-15, that of the angle its root.
    assert angle**2 == pytest.approx(helix**2, abs=1e-12)
    assert pair_of(teeth, shift, angle).centre_distance_m == pytest.approx(pair.centre_distance_m, rel=1e-13)


@given(teeth, shifts, helices, st.floats(0.1, 10.0))
def test_lengths_scale_with_the_module_and_ratios_do_not(teeth, shift, helix, factor):
    pair = pair_of(teeth, shift, helix)
    larger = replace(pair, normal_module_m=factor * pair.normal_module_m, face_width_m=factor * pair.face_width_m)
    for name in ("reference", "base", "pitch", "tip", "root"):
        radii, scaled = getattr(pair, f"{name}_radii_m"), getattr(larger, f"{name}_radii_m")
        assert scaled == pytest.approx([factor * radius for radius in radii], rel=1e-12)
    for name in ("centre_distance_m", "path_of_contact_m", "base_pitch_m"):
        assert getattr(larger, name) == pytest.approx(factor * getattr(pair, name), rel=1e-12)
    for name in ("transverse_contact_ratio", "overlap_ratio", "working_pressure_angle_rad", "ratio"):
        assert getattr(larger, name) == pytest.approx(getattr(pair, name), rel=1e-12)


@given(teeth, shifts, helices)
def test_pair_is_the_same_seen_from_the_wheel(teeth, shift, helix):
    pair = pair_of(teeth, shift, helix)
    turned = pair_of(teeth[::-1], shift[::-1], helix)
    assert turned.centre_distance_m == pytest.approx(pair.centre_distance_m, rel=1e-13)
    assert turned.transverse_contact_ratio == pytest.approx(pair.transverse_contact_ratio, rel=1e-12)
    assert turned.base_pitch_m == pytest.approx(pair.base_pitch_m, rel=1e-13)
    assert turned.ratio == pytest.approx(1.0 / pair.ratio, rel=1e-13)


def test_helix_angle_is_changed_in_a_copy():
    pair = reference_geometry(4.0)
    steeper = pair.with_helix_angle(math.radians(12.0))
    assert pair.helix_angle_rad == math.radians(4.0)
    assert steeper == reference_geometry(12.0)


# ------------------------------------------------------------------------------ what cannot be made or cannot mesh


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"teeth": (0, 40)}, "teeth must be >= 1, got 0 and 40"),
        ({"teeth": (20, -5)}, "teeth must be >= 1, got 20 and -5"),
        ({"normal_module_m": -1e-3}, r"normal_module_m must be > 0, got -0\.001"),
        ({"normal_module_m": float("nan")}, "normal_module_m must be > 0, got nan"),
        ({"addendum_coefficient": 0.0}, r"addendum_coefficient must be > 0, got 0\.0"),
        ({"clearance_coefficient": -0.1}, r"clearance_coefficient must be >= 0, got -0\.1"),
        ({"face_width_m": 0.0}, r"face_width_m must be > 0, got 0\.0"),
        ({"pressure_angle_rad": 0.0}, "pressure angle must be above 0° and below 45°, got 0°"),
        ({"pressure_angle_rad": math.radians(50)}, "pressure angle must be above 0° and below 45°, got 50°"),
        ({"helix_angle_rad": math.radians(-4)}, "helix angle must be from 0° to 45°, got -4°"),
        ({"helix_angle_rad": math.radians(46)}, "helix angle must be from 0° to 45°, got 46°"),
        (
            {"profile_shift": (-0.8, -0.8)},
            "profile shifts -0.8 and -0.8 are too negative for 20 and 40 teeth: there is",
        ),
        ({"teeth": (5, 40), "profile_shift": (-1.2, 1.2)}, "the pinion has no involute flank .root radius 0.050 mm"),
        ({"profile_shift": (1.3, 0.0)}, "teeth of the pinion are pointed: with addendum 1 and profile shift 1.3"),
        ({"profile_shift": (0.0, 2.1)}, "teeth of the wheel are pointed"),
        (
            {"teeth": (10, 100)},
            r"the tip of the wheel would touch the pinion below its base circle \(10 teeth, profile",
        ),
        ({"teeth": (100, 10)}, "interference: the tip of the pinion would touch the wheel"),
        (
            {"clearance_coefficient": 0.0, "profile_shift": (0.5, 0.5)},
            r"tip of the pinion cuts \d\.\d{3} mm into the root of the wheel: .* need more clearance",
        ),
        ({"addendum_coefficient": 0.5}, r"lose contact .*transverse contact ratio 0\.\d{3}, overlap ratio 0\.000"),
    ],
)
def test_pair_that_cannot_be_is_refused_with_the_reason(change, message):
    with pytest.raises(GearError, match=message):
        replace(spur((20, 40)), **change)


@pytest.mark.parametrize(("pinion", "largest_wheel"), [(13, 16), (14, 26), (15, 45), (16, 101), (17, 1309)])
def test_largest_wheel_without_interference_is_that_of_the_textbook(pinion, largest_wheel, conformance):
    # Shigley's Mechanical Engineering Design, interference of full-depth 20 deg spur teeth.
    wheel = largest_wheel - 3
    with pytest.raises(GearError, match=f"interference: the tip of the wheel .*{pinion} teeth"):
        while True:
            spur((pinion, wheel + 1))
            wheel += 1
    conformance(
        f"largest wheel for {pinion} teeth",
        largest_wheel,
        wheel,
        0.0,
        "teeth",
        "literature: Shigley's Mechanical Engineering Design, eq. (13-12)",
    )


def test_overlap_of_helical_teeth_makes_up_for_a_small_transverse_contact_ratio():
    low = {"addendum_coefficient": 0.5}
    helical = replace(spur((20, 40)), helix_angle_rad=math.radians(20), **low)
    assert helical.transverse_contact_ratio < 1.0 < helical.contact_ratio


@pytest.mark.parametrize("distance", [0.49, 1.0])
def test_centre_distance_that_no_helix_gives_is_refused_with_the_range(distance):
    message = rf"no helix angle gives a centre distance of {1e3 * distance:g} mm: 31 and 104 teeth .* mesh from 493\.78"
    with pytest.raises(GearError, match=message):
        helix_angle_of(distance, TEETH, NORMAL_MODULE_M, PRESSURE_ANGLE_RAD, PROFILE_SHIFT)


def test_shifts_without_a_centre_distance_are_refused():
    with pytest.raises(GearError, match="too negative for 31 and 104 teeth"):
        helix_angle_of(0.495, TEETH, NORMAL_MODULE_M, PRESSURE_ANGLE_RAD, (-1.5, -1.5))
