"""The insertion loss over frequency: its bands, walls, losses and decibels by hand, and the place of its source."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from made_up_modes import air_of_made_up_modes, fleet_text, modes_of, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.cavity import WallModes, coupled_velocities
from tdacoustic.drive import DriveModel
from tdacoustic.drive import insertion_loss as module
from tdacoustic.drive.housing_steps import housing_tasks
from tdacoustic.drive.insertion_loss import LEAST_A_BAND, LINES_A_WIDTH, MOST_LINES, air_tasks, lines_a_band, loss_db
from tdacoustic.drive.source_inside import SourceInside, _cavity
from tdacoustic.radiation import mean_over_sphere_db

FIELD_INCIDENCE = (
    "literature: mass law of field incidence, 20 lg(m f) - 47 dB (Fahy and Gardonio, Sound and Structural Vibration)"
)

STEEL_KG_M3 = 7850.0


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(fleet_text("", 700), encoding="utf-8")
    return td.load_fleet(path)


@pytest.fixture(scope="module")
def housing(fleet):
    return air_of_made_up_modes(fleet, sound_of_made_up_modes(fleet))


@pytest.fixture(scope="module")
def loss_of(fleet, housing):
    """The insertion loss with other loss factors of walls and air."""
    _, task = air_tasks(fleet, housing_tasks(fleet))

    def made(walls, air):
        settings = replace(task.settings, loss_factor=walls, cavity_loss_factor=air)
        return module._insertion_loss(settings, housing.modes, housing.mean, housing.cavity)

    return made


# ------------------------------------------------------------------ third octaves


@pytest.mark.parametrize(
    ("walls", "air"), [(0.002, 0.01), (0.02, 0.002), (0.002, 0.002), (0.005, 0.005), (0.02, 0.01), (0.02, 0.02)]
)
def test_third_octaves_hardly_change_with_four_times_the_lines(loss_of, monkeypatch, walls, air):
    """Two lines a width leave 2 exp(-2π) = 0.4 % of a resonance's energy, 0.016 dB; twice that for edges of bands."""
    held = loss_of(walls, air)
    assert held.lines_a_width == pytest.approx(LINES_A_WIDTH, rel=0.06)  # lines are whole numbers
    monkeypatch.setattr(module, "LINES_A_WIDTH", 4.0 * LINES_A_WIDTH)
    monkeypatch.setattr(module, "MOST_LINES", 10 * MOST_LINES)
    finer = loss_of(walls, air)
    assert len(finer.frequency_hz) > 3.5 * len(held.frequency_hz)
    assert np.array_equal(finer.band_hz, held.band_hz)
    assert held.band_db == pytest.approx(finer.band_db, abs=0.035)


def test_lines_stand_in_the_middles_of_equal_parts_of_the_bands(loss_of):
    held = loss_of(0.02, 0.01)
    edges = [1000.0 * 10.0 ** (0.1 * band - 0.05) for band in range(-20, 10)]
    whole = [pair for pair in itertools.pairwise(edges) if pair[0] >= 50.0 and pair[1] <= 700.0]
    assert held.band_hz == pytest.approx([math.sqrt(low * high) for low, high in whole], rel=1e-12)
    for (low, high), mean in zip(whole, held.band_db, strict=True):
        within = (held.frequency_hz > low) & (held.frequency_hz < high)
        lines = held.frequency_hz[within]
        assert lines[0] / low == pytest.approx(high / lines[-1], rel=1e-9)
        assert mean == pytest.approx(-10.0 * math.log10(np.mean(10.0 ** (-0.1 * held.loss_db[within]))), abs=1e-9)


def test_the_count_of_lines_has_its_bounds(loss_of):
    assert lines_a_band(0.5, 3000.0) == LEAST_A_BAND
    for highest in (700.0, 3000.0):
        bands = 10.0 * math.log10(highest / 50.0)
        for loss_factor in (0.0, 1e-5):
            assert lines_a_band(loss_factor, highest) * bands <= MOST_LINES
    rough = loss_of(2e-4, 0.01)
    assert len(rough.frequency_hz) <= MOST_LINES
    assert rough.lines_a_width < 0.5 * LINES_A_WIDTH


