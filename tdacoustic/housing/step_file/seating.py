"""Seats and hanger of an imported solid: bores closed by plugs, parts of the walls where there is no bore."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from tdacoustic.housing.box import SEAT_PLACES, SHAFTS, HousingError, Seat, horizontal_centres
from tdacoustic.housing.step_file.bores import Bore, bores_of
from tdacoustic.housing.step_file.importing import Imported, NamedPlace
from tdacoustic.housing.step_file.names import named_hanger, named_seats
from tdacoustic.housing.step_file.solid import HANGER_RADIUS_M, SeatWish, SolidWish
from tdacoustic.housing.step_file.surface_grid import SurfaceGrid
from tdacoustic.housing.step_file.triangles import Skin

__all__ = ["REGIONS", "Seating", "seated"]

REGIONS: Final = (*(f"{shaft}_{side}" for shaft, side in SEAT_PLACES), "hanger")
"""Named regions of a solid with its seats, in the order of `SEAT_PLACES`."""

_ON_AXIS_M: Final = 5e-3
"""How far a bore's axis may be from where a seat is stated [assumed]: drawings are rounded."""

_HANGER_DEPTH_M: Final = 0.06
"""Of the material that the hanger holds, at most [assumed]."""


@dataclass(frozen=True)
class Region:
    """A part of the solid, or a plug in it.

    Parameters
    ----------
    name : str
    shape : netgen.occ.TopoDS_Shape
    plug : bool
        Whether it is added to the solid.
    low_y_m, high_y_m, radius_m : float
    """

    name: str
    shape: Any
    plug: bool
    low_y_m: float
    high_y_m: float
    radius_m: float

    @property
    def middle_y_m(self) -> float:
        """Where its mid plane is."""
        return 0.5 * (self.low_y_m + self.high_y_m)


@dataclass(frozen=True)
class Seating:
    """A solid with its seats and hanger as parts of their own.

    Parameters
    ----------
    whole : netgen.occ.TopoDS_Shape
        Solids glued together, named by `REGIONS` and ``"shell"``.
    seats : (Seat, Seat)
    seat_y_m : ((float, float), (float, float))
        Mid planes of the left and the right seat, of pinion and wheel.
    notes : tuple of str
    """

    whole: Any
    seats: tuple[Seat, Seat]
    seat_y_m: tuple[tuple[float, float], tuple[float, float]]
    notes: tuple[str, ...]


def seated(found: Imported, grid: SurfaceGrid, wish: SolidWish) -> Seating:
    """Find the seats and the hanger of a solid.

    Parameters
    ----------
    found : Imported
    grid : SurfaceGrid
        Of its whole surface.
    wish : SolidWish

    Raises
    ------
    HousingError
        A seat or the hanger has no material, or two of them reach into each other.
    """
    skin, bores = grid.skin, bores_of(grid)
    low, high = skin.points_m.min(axis=0), skin.points_m.max(axis=0)
    centres, notes = _centres(found, wish, low, high)
    named = named_seats(found.named)
    regions, seats, mids = [], [], []
    for asked in wish.seats:
        radius = named[asked.shaft].radius_m if asked.shaft in named and asked.radius_m is None else asked.radius_m
        centre = _on_bore(asked.shaft, centres[asked.shaft], bores)
        two = [_seat(found.solid, skin, asked, side, centre, radius, bores) for side in ("left", "right")]
        regions += two
        thickness = two[0].high_y_m - two[0].low_y_m
        seats.append(Seat(asked.shaft, centre, two[0].radius_m, thickness, asked.stiffness_n_per_m))
        mids.append((two[0].middle_y_m, two[1].middle_y_m))
        notes += _bore_notes(asked.shaft, two)
    behind = -1.0 if seats[0].centre_m[0] <= seats[1].centre_m[0] else 1.0
    regions.append(_hanger(found, skin, behind, low, high))
    whole = _glued(found.solid, regions)
    return Seating(whole, (seats[0], seats[1]), (mids[0], mids[1]), (*found.notes, *notes))


