"""A small fleet with a housing, and modes of its box that need no finite elements: plates by formula."""

import math
from dataclasses import replace

import numpy as np
from plain_fleets import plain_fleet

from tdacoustic.drive import HousingSound
from tdacoustic.drive.housing_steps import (
    BandSettings,
    MeanSettings,
    PointSettings,
    _means,
    _points,
    housing_tasks,
    panel_velocities,
)
from tdacoustic.drive.insertion_loss import _insertion_loss, air_tasks
from tdacoustic.drive.source_inside import _cavity
from tdacoustic.housing import HousingModes
from tdacoustic.housing.solid_grid import PANELS
from tdacoustic.housing.surface import panel_nodes
from tdacoustic.radiation.transfer_vectors import near_band, transfer_band

HOUSING = """
[housing]
size_m = [0.2, 0.5, 0.4]
wall_mm = 6
bearing_panel_mm = 8
top_bottom_mm = 6
loss_factor = 0.03

[[housing.seat]]
shaft = "pinion"
position_m = [-0.1, 0.0, 0.0]
radius_m = 0.05
thickness_mm = 30

[[housing.seat]]
shaft = "wheel"
position_m = [0.1, 0.0, 0.0]
radius_m = 0.08
thickness_mm = 30
"""


def fleet_text(motor, highest_hz):
    """The reference drive with boundary elements, this small housing and another motor."""
    whole = plain_fleet("reference-drive").read_text(encoding="utf-8")
    start, end = whole.index("# Radii usual for machines"), whole.index("[radiation]")
    text = (whole[:start] + motor + HOUSING + whole[end:]).replace("= 3000", f"= {highest_hz}")
    return text.replace("point_sources", "boundary_elements")


def triangles_of(extent_m, cells=8):
    """Two triangles a cell on each panel of a box: corners and panels' numbers."""
    corners, panels = [], []
    for number, (axis, sign) in enumerate(PANELS):
        normal = "xyz".index(axis)
        first, second = (other for other in range(3) if other != normal)
        lines = [np.linspace(-0.5 * extent_m[k], 0.5 * extent_m[k], cells + 1) for k in (first, second)]
        for i in range(cells):
            for j in range(cells):
                square = np.empty((4, 3))
                square[:, normal] = 0.5 * sign * extent_m[normal]
                square[:, first] = lines[0][[i, i + 1, i + 1, i]]
                square[:, second] = lines[1][[j, j, j + 1, j + 1]]
                corners += [square[[0, 1, 2]], square[[0, 2, 3]]]
                panels += [number, number]
    return np.array(corners), np.array(panels)


def modes_of(box, highest_hz, count=6):
    """Plate-like shapes on the bearing panels, in and out of phase, and seats that follow them."""
    surface = panel_nodes(*triangles_of(box.extent_m), order=2)
    along = surface.points_m / np.asarray(box.extent_m)
    side = np.where(surface.normals[:, 1] > 0.5, 1.0, 0.0) - np.where(surface.normals[:, 1] < -0.5, 1.0, 0.0)
    outward, seats = [], np.zeros((count, 4, 3))
    for mode in range(count):
        waves = 1 + mode // 2
        both = 1.0 if mode % 2 else -1.0
        shape = np.cos(waves * math.pi * along[:, 0]) * np.cos(math.pi * along[:, 2])
        outward.append(0.3 * shape * np.where(side > 0.0, 1.0, both * (side < 0.0)))
        seats[mode, :, 1] = 0.1 * np.array([1.0, both, -1.0, -both]) / (1 + mode)
        seats[mode, :, 2] = 0.05
    frequency = np.linspace(150.0, 900.0, count)
    return HousingModes(box, highest_hz, count, frequency, seats, surface, np.array(outward), box.mass_kg)


def sound_of_made_up_modes(fleet, receivers=()):
    """The transfer vectors of these modes, through the functions of the steps."""
    tasks = housing_tasks(fleet, receivers)
    modes = modes_of(tasks.box, fleet.radiation.max_frequency_hz.value)
    bands, near = {}, {}
    for held, made, solve in ((tasks.bands, bands, transfer_band), (tasks.near, near, near_band)):
        for number, task in enumerate(held):
            settings = task.settings
            assert isinstance(settings, BandSettings)
            made[f"{solve.__name__}_{number}"] = solve(
                settings.body, settings.band, lambda surface: panel_velocities(modes, surface, tasks.body.position_m)
            )
    mean, points = tasks.mean.settings, tasks.points.settings
    assert isinstance(mean, MeanSettings)
    assert isinstance(points, PointSettings)
    return HousingSound(tasks.box, tasks.body, modes, _means(mean, **bands), _points(points, **bands, **near))


def air_of_made_up_modes(fleet, housing):
    """The same with the air inside and the insertion loss, through the functions of the steps."""
    cavity, loss = air_tasks(fleet, housing_tasks(fleet))
    air = _cavity(cavity.settings, housing.modes)
    return replace(housing, cavity=air, insertion_loss=_insertion_loss(loss.settings, housing.modes, housing.mean, air))
