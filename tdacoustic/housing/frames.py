"""From the frame of the gears to the drive frame, and from bearing forces to loads of the four seats.

Frame of the gears (physics.md section 2): x along the line of centres, y tangential, z along the shafts. The equation
δ = V·x with V = [cos βb sin Ψ, cos βb cos Ψ, sin βb, +r1 cos βb, ...] says more: a turn θ1 > 0 moves the teeth along
+n with the factor +r1, and (p × n)_z = +r1 for the contact point p seen from the pinion's centre holds only where p
lies at +x. So x points from the pinion to the wheel, and turns are positive about +z by the right hand.

Drive frame (design.md): x along travel, y to the left, z up. A positive torque T1 turns the pinion about +z of the
gears and the wheel about their -z; the wheelset of a drive going forward turns about +y. So z of the gears is -y of the
drive: **traction forward is T1 > 0** [ours]. For the other direction mirror the box.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.gears import GEARS, BearingForces, Foundation
from tdacoustic.housing.box import SEAT_PLACES
from tdacoustic.housing.response import SeatResponse
from tdacoustic.housing.seated import Seated

__all__ = ["foundation_of", "gear_axes", "mean_seat_loads", "seat_loads"]


def gear_axes(pinion_xz_m: tuple[float, float], wheel_xz_m: tuple[float, float]) -> NDArray[np.float64]:
    """Return the axes of the gears' frame in the drive frame, shape (3, 3): columns x, y, z of the gears.

    A vector v of the gears' frame is ``gear_axes(...) @ v`` in the drive frame.

    Parameters
    ----------
    pinion_xz_m, wheel_xz_m : (float, float)
        x and z of the shafts in the drive frame; they lie along y.

    Examples
    --------
    The pinion behind the wheel: tangential is up, along the shafts is to the right.

    >>> gear_axes((-0.25, 0.0), (0.25, 0.0)).T + 0.0
    array([[ 1.,  0.,  0.],
           [ 0.,  0.,  1.],
           [ 0., -1.,  0.]])
    """
    along_x, along_z = wheel_xz_m[0] - pinion_xz_m[0], wheel_xz_m[1] - pinion_xz_m[1]
    length = math.hypot(along_x, along_z)
    centres = np.array([along_x / length, 0.0, along_z / length])
    shafts = np.array([0.0, -1.0, 0.0])
    return np.column_stack([centres, np.cross(shafts, centres), shafts])


def _on_seats(box: Seated, forces: NDArray[Any]) -> NDArray[Any]:
    """Forces of the gears' bearings, shape (2, 3, ...), on the four seats in the drive frame, shape (4, 3, ...)."""
    axes = gear_axes(box.seats[0].centre_m, box.seats[1].centre_m)
    shares = []
    for shaft, side in SEAT_PLACES:
        seat = next(seat for seat in box.seats if seat.shaft == shaft)
        left = box.share_of_left(seat)
        shares.append((left if side == "left" else 1.0 - left) * np.tensordot(axes, forces[GEARS.index(shaft)], 1))
    return np.stack(shares)


def seat_loads(box: Seated, forces: BearingForces) -> NDArray[np.complex128]:
    """Return the forces that the bearings put on the housing, line by line.

    The bearing force R = K x + C x' of the gears' model (physics.md section 3) is the force of the shaft on what holds
    it: it acts on the housing with its own sign. In one-way coupling it is that on a foundation that does not move.
    Each gear's force, axial force included, is split between its two bearings by the lever rule for where the gear
    stands (`Seat.gear_y_m`; in the middle: half each). In truth one bearing may hold a shaft axially alone, and the
    axial force tilts it; both are left out.

    Parameters
    ----------
    box : Box or SolidHousing
    forces : BearingForces

    Returns
    -------
    ndarray of complex, shape (4, 3, lines)
        Peak amplitudes in N at `forces.frequency_hz`, by `SEAT_PLACES` and x, y, z of the drive frame.
    """
    return np.asarray(_on_seats(box, forces.amplitude_n), dtype=np.complex128)


def mean_seat_loads(box: Seated, forces: BearingForces) -> NDArray[np.float64]:
    """Return the mean forces on the seats in N, shape (4, 3): as `seat_loads`, of the mean."""
    return np.asarray(_on_seats(box, forces.mean_n), dtype=np.float64)


def foundation_of(box: Seated, modes: SeatResponse, loss_factor: float) -> Foundation:
    """Return the housing as the gears feel it: the motion under each gear's bearings, by mode.

    By virtual work the displacement that a gear's bearing force sees is the mean of its two seats, weighted with the
    shares of `seat_loads`; so the compliance is symmetric, and the power that the gears give is the power that the
    housing takes. The springs of the modes are those between housing and frame (soft: `Seat`, `Box`); the bearings
    between shafts and seats are in the gears' equations alone, so that nothing is counted twice.

    Parameters
    ----------
    box : Box or SolidHousing
        With the places of the gears along the shafts.
    modes : HousingModes or SolidModes
    loss_factor : float
    """
    unit = np.eye(6).reshape(2, 3, 6)
    shapes = np.einsum("msd,sdj->mj", modes.seats, _on_seats(box, unit))
    return Foundation(modes.frequency_hz, shapes, loss_factor, corrections=len(modes.frequency_hz) - modes.natural)
