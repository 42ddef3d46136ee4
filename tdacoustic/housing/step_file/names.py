"""Seats and hanger by the names of faces and solids in a STEP file.

A name stands for a seat if it consists of the words ``pinion`` or ``wheel``, with or without ``left`` or ``right`` and
the words ``seat``, ``bearing``, ``bore`` and numbers; for the hanger if of ``hanger`` and numbers. So ``"Pinion left"``
and ``"seat_wheel"`` do, and ``"wheel cover bolt"`` does not.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tdacoustic.housing.box import SHAFTS, HousingError
from tdacoustic.housing.step_file.importing import NamedPlace

__all__ = ["NamedSeat", "named_hanger", "named_seats"]

_PLAIN: Final = frozenset({"seat", "bearing", "bore"})
_SIDES: Final[tuple[str, ...]] = ("left", "right")

_COAXIAL_M: Final = 1e-3
"""How far the axes of two named places of one shaft may be apart."""


@dataclass(frozen=True)
class NamedSeat:
    """A shaft's axis and the radius of its seats, as named faces or solids give them.

    Parameters
    ----------
    centre_m : (float, float)
        x and z.
    radius_m : float
    names : tuple of str
    """

    centre_m: tuple[float, float]
    radius_m: float
    names: tuple[str, ...]


def _words(name: str) -> list[str]:
    return re.findall(r"[a-z]+", name.lower())


def named_seats(named: Sequence[NamedPlace]) -> dict[str, NamedSeat]:
    """Return the seats that names give, by shaft.

    Raises
    ------
    HousingError
        Named places of one shaft that are not on one axis.
    """
    found: dict[str, NamedSeat] = {}
    for shaft in SHAFTS:
        by_side: dict[str, list[NamedPlace]] = {}
        for place in named:
            words = _words(place.name)
            if words.count(shaft) == 1 and set(words) <= {shaft, *_SIDES} | _PLAIN:
                said = [side for side in _SIDES if side in words]
                here = "left" if place.middle_m[1] > 0.0 else "right"
                side = said[0] if said else here
                by_side.setdefault(side, []).append(place)
        circles = {side: _circle(places) for side, places in by_side.items()}
        for side, (x, z, _) in circles.items():
            first, (x0, z0, _) = next(iter(circles.items()))
            if abs(x - x0) > _COAXIAL_M or abs(z - z0) > _COAXIAL_M:
                raise HousingError(
                    f"the {shaft}'s seats named in it are not on one axis along y: {first} at x = {x0:.4g}, "
                    f"z = {z0:.4g} m, {side} at x = {x:.4g}, z = {z:.4g} m"
                )
        if circles:
            x, z, radius = next(iter(circles.values()))
            names = tuple(dict.fromkeys(place.name for places in by_side.values() for place in places))
            found[shaft] = NamedSeat((x, z), radius, names)
    return found


def _circle(places: Sequence[NamedPlace]) -> tuple[float, float, float]:
    """Return x, z and radius of what bounds places together: the halves of a cylinder have one name."""
    ends = []
    for axis in (0, 2):
        ends.append((min(place.low_m[axis] for place in places), max(place.high_m[axis] for place in places)))
    (x0, x1), (z0, z1) = ends
    return 0.5 * (x0 + x1), 0.5 * (z0 + z1), 0.5 * max(x1 - x0, z1 - z0)


def named_hanger(named: Sequence[NamedPlace]) -> NamedPlace | None:
    """Return what is named as the hanger's place, None where nothing is."""
    found = [place for place in named if _words(place.name) == ["hanger"]]
    if not found:
        return None
    low = tuple(min(place.low_m[axis] for place in found) for axis in range(3))
    high = tuple(max(place.high_m[axis] for place in found) for axis in range(3))
    return NamedPlace(found[0].name, low, high, found[0].kind)  # type: ignore[arg-type]
