"""Steps: modes of a housing, its transfer vectors, and what surfaces and receivers get of them.

Modes depend on the housing alone (its seats follow the gears' centre distance where the fleet does not place them),
transfer vectors on the modes, the air, the ground and the places of the sources; close receivers have a step of their
own, and the last two steps depend on which receivers there are. None depends on speeds, torques, forces or the
housing's loss factor, so that all conditions share them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.gear_unit import gear_unit_of
from tdacoustic.drive.housing_box import AnyHousing, body_of, housing_of
from tdacoustic.drive.housing_solid import SOLID_MODES, solid_modes_task
from tdacoustic.drive.levels import Receiver, circle_of
from tdacoustic.drive.solid_in_air import SolidInAir
from tdacoustic.errors import FleetError, RadiationError
from tdacoustic.fleet import Fleet
from tdacoustic.housing import Box, HousingModes, SolidModes, housing_modes
from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.radiation.box_in_air import BoxInAir
from tdacoustic.radiation.received import MeanVectors, PointVectors, mean_vectors, point_vectors
from tdacoustic.radiation.surfaces import Surface
from tdacoustic.radiation.transfer_vectors import (
    NearNodes,
    TransferBand,
    TransferNodes,
    bands_of,
    near_band,
    transfer_band,
)
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress

__all__ = [
    "HOUSING_MODES",
    "MEAN_VECTORS",
    "NEAR_VECTORS",
    "POINT_VECTORS",
    "SOLID_MODES",
    "TRANSFER_VECTORS",
    "HousingTasks",
    "housing_tasks",
]

Real = NDArray[np.float64]
Point = tuple[float, float, float]


@dataclass(frozen=True)
class ModesSettings:
    """What modes depend on.

    Parameters
    ----------
    box : Box
        Its loss factor and the gears' places along the shafts are those of no fleet in particular.
    highest_hz : float
    """

    box: Box
    highest_hz: float


@dataclass(frozen=True)
class BandSettings:
    """What the transfer vectors of a band depend on besides the modes.

    Parameters
    ----------
    body : BoxInAir or SolidInAir
    band : TransferBand
    """

    body: BoxInAir | SolidInAir
    band: TransferBand


@dataclass(frozen=True)
class MeanSettings:
    """What the means over a sphere depend on besides transfer vectors.

    Parameters
    ----------
    body : BoxInAir or SolidInAir
    radius_m : float
    """

    body: BoxInAir | SolidInAir
    radius_m: float


@dataclass(frozen=True)
class PointSettings:
    """What pressures at points depend on besides transfer vectors.

    Parameters
    ----------
    body : BoxInAir or SolidInAir
    points_m : tuple of (float, float, float)
    """

    body: BoxInAir | SolidInAir
    points_m: tuple[Point, ...]


def _modes(settings: ModesSettings) -> HousingModes:
    return housing_modes(settings.box, settings.highest_hz)


def _transfer(settings: BandSettings, modes: HousingModes | SolidModes) -> TransferNodes:
    body, velocities_of = _moving(settings, modes)
    return transfer_band(body, settings.band, velocities_of, tell_progress)


def _near(settings: BandSettings, modes: HousingModes | SolidModes) -> NearNodes:
    body, velocities_of = _moving(settings, modes)
    return near_band(body, settings.band, velocities_of, tell_progress)


def _moving(settings: BandSettings, modes: HousingModes | SolidModes) -> tuple[BodyInAir, Callable[[Surface], Real]]:
    """Return the body with its grids, and what gives the velocities of their panels."""
    if isinstance(modes, HousingModes):
        return settings.body, partial(panel_velocities, modes, position_m=settings.body.position_m)
    assert isinstance(settings.body, SolidInAir)
    body = settings.body.with_panels(modes)
    velocities = np.asarray(body.panels_for(settings.band.grid_hz).velocities, dtype=np.float64)
    return body, lambda _: velocities


def _means(settings: MeanSettings, **bands: TransferNodes) -> MeanVectors:
    return mean_vectors(settings.body, list(bands.values()), settings.radius_m)


def _points(settings: PointSettings, **bands: TransferNodes | NearNodes) -> PointVectors:
    far = [band for band in bands.values() if isinstance(band, TransferNodes)]
    near = [band for band in bands.values() if isinstance(band, NearNodes)]
    return point_vectors(settings.body, far, settings.points_m, near)


HOUSING_MODES: Final = Step("housing-modes", 2, _modes, "Modes of the housing by finite elements")
TRANSFER_VECTORS: Final = Step(
    "transfer-vectors", 1, _transfer, "Sound of the housing's modes and of point sources by boundary elements"
)
NEAR_VECTORS: Final = Step("near-vectors", 1, _near, "Pressures close to the housing by boundary elements")
MEAN_VECTORS: Final = Step("mean-vectors", 1, _means, "Means over the surface from transfer vectors")
POINT_VECTORS: Final = Step("point-vectors", 1, _points, "Pressures at receivers from transfer vectors")


def panel_velocities(modes: HousingModes, surface: Surface, position_m: Point) -> Real:
    """Return the mean outward velocity of each panel per modal velocity, shape (panels, modes), in 1/√kg.

    Three by three points a panel: a value at its centre alone misses half of a bending wave.

    Parameters
    ----------
    modes : HousingModes
    surface : Surface
        Of rectangles on the box.
    position_m : (float, float, float)
        Of the middle of the box in the frame of the surface.
    """
    from scipy.sparse import csr_array

    ends, shares = np.polynomial.legendre.leggauss(3)
    corners = surface.corners_m - np.asarray(position_m)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    count = len(corners)
    found = np.zeros((count, len(modes.frequency_hz)))
    for u, of_u in zip(ends, shares, strict=True):
        for v, of_v in zip(ends, shares, strict=True):
            points = corners[:, 0] + 0.5 * (1.0 + u) * first + 0.5 * (1.0 + v) * second
            nodes, weights = modes.surface.weights(points, surface.normals)
            rows = np.repeat(np.arange(count), nodes.shape[1])
            shape = (count, len(modes.surface.points_m))
            picked = csr_array((0.25 * of_u * of_v * weights.ravel(), (rows, nodes.ravel())), shape=shape)
            found += picked @ modes.outward.T
    return found


@dataclass(frozen=True)
class HousingTasks:
    """The tasks behind the sound field of a housing.

    Parameters
    ----------
    box : Box or SolidHousing
        With the fleet's own loss factor and gears.
    body : BoxInAir or SolidInAir
    modes : Task
    bands : tuple of Task
    near : tuple of Task
        Of receivers close to the housing; none without such.
    mean : Task
    points : Task
        Around the circle first.
    """

    box: AnyHousing
    body: BoxInAir | SolidInAir
    modes: Task
    bands: tuple[Task, ...]
    near: tuple[Task, ...]
    mean: Task
    points: Task


def housing_tasks(fleet: Fleet, receivers: Sequence[Receiver] = ()) -> HousingTasks:
    """Return the tasks of a fleet's housing.

    Parameters
    ----------
    fleet : Fleet
    receivers : sequence of Receiver
        Those with a position are computed besides the circle.

    Raises
    ------
    FleetError
        ``[housing]``, ``[radiation]`` or the place of a source or receiver does not allow it.
    """
    unit = gear_unit_of(fleet)
    box = housing_of(fleet, unit)
    circle = circle_of(fleet)
    placed = tuple(dict.fromkeys(receiver for receiver in receivers if receiver.position_m is not None))
    names = [(f"the receiver {r.name}", r.position_m) for r in placed if r.position_m is not None]
    names += [("the circle ([radiation] circle_radius_m)", r.position_m) for r in circle if r.position_m is not None]
    body = body_of(fleet, box, names)
    highest_hz = fleet.radiation.max_frequency_hz.value
    modes = _box_modes_task(box, highest_hz) if isinstance(box, Box) else solid_modes_task(fleet, unit, box)
    radius_m = fleet.radiation.sphere_radius_m.value
    known = body.alone if isinstance(body, SolidInAir) else body
    alone = replace(known, near_m=())
    try:
        held = bands_of(body, highest_hz)
        alone.check_sphere(radius_m)
    except RadiationError as error:
        raise FleetError(f"{fleet.path}: [radiation]: {error}") from error
    bands = tuple(TRANSFER_VECTORS.task(_cost(body, band), BandSettings(alone, band), modes=modes) for band in held)
    close = held if body.near_m else ()
    near = tuple(NEAR_VECTORS.task(_reach(band), BandSettings(known, band), modes=modes) for band in close)
    inputs = {f"band_{number}": task for number, task in enumerate(bands)}
    of_near = {f"near_{number}": task for number, task in enumerate(near)}
    mean = MEAN_VECTORS.task(f"{radius_m:g} m", MeanSettings(alone, radius_m), **inputs)
    others = {r.position_m for r in placed if r.position_m is not None}
    points = (*(r.position_m for r in circle if r.position_m is not None), *sorted(others))
    return HousingTasks(
        box,
        body,
        modes,
        bands,
        near,
        mean,
        POINT_VECTORS.task(f"{len(points)} receivers", PointSettings(known, points), **inputs, **of_near),
    )


def _box_modes_task(box: Box, highest_hz: float) -> Task:
    pinion, wheel = (replace(seat, gear_y_m=0.0) for seat in box.seats)
    alike = replace(box, loss_factor=0.02, seats=(pinion, wheel))
    return HOUSING_MODES.task(f"up to {highest_hz:g} Hz", ModesSettings(alike, highest_hz))


def _cost(body: BoxInAir | SolidInAir, band: TransferBand) -> str:
    """Which frequencies, and for a solid on how many panels: without mirror planes the work is up to 64 times."""
    if isinstance(body, BoxInAir):
        return _reach(band)
    panels, taken = body.panels_about(band.grid_hz), body.needed_bytes(band.grid_hz)
    return f"{_reach(band)}, some {panels:.0f} panels, {1e-9 * taken:.1f} GB"


def _reach(band: TransferBand) -> str:
    return f"{band.frequency_hz[0]:.0f} to {band.frequency_hz[-1]:.0f} Hz"
