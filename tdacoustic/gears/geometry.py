"""Geometry of a cylindrical involute gear pair (ISO 21771)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

from tdacoustic.errors import GearError
from tdacoustic.gears.involute import angle_of_involute, involute

__all__ = ["GearGeometry", "helix_angle_of"]

_STEEPEST_RAD: Final = math.radians(45.0)
_ROUND_OFF: Final = 1e-12


@dataclass(frozen=True)
class GearGeometry:
    """An external pair of cylindrical gears without play in its calculated centre distance.

    The pair is defined by its basic rack, shifts and helix angle; the centre distance follows
    (`helix_angle_of` is the way back). Tips are not shortened. Tooth thickness tolerances are left out; backlash is a
    parameter of the dynamics.

    Parameters
    ----------
    teeth : (int, int)
        Pinion, wheel; the pinion is the driving gear in traction.
    normal_module_m : float
    pressure_angle_rad : float
        Of the basic rack, in the normal section.
    helix_angle_rad : float
        At the reference circle; 0 of a spur pair.
    profile_shift : (float, float)
        Coefficients.
    addendum_coefficient, clearance_coefficient : float
        Of the normal module.
    face_width_m : float
        That both gears share.

    Raises
    ------
    GearError
        No such pair can be made or can mesh; the message says why.

    Examples
    --------
    >>> pair = GearGeometry((31, 104), 7.35e-3, math.radians(20), math.radians(4), (0.27807, -0.59026), 1.2, 0.35, 0.12)
    >>> round(1e3 * pair.centre_distance_m, 3), round(pair.transverse_contact_ratio, 3)
    (495.0, 2.052)
    """

    teeth: tuple[int, int]
    normal_module_m: float
    pressure_angle_rad: float
    helix_angle_rad: float
    profile_shift: tuple[float, float]
    addendum_coefficient: float
    clearance_coefficient: float
    face_width_m: float

    def __post_init__(self) -> None:
        problem = next(self._impossible_inputs(), None) or next(self._impossible_pairs(), None)
        if problem is not None:
            raise GearError(problem)

    def _impossible_inputs(self) -> Iterator[str]:
        if min(self.teeth) < 1:
            yield f"teeth must be >= 1, got {self.teeth[0]} and {self.teeth[1]}"
        for name in ("normal_module_m", "addendum_coefficient", "face_width_m"):
            if not getattr(self, name) > 0.0:
                yield f"{name} must be > 0, got {getattr(self, name)!r}"
        if not self.clearance_coefficient >= 0.0:
            yield f"clearance_coefficient must be >= 0, got {self.clearance_coefficient!r}"
        if not all(math.isfinite(shift) for shift in self.profile_shift):
            yield f"profile shifts must be numbers, got {self.profile_shift[0]!r} and {self.profile_shift[1]!r}"
        if not 0.0 < self.pressure_angle_rad < _STEEPEST_RAD:
            yield f"pressure angle must be above 0° and below 45°, got {math.degrees(self.pressure_angle_rad):g}°"
        if not 0.0 <= self.helix_angle_rad <= _STEEPEST_RAD:
            yield f"helix angle must be from 0° to 45°, got {math.degrees(self.helix_angle_rad):g}°"

    def _impossible_pairs(self) -> Iterator[str]:
        if self._working_involute <= 0.0:
            yield (
                f"profile shifts {self.profile_shift[0]:g} and {self.profile_shift[1]:g} are too negative for "
                f"{self.teeth[0]} and {self.teeth[1]} teeth: there is no centre distance at which the teeth mesh"
            )
            return
        names = ("pinion", "wheel")
        for which, (tip, base, root) in enumerate(
            zip(self.tip_radii_m, self.base_radii_m, self.root_radii_m, strict=True)
        ):
            if tip <= base or root <= 0.0:
                what = (
                    f"root radius {1e3 * root:.3f} mm, base radius {1e3 * base:.3f} mm, tip radius {1e3 * tip:.3f} mm"
                )
                yield f"the {names[which]} has no involute flank ({what})"
                return
        for which, thickness in enumerate(self.tip_thicknesses_m):
            if thickness <= 0.0:
                yield (
                    f"the teeth of the {names[which]} are pointed: with addendum {self.addendum_coefficient:g} and "
                    f"profile shift {self.profile_shift[which]:g} the flanks meet below the tip circle"
                )
        reach = self.centre_distance_m * math.sin(self.working_pressure_angle_rad)
        for which, (tip, base) in enumerate(zip(self.tip_radii_m, self.base_radii_m, strict=True)):
            if math.sqrt(tip**2 - base**2) > reach * (1.0 + _ROUND_OFF):
                yield (
                    f"interference: the tip of the {names[which]} would touch the {names[1 - which]} below its base "
                    f"circle ({self.teeth[1 - which]} teeth, profile shift {self.profile_shift[1 - which]:g})"
                )
        for which, clearance in enumerate(self.tip_clearances_m):
            if clearance < -_ROUND_OFF * self.centre_distance_m:
                yield (
                    f"the tip of the {names[which]} cuts {-1e3 * clearance:.3f} mm into the root of the "
                    f"{names[1 - which]}: profile shifts {self.profile_shift[0]:g} and {self.profile_shift[1]:g} "
                    "need more clearance"
                )
        if self.contact_ratio < 1.0:
            yield (
                f"the teeth lose contact between one pair and the next: transverse contact ratio "
                f"{self.transverse_contact_ratio:.3f}, overlap ratio {self.overlap_ratio:.3f}, together below 1"
            )

    @property
    def ratio(self) -> float:
        """Gear ratio u = z2/z1."""
        return self.teeth[1] / self.teeth[0]

    @cached_property
    def transverse_pressure_angle_rad(self) -> float:
        """α_t at the reference circle."""
        return math.atan(math.tan(self.pressure_angle_rad) / math.cos(self.helix_angle_rad))

    @property
    def _working_involute(self) -> float:
        shift = 2.0 * sum(self.profile_shift) / sum(self.teeth) * math.tan(self.pressure_angle_rad)
        return involute(self.transverse_pressure_angle_rad) + shift

    @cached_property
    def working_pressure_angle_rad(self) -> float:
        """α_wt: inv α_wt = inv α_t + 2 (x1 + x2)/(z1 + z2) tan α_n."""
        return angle_of_involute(self._working_involute)

    @cached_property
    def base_helix_angle_rad(self) -> float:
        """β_b: sin β_b = sin β cos α_n."""
        return math.asin(math.sin(self.helix_angle_rad) * math.cos(self.pressure_angle_rad))

    @cached_property
    def reference_radii_m(self) -> tuple[float, float]:
        """Half the reference diameters d = z m_n / cos β."""
        per_tooth = 0.5 * self.normal_module_m / math.cos(self.helix_angle_rad)
        return self.teeth[0] * per_tooth, self.teeth[1] * per_tooth

    @cached_property
    def base_radii_m(self) -> tuple[float, float]:
        """Half the base diameters d_b = d cos α_t."""
        first, second = self.reference_radii_m
        cosine = math.cos(self.transverse_pressure_angle_rad)
        return first * cosine, second * cosine

    @cached_property
    def centre_distance_m(self) -> float:
        """a_w = (r_b1 + r_b2) / cos α_wt, without play."""
        return sum(self.base_radii_m) / math.cos(self.working_pressure_angle_rad)

    @cached_property
    def pitch_radii_m(self) -> tuple[float, float]:
        """Half the working pitch diameters, which roll on each other."""
        first, second = self.base_radii_m
        cosine = math.cos(self.working_pressure_angle_rad)
        return first / cosine, second / cosine

    @cached_property
    def tip_radii_m(self) -> tuple[float, float]:
        """Half the tip diameters d_a = d + 2 m_n (x + h_a*); no tip shortening."""
        return self._radii_of(self.addendum_coefficient)

    @cached_property
    def root_radii_m(self) -> tuple[float, float]:
        """Half the root diameters d_f = d - 2 m_n (h_a* + c* - x)."""
        return self._radii_of(-self.addendum_coefficient - self.clearance_coefficient)

    def _radii_of(self, height: float) -> tuple[float, float]:
        first, second = (
            radius + self.normal_module_m * (shift + height)
            for radius, shift in zip(self.reference_radii_m, self.profile_shift, strict=True)
        )
        return first, second

    @cached_property
    def tip_clearances_m(self) -> tuple[float, float]:
        """Between the tip of each gear and the root of its mate."""
        (tip_1, tip_2), (root_1, root_2) = self.tip_radii_m, self.root_radii_m
        return self.centre_distance_m - tip_1 - root_2, self.centre_distance_m - tip_2 - root_1

    @cached_property
    def tip_thicknesses_m(self) -> tuple[float, float]:
        """Transverse tooth thickness at the tip circles; not above zero where teeth are pointed."""
        first, second = (
            2.0 * tip * (self._half_thickness_angle(which) - involute(math.acos(base / tip)))
            for which, (tip, base) in enumerate(zip(self.tip_radii_m, self.base_radii_m, strict=True))
        )
        return first, second

    def _half_thickness_angle(self, which: int) -> float:
        shift = self.profile_shift[which] * math.tan(self.pressure_angle_rad)
        reference = (0.5 * math.pi + 2.0 * shift) / self.teeth[which]
        return reference + involute(self.transverse_pressure_angle_rad)

    @cached_property
    def path_of_contact_m(self) -> float:
        """Length g_α of the path of contact in the transverse plane."""
        lengths = (math.sqrt(tip**2 - base**2) for tip, base in zip(self.tip_radii_m, self.base_radii_m, strict=True))
        return sum(lengths) - self.centre_distance_m * math.sin(self.working_pressure_angle_rad)

    @cached_property
    def base_pitch_m(self) -> float:
        """Transverse base pitch p_et = 2π r_b1 / z1."""
        return 2.0 * math.pi * self.base_radii_m[0] / self.teeth[0]

    @property
    def transverse_contact_ratio(self) -> float:
        """ε_α = g_α / p_et."""
        return self.path_of_contact_m / self.base_pitch_m

    @property
    def overlap_ratio(self) -> float:
        """ε_β = b sin β / (π m_n)."""
        return self.face_width_m * math.sin(self.helix_angle_rad) / (math.pi * self.normal_module_m)

    @property
    def contact_ratio(self) -> float:
        """ε_γ = ε_α + ε_β."""
        return self.transverse_contact_ratio + self.overlap_ratio

    def with_helix_angle(self, helix_angle_rad: float) -> GearGeometry:
        """Return the pair with another helix angle; rack, teeth, shifts and width stay, the centre distance follows.

        Raises
        ------
        GearError
            That pair cannot mesh.
        """
        return replace(self, helix_angle_rad=helix_angle_rad)


def helix_angle_of(
    centre_distance_m: float,
    teeth: tuple[int, int],
    normal_module_m: float,
    pressure_angle_rad: float,
    profile_shift: tuple[float, float],
) -> float:
    """Return the helix angle in rad for which a pair meshes without play at a centre distance.

    The centre distance grows with the helix angle; 0 to 45° are searched.

    Parameters
    ----------
    centre_distance_m : float
    teeth, normal_module_m, pressure_angle_rad, profile_shift
        As of `GearGeometry`.

    Raises
    ------
    GearError
        No helix angle gives it; the message has the range that can be had.

    Examples
    --------
    >>> angle = helix_angle_of(0.495, (31, 104), 7.35e-3, math.radians(20), (0.27807, -0.59026))
    >>> round(math.degrees(angle), 3)
    4.0
    """
    from scipy.optimize import brentq

    def distance(helix_angle_rad: float) -> float:
        transverse = math.atan(math.tan(pressure_angle_rad) / math.cos(helix_angle_rad))
        shift = 2.0 * sum(profile_shift) / sum(teeth) * math.tan(pressure_angle_rad)
        value = involute(transverse) + shift
        if value <= 0.0:
            raise GearError(
                f"profile shifts {profile_shift[0]:g} and {profile_shift[1]:g} are too negative for {teeth[0]} and "
                f"{teeth[1]} teeth: there is no centre distance at which the teeth mesh"
            )
        reference = 0.5 * normal_module_m * sum(teeth) / math.cos(helix_angle_rad)
        return reference * math.cos(transverse) / math.cos(angle_of_involute(value))

    smallest, largest = distance(0.0), distance(_STEEPEST_RAD)
    if not smallest * (1.0 - 1e-9) <= centre_distance_m <= largest:
        raise GearError(
            f"no helix angle gives a centre distance of {1e3 * centre_distance_m:g} mm: {teeth[0]} and {teeth[1]} teeth"
            f" of module {1e3 * normal_module_m:g} mm with profile shifts {profile_shift[0]:g} and {profile_shift[1]:g}"
            f" mesh from {1e3 * smallest:.3f} mm (0°) to {1e3 * largest:.3f} mm (45°)"
        )
    if centre_distance_m <= smallest:
        return 0.0
    return float(brentq(lambda angle: distance(angle) - centre_distance_m, 0.0, _STEEPEST_RAD, xtol=1e-14, rtol=1e-14))
