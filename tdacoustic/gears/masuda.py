"""Meshing noise of a gear unit by Masuda's formula (paper, equation (8); physics.md section 4)."""

from __future__ import annotations

import math
from typing import Final

from tdacoustic.errors import GearError

__all__ = ["SPHERE_OF_1_M_DB", "masuda_level_db"]

SPHERE_OF_1_M_DB: Final = 10.0 * math.log10(4.0 * math.pi)
"""From the level at 1 m of a point source in free space to its sound power level."""

_REFERENCE_SPEED: Final = 5.56
"""78/√196.85 of AGMA in √(m/s): both roots of the speed term belong there."""


def masuda_level_db(
    helix_angle_rad: float,
    ratio: float,
    transverse_contact_ratio: float,
    pitch_line_speed_m_s: float,
    power_w: float,
    displacement: float,
    constant_db: float,
) -> float | None:
    """Return the overall level of a gear unit at 1 m, in dB.

    L = 20 (1 - tan(β/2)) u^(1/8) / εα^(1/4) √((5.56 + √v)/5.56) + 20 lg W + 20 lg X + C, with W in kW. What the paper
    leaves open is the caller's choice: what X is, and whether L is A-weighted. Within one choice W's unit, X's and C
    are one additive constant.

    Parameters
    ----------
    helix_angle_rad : float
        At the reference circle.
    ratio : float
        u = z2/z1, above zero.
    transverse_contact_ratio : float
    pitch_line_speed_m_s : float
    power_w : float
        Transmitted; its direction does not matter.
    displacement : float
        X: the peak-to-peak dynamic transmission error in um, or that over the static compression.
    constant_db : float
        C, 20 as printed; to be calibrated.

    Returns
    -------
    float or None
        None where no power is transmitted or nothing vibrates: the formula has no level then.

    Raises
    ------
    GearError
        A value out of range.

    Examples
    --------
    >>> round(masuda_level_db(math.radians(4), 104 / 31, 2.052, 12.1, 629e3, 12.2, 20.0), 1)
    121.6
    """
    for name, value in (("ratio", ratio), ("transverse_contact_ratio", transverse_contact_ratio)):
        if not value > 0.0:
            raise GearError(f"{name} must be > 0, got {value!r}")
    for name, value in (("helix_angle_rad", helix_angle_rad), ("power_w", power_w), ("constant_db", constant_db)):
        if not math.isfinite(value):
            raise GearError(f"{name} must be a number, got {value!r}")
    if not pitch_line_speed_m_s >= 0.0 or not displacement >= 0.0:
        raise GearError(
            f"pitch-line speed and displacement must be >= 0, got {pitch_line_speed_m_s!r} and {displacement!r}"
        )
    if power_w == 0.0 or displacement == 0.0:
        return None
    speed = math.sqrt((_REFERENCE_SPEED + math.sqrt(pitch_line_speed_m_s)) / _REFERENCE_SPEED)
    shape = (1.0 - math.tan(0.5 * helix_angle_rad)) * ratio**0.125 / transverse_contact_ratio**0.25
    power_kw = 1e-3 * abs(power_w)
    return 20.0 * (shape * speed + math.log10(power_kw) + math.log10(displacement)) + constant_db