def _centres(found: Imported, wish: SolidWish, low: Any, high: Any) -> tuple[dict[str, tuple[float, float]], list[str]]:
    """Return x and z of the shafts: stated, named, or on the default line of centres."""
    named = named_seats(found.named)
    middle = 0.5 * (low + high)
    default = dict(zip(SHAFTS, horizontal_centres(wish.centre_distance_m), strict=True))
    centres: dict[str, tuple[float, float]] = {}
    notes: list[str] = []
    for asked in wish.seats:
        shaft = asked.shaft
        if asked.centre_m is not None:
            centres[shaft] = asked.centre_m
            if shaft in named and math.dist(named[shaft].centre_m, asked.centre_m) > _ON_AXIS_M:
                raise HousingError(
                    f"the {shaft}'s seat is stated at {_xz(asked.centre_m)} and named in the file "
                    f"({', '.join(named[shaft].names)}) at {_xz(named[shaft].centre_m)}"
                )
        elif shaft in named:
            centres[shaft] = named[shaft].centre_m
            notes.append(f"The {shaft}'s seats are where its name stands in the file: {_xz(centres[shaft])}.")
        else:
            x, z = default[shaft]
            centres[shaft] = float(middle[0]) + x, float(middle[2]) + z
            notes.append(
                f"The {shaft}'s seats are neither stated nor named: they are on a horizontal line of centres through "
                f"the middle of the housing, at {_xz(centres[shaft])} [assumed]."
            )
    return centres, notes


def _xz(centre: tuple[float, float]) -> str:
    return f"x = {centre[0]:.4g}, z = {centre[1]:.4g} m"


def _on_bore(shaft: str, centre: tuple[float, float], bores: Sequence[Bore]) -> tuple[float, float]:
    """Return a shaft's axis, moved onto that of the bores there."""
    near = [bore for bore in bores if math.dist(bore.centre_m, centre) <= _ON_AXIS_M]
    if near:
        x, z = near[0].centre_m
        return round(x, 7) + 0.0, round(z, 7) + 0.0
    around = [bore for bore in bores if math.dist(bore.centre_m, centre) < bore.radius_m]
    if around:
        raise HousingError(
            f"the {shaft}'s seat at {_xz(centre)} is not in the middle of the bore around it, which is at "
            f"{around[0].words}: state that position"
        )
    return centre


def _seat(
    solid: Any,
    skin: Skin,
    asked: SeatWish,
    side: str,
    centre: tuple[float, float],
    radius_m: float | None,
    bores: Sequence[Bore],
) -> Region:
    """Return the seat of a shaft on one side: the plug of its bore, or a part of the wall."""
    from netgen.occ import Cylinder, Pnt, Vec

    sign = 1.0 if side == "left" else -1.0
    middle_y = 0.5 * (skin.points_m[:, 1].min() + skin.points_m[:, 1].max())
    walls = _walls(skin, centre, middle_y, sign)
    there = [b for b in bores if math.dist(b.centre_m, centre) <= _ON_AXIS_M and sign * (b.from_y_m - middle_y) > 0.0]
    through = [b for b in there if not any(low < b.to_y_m - 1e-4 and high > b.from_y_m + 1e-4 for low, high in walls)]
    name = f"{asked.shaft}_{side}"
    if through:
        bore = through[-1] if sign > 0.0 else through[0]
        return Region(name, _plug(bore), True, bore.from_y_m, bore.to_y_m, bore.radius_m)
    if not walls:
        raise HousingError(
            f"the {asked.shaft}'s {side} seat at {_xz(centre)} has no material there{_bore_words(bores)}"
        )
    if radius_m is None or asked.thickness_m is None:
        lacks = "radius_m" if radius_m is None else "thickness_mm"
        raise HousingError(
            f"the {asked.shaft}'s {side} seat at {_xz(centre)} is no bore, so its [[housing.seat]] needs {lacks}"
            f"{_bore_words(bores)}"
        )
    outer = max(high for _, high in walls) if sign > 0.0 else min(low for low, _ in walls)
    end = outer - sign * asked.thickness_m
    reach = Cylinder(
        Pnt(centre[0], outer + sign * 1e-4, centre[1]), Vec(0, -sign, 0), radius_m, asked.thickness_m + 1e-4
    )
    part = solid * reach
    if not part.mass > 0.0:
        raise HousingError(f"the {asked.shaft}'s {side} seat at {_xz(centre)} has no material there")
    return Region(name, part, False, min(outer, end), max(outer, end), radius_m)


def _bore_words(bores: Sequence[Bore]) -> str:
    if not bores:
        return "; the file has no bore along y"
    return "; bores along y are at " + "; ".join(dict.fromkeys(bore.words for bore in bores))


def _walls(skin: Skin, centre: tuple[float, float], middle_y: float, sign: float) -> list[tuple[float, float]]:
    """Return where the line of a shaft is in material on one side, from low to high y."""
    met = skin.crossings(np.array([centre[0] + 1.7e-6, 0.0, centre[1] + 2.3e-6]), 1)
    pairs = [(float(a), float(b)) for a, b in zip(met[::2], met[1::2], strict=False)]
    return [pair for pair in pairs if sign * (0.5 * (pair[0] + pair[1]) - middle_y) > 0.0]