# ------------------------------------------------------------------ walls, air, mesh frequencies


def test_walls_and_mass_law_by_hand(loss_of, conformance):
    """0.5 x 0.2 x 0.4 m; 6 mm, 8 mm on the bearing panels (normal y), 6 mm on top and bottom."""
    held = loss_of(0.02, 0.01)
    by_hand = [(2 * 0.2 * 0.4, 0.006), (2 * 0.5 * 0.4, 0.008), (2 * 0.5 * 0.2, 0.006)]
    assert [area for area, _ in held.walls] == pytest.approx([area for area, _ in by_hand])
    assert [mass for _, mass in held.walls] == pytest.approx([STEEL_KG_M3 * panel for _, panel in by_hand])
    # 20 lg(m f) - 47 dB of limp walls at field incidence, the transmitted energies by area
    place = int(np.abs(held.frequency_hz - 500.0).argmin())
    frequency = held.frequency_hz[place]
    through = sum(area * 10.0 ** (4.7 - 2.0 * math.log10(STEEL_KG_M3 * t * frequency)) for area, t in by_hand)
    rule = -10.0 * math.log10(through / sum(area for area, _ in by_hand))
    conformance("mass law of 6 and 8 mm", rule, held.mass_law_db[place], 0.5, "dB", FIELD_INCIDENCE)


def test_an_absorption_coefficient_is_that_of_sabine(loss_of, conformance):
    """A loss factor decays in T = 3 ln 10 / (π f η), and Sabine's T = 24 ln 10 V / (c S α)."""
    air = loss_of(0.02, 0.03).air
    volume, surface = 0.488 * 0.184 * 0.388, 2.0 * (0.488 * 0.184 + 0.488 * 0.388 + 0.184 * 0.388)
    decay_s = 3.0 * math.log(10.0) / (math.pi * air.frequency_hz * 0.03)
    sound_speed = math.sqrt(1.4 * 287.05 * 293.15)  # the fleet's 20 °C
    assert air.loss_factor == 0.03
    sabine = 24.0 * math.log(10.0) * volume / (sound_speed * surface * decay_s)
    source = "analytic: Sabine's decay, T = 24 ln 10 V / (c S alpha)"
    conformance("absorption of walls from a loss factor", sabine, air.absorption, 1e-3 * sabine, "1", source)
    bare = bare_walls(air.frequency_hz) * surface / volume
    source = "independent: Kirchhoff's boundary layers summed over directions"
    conformance("loss factor of bare walls", bare, air.bare_walls, 1e-3 * bare, "1", source)


def bare_walls(frequency_hz):
    """Loss factor times V/S of a wall with Kirchhoff's boundary layer, averaged over directions by a sum.

    A wave of 1 Pa at an angle θ makes 2 Pa and 2 sin θ / ρc along the wall; both layers take power in proportion to
    their thickness. Of a diffuse field cos θ of the energy's flow c/4 meets the wall; η is the power over ω times E.
    """
    nu, prandtl, kappa, omega = 1.51e-5, 0.71, 1.4, 2.0 * math.pi * frequency_hz
    viscous = math.sqrt(2.0 * nu / omega)
    angle = (np.arange(2000) + 0.5) * 0.5 * math.pi / 2000
    # power per area, in units of |p|² / (ρ c²) of the wave: ω/2 times half of each layer's thickness times the squares
    taken = 0.25 * omega * (viscous * 4.0 * np.sin(angle) ** 2 + (kappa - 1.0) * viscous / math.sqrt(prandtl) * 4.0)
    # waves of equal strength from the half space, weighted by solid angle; each has the energy |p|² / (2 ρ c²), and
    # those going away from the wall as much
    weight = np.sin(angle) / np.sin(angle).sum()
    return float((taken * weight).sum() / omega / (2.0 * 0.5))


