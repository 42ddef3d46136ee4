"""What a STEP file holds, looked through once: the entry of the process that reads it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.step_file.bores import bores_of
from tdacoustic.housing.step_file.importing import imported
from tdacoustic.housing.step_file.isolation import run_apart
from tdacoustic.housing.step_file.openings import openings_of
from tdacoustic.housing.step_file.seating import Seating, seated
from tdacoustic.housing.step_file.solid import SolidHousing, SolidWish
from tdacoustic.housing.step_file.surface_grid import SurfaceGrid, check_sound, outer_part, surface_grid
from tdacoustic.housing.step_file.symmetry import mirror_planes
from tdacoustic.housing.step_file.text import check_text
from tdacoustic.housing.step_file.triangles import Skin, connected

__all__ = ["Surveyed", "read_solid", "surveyed"]

Real = NDArray[np.float64]

MOST_S: Final = 180.0
"""For reading and looking through a file [assumed]; a box takes 2 s, a ribbed casting 5."""

MOST_BYTES: Final = 8_000_000_000

_EDGES: Final = 12
"""Of the grid that a file is looked through on, along its longest dimension."""

_MOST_CELLS: Final = 150_000
"""Of that grid [assumed]: a housing with threads, lettering and fins of a millimetre has more."""


@dataclass(frozen=True)
class Surveyed:
    """A solid in the process that reads it.

    Parameters
    ----------
    seating : Seating
    housing : SolidHousing
    """

    seating: Seating
    housing: SolidHousing


def read_solid(path: Path, wish: SolidWish) -> SolidHousing:
    """Read a STEP file, in a process of its own, and find what there is.

    Parameters
    ----------
    path : Path
    wish : SolidWish

    Raises
    ------
    HousingError
        The file cannot be a housing; the message says why and does not name it.
    MissingPackageError
        NGSolve is not installed.
    """
    check_text(path.read_bytes())
    found = run_apart(f"{__name__}:_housing", (path, wish), "reading it", MOST_S, MOST_BYTES)
    assert isinstance(found, SolidHousing)
    return found


def _housing(path: Path, wish: SolidWish) -> SolidHousing:
    return surveyed(path, wish).housing


def surveyed(path: Path, wish: SolidWish) -> Surveyed:
    """Do the same in this process.

    Parameters
    ----------
    path : Path
    wish : SolidWish
    """
    found = imported(path)
    (low, high) = found.solid.bounding_box
    edge_m = max(high[axis] - low[axis] for axis in range(3)) / _EDGES
    grid = surface_grid(found.solid, edge_m)
    if len(grid.cells) > _MOST_CELLS:
        raise HousingError(
            f"its surface takes {len(grid.cells)} triangles, {_MOST_CELLS} at most are taken: simplify it (threads, "
            "lettering, small holes and roundings)"
        )
    check_sound(grid, found.solid.mass)
    if not bores_of(grid):  # nothing will be closed
        _check_closed(grid, grid.only(outer_part(grid)))
    seating = seated(found, grid, wish)
    whole = surface_grid(seating.whole, edge_m)
    at_air = whole.only(~whole.between)
    check_sound(at_air, seating.whole.mass)
    outer = at_air.only(outer_part(at_air))
    _check_closed(at_air, outer)
    skin = outer.skin
    ends = np.round([skin.points_m.min(axis=0), skin.points_m.max(axis=0)], 7).tolist()
    error_m = _off(skin)
    return Surveyed(
        seating,
        SolidHousing(
            seating.seats,
            seating.seat_y_m,
            tuple(ends[0]),
            tuple(ends[1]),
            np.round(skin.points_m, 7),
            skin.triangles,
            mirror_planes(skin, error_m),
            _wall(at_air.skin),
            wish.density_kg_m3 * seating.whole.mass,
            skin.area_m2,
            seating.notes,
        ),
    )


def _off(skin: Skin) -> float:
    """Return how far triangles are off the faces they are on, about: the sagitta by the turn between neighbours."""
    sides = np.concatenate([skin.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    owner = np.tile(np.arange(len(skin.triangles)), 3)
    order = np.lexsort(np.sort(sides, axis=1).T)
    one, other = owner[order][0::2], owner[order][1::2]
    normals = skin.vectors_m2 / np.linalg.norm(skin.vectors_m2, axis=1)[:, None]
    turn = np.arccos(np.clip((normals[one] * normals[other]).sum(axis=1), -1.0, 1.0))
    length = np.linalg.norm(skin.corners_m - np.roll(skin.corners_m, 1, axis=1), axis=2).max(axis=1)
    smooth = turn < 0.9
    return float((0.125 * length[one] * turn)[smooth].max(initial=0.0))


def _check_closed(at_air: SurfaceGrid, outer: SurfaceGrid) -> None:
    """Raise for a solid whose inside is open to the outside, or that has none."""
    parts = connected(at_air.cells, len(at_air.points_m))
    if parts.max() > 0:
        if _stray(at_air, parts):
            raise HousingError(
                "it is made of shells that do not lie in each other: a housing is one piece; export it alone"
            )
        return
    openings, hollow = openings_of(outer.skin)
    if not hollow:
        raise HousingError("it is not hollow: a housing is a closed shell around its gears")
    if not openings:
        raise HousingError(
            "it is hollow and not closed: some opening narrower than about "
            f"{1e3 * np.ptp(outer.points_m, axis=0).max() / 50.0:.0f} mm leads into it; close it in the CAD program"
        )
    told = "; ".join(
        "about {:.2g} m wide near x = {:.3g}, y = {:.3g}, z = {:.3g} m".format(opening.width_m, *opening.place_m)
        for opening in openings
    )
    raise HousingError(
        f"its inside is open to the outside: {told}. Only bores at the seats are closed by the program; close the "
        "others with covers in the CAD program"
    )


def _stray(at_air: SurfaceGrid, parts: NDArray[np.int64]) -> bool:
    """Whether a part of the surface besides the outermost is one seen from outside."""
    volumes = [at_air.only(parts == part).skin.volume_m3 for part in range(parts.max() + 1)]
    return sum(volume > 0.0 for volume in volumes) != 1


def _wall(skin: Skin) -> float:
    """Return the thickness that a fifth of the surface is thinner than: what lies behind its triangles' middles."""
    sizes = np.linalg.norm(skin.vectors_m2, axis=1)
    chosen = _spread(sizes, 300)
    inward = -(skin.vectors_m2 / sizes[:, None])[chosen]
    starts = skin.corners_m.mean(axis=1)[chosen]
    thick = np.array([_behind(skin, start, way) for start, way in zip(starts, inward, strict=True)])
    thick = thick[np.isfinite(thick)]
    return float(np.round(np.quantile(thick, 0.2), 5)) if len(thick) else float(skin.volume_m3 / skin.area_m2)


def _spread(sizes: Real, number: int) -> NDArray[np.int64]:
    """Return triangles evenly over the area."""
    reached = np.cumsum(sizes)
    return np.minimum(np.searchsorted(reached, (np.arange(number) + 0.5) / number * reached[-1]), len(sizes) - 1)


def _behind(skin: Skin, start: Real, way: Real) -> float:
    """Return the distance from a point of the surface to the next triangle along a way."""
    a, b, c = skin.corners_m.transpose(1, 0, 2)
    ab, ac = b - a, c - a
    p = np.cross(way, ac)
    size = (ab * p).sum(1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((start - a) * p).sum(1) / size
        q = np.cross(start - a, ab)
        v = (way * q).sum(1) / size
        far = (ac * q).sum(1) / size
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 1e-4)
    return float(far[hit].min(initial=np.inf))