def _plug(bore: Bore) -> Any:
    """Return what closes a bore: each of its cylinders filled, and where they do not touch, the narrowest between."""
    from netgen.occ import Cylinder, Fuse, Pnt, Vec

    x, z = bore.centre_m
    filled = [Cylinder(Pnt(x, s.from_y_m, z), Vec(0, 1, 0), s.radius_m, s.to_y_m - s.from_y_m) for s in bore.steps]
    if len(filled) == 1:
        return filled[0]
    narrow = min(step.radius_m for step in bore.steps)
    through = Cylinder(Pnt(x, bore.from_y_m, z), Vec(0, 1, 0), narrow, bore.to_y_m - bore.from_y_m)
    return Fuse([*filled, through])


def _bore_notes(shaft: str, two: Sequence[Region]) -> list[str]:
    plugs = [region for region in two if region.plug]
    if not plugs:
        return []
    told = " and ".join(
        f"{'left' if region.middle_y_m == max(r.middle_y_m for r in two) else 'right'} "
        f"(radius {1e3 * region.radius_m:.4g} mm, {1e3 * (region.high_y_m - region.low_y_m):.4g} mm deep)"
        for region in plugs
    )
    return [
        f"The {shaft}'s bore{'s' if len(plugs) > 1 else ''} {told} {'are' if len(plugs) > 1 else 'is'} closed by "
        "plugs of the housing's material, for bearing and cover [assumed]."
    ]


def _hanger(found: Imported, skin: Skin, behind: float, low: Any, high: Any) -> Region:
    """Return the material that the hanger holds: around what is named for it, else a disc in the middle of an end."""
    from netgen.occ import Box, Cylinder, Pnt, Vec

    place = named_hanger(found.named)
    middle = 0.5 * (low + high)
    if place is not None:
        pad = _pad(place)
        ends = (
            [a - b for a, b in zip(place.low_m, pad, strict=True)],
            [a + b for a, b in zip(place.high_m, pad, strict=True)],
        )
        part = found.solid * Box(Pnt(*ends[0]), Pnt(*ends[1]))
        where = f"named {place.name!r}"
    else:
        met = skin.crossings(np.array([0.0, middle[1] + 1.7e-6, middle[2] + 2.3e-6]), 0)
        end = "-x" if behind < 0.0 else "+x"
        where = f"in the middle of its {end} end"
        if len(met) < 2:
            raise HousingError(f"there is no material for the hanger {where}: name a face of it 'hanger'")
        outer, inner = (met[0], met[1]) if behind < 0.0 else (met[-1], met[-2])
        depth = min(abs(inner - outer), _HANGER_DEPTH_M)
        radius = min(HANGER_RADIUS_M, 0.2 * float(min(high[1] - low[1], high[2] - low[2])))
        start = Pnt(float(outer + behind * 1e-4), float(middle[1]), float(middle[2]))
        part = found.solid * Cylinder(start, Vec(-behind, 0, 0), radius, float(depth + 1e-4))
    if not part.mass > 0.0:
        raise HousingError(f"there is no material for the hanger {where}")
    return Region("hanger", part, False, 0.0, 0.0, 0.0)


def _pad(place: NamedPlace) -> list[float]:
    """Return by how much a named face is made thicker so that it holds material: along its thinnest way."""
    extent = [b - a for a, b in zip(place.low_m, place.high_m, strict=True)]
    thin = int(np.argmin(extent))
    return [(0.03 if place.kind == "face" else 1e-4) if axis == thin else 1e-6 for axis in range(3)]


def _glued(solid: Any, regions: Sequence[Region]) -> Any:
    """Return the solid with its regions as solids of their own that share faces with it."""
    from netgen.occ import Glue

    _check_apart(regions)
    rest = solid
    for region in regions:
        if not region.plug:
            rest = rest - region.shape
    rest.mat("shell")
    for region in regions:
        region.shape.mat(region.name)
    return Glue([rest, *(region.shape for region in regions)])


def _check_apart(regions: Sequence[Region]) -> None:
    for number, one in enumerate(regions):
        for other in regions[number + 1 :]:
            if _bounds_meet(one.shape, other.shape) and (one.shape * other.shape).mass > 1e-9:
                raise HousingError(f"the places of {_plain(one.name)} and {_plain(other.name)} reach into each other")


def _bounds_meet(one: Any, other: Any) -> bool:
    (a, b), (c, d) = one.bounding_box, other.bounding_box
    return all(a[k] < d[k] and c[k] < b[k] for k in range(3))


def _plain(name: str) -> str:
    shaft, _, side = name.partition("_")
    return f"the {shaft}'s {side} seat" if side else f"the {shaft}"