def test_at_a_mesh_frequency_with_half_and_twice_the_loss_of_the_air(fleet, housing):
    model = DriveModel(fleet, housing=housing)
    held = model.with_insertion_loss(model.evaluate()).insertion_loss
    surface_db = mean_over_sphere_db(4.0)
    walls = WallModes(housing.modes.frequency_hz, 0.03)
    changed = []
    for mesh in held.at_mesh[:5]:
        moved = [coupled_velocities(housing.cavity.modes, walls, mesh.frequency_hz, air) for air in (0.005, 0.01, 0.02)]
        losses = [loss_db(housing.mean.of_modes(mesh.frequency_hz, one), surface_db) for one in moved]
        assert mesh.of_air_db == pytest.approx((losses[0], losses[2]), abs=1e-9)
        assert mesh.loss_db == pytest.approx(losses[1], abs=1e-9)
        changed.append(abs(losses[2] - losses[0]))
    assert max(changed) > 0.01  # far more than the tolerance


# ------------------------------------------------------------------ a housing that is not at the origin

MIDDLE = (0.1, -0.3, 0.05)
PLACE = (0.17, -0.27, 0.13)
SIZE = (0.488, 0.184, 0.388)


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """The air of a housing away from the origin, its source at `PLACE` in the drive's frame."""
    text = fleet_text("", 700).replace("[housing]\n", f"[housing]\nposition_m = {list(MIDDLE)}\n")
    for x in (-0.1, 0.1):
        text = text.replace(f"position_m = [{x}, 0.0, 0.0]", f"position_m = {[x + MIDDLE[0], *MIDDLE[1:]]}")
    path = tmp_path_factory.mktemp("elsewhere") / "fleet.toml"
    path.write_text(text, encoding="utf-8")
    fleet = td.load_fleet(path).replaced({"masuda.placement": "inside", "masuda.position_m": PLACE})
    tasks = housing_tasks(fleet)
    modes = modes_of(tasks.box, 700.0)
    air = _cavity(air_tasks(fleet, tasks)[0].settings, modes)
    return SourceInside(air, modes.frequency_hz, tasks.body.position_m)


def test_the_source_stands_where_the_file_says(elsewhere):
    """In the drive's frame; close to it the pressure is 1 Pa m over the distance."""
    assert elsewhere.source_m == pytest.approx(PLACE, abs=1e-9)
    assert elsewhere.moved((0.02, 0.0, -0.03)).source_m == pytest.approx((0.19, -0.27, 0.10), abs=1e-9)
    beside = np.array(PLACE) + 0.002 * np.concatenate([np.eye(3), -np.eye(3)])
    found = np.abs(elsewhere.pressures(beside, 300.0, 0.01, None, 1.0))
    assert found == pytest.approx(np.full(6, 500.0), rel=0.1)  # the reflected sound is some 5 % of it


def test_points_inside_are_of_the_drives_frame(elsewhere):
    """At the resonance of the air along x, c / 2L, the pressure is a cosine from end to end of the housing."""
    frequency = elsewhere.cavity.modes.sound_speed_m_s / (2.0 * SIZE[0])
    along = np.linspace(-0.45, 0.45, 7) * SIZE[0]
    points = np.array(MIDDLE) + np.column_stack([along, np.full(7, 0.02), np.full(7, -0.11)])
    found = elsewhere.pressures(points, frequency, 1e-4, None, 1.0)
    wanted = np.cos(math.pi * (along / SIZE[0] + 0.5))
    assert found / found[0] == pytest.approx(wanted / wanted[0], abs=2e-3)  # what does not resonate


def test_source_and_point_can_be_exchanged(elsewhere):
    other = (0.02, -0.36, -0.05)
    there = elsewhere.moved(tuple(b - a for a, b in zip(PLACE, other, strict=True)))
    both = [
        held.pressures([place], 350.0, 0.01, held.velocities(350.0, 0.03, 0.01), 1.0)[0]
        for held, place in ((elsewhere, other), (there, PLACE))
    ]
    assert both[0] == pytest.approx(both[1], rel=1e-3)  # the walls' series has an end
