"""A rectangular cavity with walls that move, held against closed forms and finite elements of the air."""

import math

import numpy as np
import pytest
from cavity_walls import DENSITY, IMPEDANCE, SOUND_SPEED, SupportedPlate, steel

from tdacoustic.cavity import (
    CavityError,
    CavityModes,
    WallModes,
    blocked_forces,
    box_cavity,
    box_interior,
    coupled_velocities,
    pressure_of_source,
    pressure_of_walls,
    wall_impedance,
)

SIZE = (0.6, 0.4, 0.5)
SOURCE = (0.12, -0.07, 0.03)


@pytest.fixture(scope="module")
def plate():
    return SupportedPlate(SIZE, *steel(0.003), 1500.0)


@pytest.fixture(scope="module")
def interior(plate):
    return box_interior(SIZE, plate.outward, plate.bending_rad_m, 4.0 * plate.bending_rad_m)


@pytest.fixture(scope="module")
def cavity(interior):
    return box_cavity(interior, 1000.0, SOURCE, SOUND_SPEED, DENSITY)


def piston_duct(length_m, side_m, mass_kg):
    """A duct with rigid walls and a piston at its end at +x."""

    def outward(points, normals):
        return np.where(normals[:, 0] > 0.5, 1.0 / math.sqrt(mass_kg), 0.0)[None, :]

    return box_interior((length_m, side_m, side_m), outward, 0.0, 100.0)


@pytest.mark.parametrize("frequency", [20.0, 97.0, 171.5, 260.0, 333.0])
@pytest.mark.parametrize("loss", [0.0, 0.03])
def test_a_sprung_piston_at_the_end_of_a_duct(frequency, loss):
    """One dimension in closed form: rigid at 0, a source at x, the piston at L; the piston sees nothing else."""
    length, side, mass, place, natural, damping = 1.0, 0.1, 0.5, 0.31, 140.0, 0.05
    duct = box_cavity(
        piston_duct(length, side, mass), 400.0, (place - 0.5 * length, 0.01, 0.0), SOUND_SPEED, DENSITY, kept=3.0
    )
    found = coupled_velocities(duct, WallModes(np.array([natural]), damping), frequency, loss)[0] / math.sqrt(mass)
    omega = 2.0 * math.pi * frequency
    k = omega / SOUND_SPEED * np.sqrt(1.0 - 1j * loss)
    area = side**2
    # p = A cos kx up to the source, whose flow Q (jωρQ = 4π) makes a jump of dp/dx by -4π/S; p' = -jωρ v at the piston
    flow = 4.0 * math.pi / area
    free = (mass * ((2.0 * math.pi * natural) ** 2 * (1.0 + 1j * damping) - omega**2)) / (
        1j * omega * area
    )  # p = free v
    # p(L) = A cos kL - flow sin(k(L - x))/k ; p'(L) = -A k sin kL - flow cos(k(L - x)) = -jωρ p(L) / free
    reflected = 1j * omega * DENSITY / free
    a = (
        flow
        * (np.cos(k * (length - place)) + reflected * np.sin(k * (length - place)) / k)
        / (reflected * np.cos(k * length) - k * np.sin(k * length))
    )
    expected = (a * np.cos(k * length) - flow * np.sin(k * (length - place)) / k) / free
    assert found == pytest.approx(expected, rel=3e-5)  # the power series beyond 1200 Hz ends with k^4


def test_below_all_resonances_the_air_is_a_spring(interior, plate):
    """ρc²/V times the squared volume that the wall takes away, and the source's pressure ρc² Q / (jωV)."""
    cavity = box_cavity(interior, 1000.0, SOURCE, SOUND_SPEED, DENSITY)
    volume, frequency = math.prod(SIZE), 0.5
    omega = 2.0 * math.pi * frequency
    odd = (plate.numbers % 2).all(axis=1)
    swept = np.where(odd, 2.0 / math.sqrt(plate.mass * SIZE[0] * SIZE[1]), 0.0)
    swept = swept * 4.0 * SIZE[0] * SIZE[1] / (math.pi**2 * plate.numbers.prod(axis=1))
    stiffness = (1j * omega * wall_impedance(cavity, frequency, 0.0)).real
    spring = DENSITY * SOUND_SPEED**2 / volume * np.outer(swept, swept)
    assert stiffness[0, 0] == pytest.approx(spring[0, 0], rel=1e-4)
    assert np.abs(stiffness - spring).max() < 1e-4 * spring[0, 0]
    pressure = 4.0 * math.pi * SOUND_SPEED**2 / ((1j * omega) ** 2 * volume)
    forces = blocked_forces(cavity, frequency, 0.0)
    assert forces[0] == pytest.approx(pressure * swept[0], rel=1e-4)


def test_integrals_of_walls_are_those_by_hand(interior, plate):
    """∫ sin(mπx/a) cos(lπx/a) dx = (a/π) 2m / (m² - l²) where m + l is odd, else 0."""
    a, b = SIZE[:2]

    def along(length, m, numbers):
        parts = [2.0 * m / (m**2 - n**2) * length / math.pi if (m + n) % 2 else 0.0 for n in numbers]
        return np.array(parts) * np.where(np.arange(len(parts)) > 0, math.sqrt(2.0), 1.0)

    wall = interior.pair(2)[1]
    for number in (0, 3, len(plate.numbers) - 1):
        m, n = plate.numbers[number]
        by_hand = np.outer(along(a, m, range(wall.shape[1])), along(b, n, range(wall.shape[2])))
        by_hand *= 2.0 / math.sqrt(plate.mass * a * b)
        assert wall[number] == pytest.approx(by_hand, abs=1e-9 * np.abs(by_hand).max())
    assert not np.abs(interior.pair(0)[0]).any()


def test_what_is_not_kept_is_in_the_series(interior, plate):
    """The walls' velocities hardly change when four times as many frequencies are kept; without the series they do."""
    walls = WallModes(plate.frequency_hz, 0.02)
    frequencies = np.linspace(60.0, 1000.0, 25)

    def velocities(**settings):
        cavity = box_cavity(interior, 1000.0, SOURCE, SOUND_SPEED, DENSITY, **settings)
        return np.array([coupled_velocities(cavity, walls, frequency, 0.01) for frequency in frequencies])

    exact = velocities(kept=4.0)
    size = np.abs(exact).max(axis=1)

    def worst(**settings):
        return (np.abs(velocities(**settings) - exact).max(axis=1) / size).max()

    assert worst() < 5e-3  # 0.04 dB at worst, here where thin walls and air resonate together
    assert worst(terms=1) > 5.0 * worst()
    assert worst(terms=0) > 0.1


def test_the_reach_along_walls_is_enough(plate):
    walls = WallModes(plate.frequency_hz, 0.02)
    found = []
    for reach in (3.0, 6.0):
        interior = box_interior(SIZE, plate.outward, plate.bending_rad_m, reach * plate.bending_rad_m)
        cavity = box_cavity(interior, 1000.0, SOURCE, SOUND_SPEED, DENSITY)
        found.append([coupled_velocities(cavity, walls, f, 0.01) for f in np.linspace(60.0, 1000.0, 25)])
    apart = np.abs(np.diff(found, axis=0)[0]).max(axis=1) / np.abs(found[1]).max(axis=1)
    assert apart.max() < 2e-3


def test_impedance_is_symmetric_and_takes_power(cavity):
    impedance = wall_impedance(cavity, 437.0, 0.02)
    assert impedance == pytest.approx(impedance.T, rel=1e-12)
    assert np.linalg.eigvalsh(impedance.real).min() > -1e-9 * np.abs(impedance.real).max()
    without = wall_impedance(cavity, 437.0, 0.0)
    assert np.abs(without.real).max() < 1e-12 * np.abs(without).max()


def test_source_and_force_can_be_exchanged(interior, cavity, plate):
    """What a source of volume flow Q moves of mode m, over Q, is minus the pressure there of a force on m, over it."""
    walls = WallModes(plate.frequency_hz, 0.03)
    frequency, loss = 411.0, 0.02
    flow = 4.0 * math.pi / (2j * math.pi * frequency * DENSITY)
    root = np.sqrt(cavity.squared_wave_number(frequency, loss))
    moved = coupled_velocities(cavity, walls, frequency, loss) / flow
    for mode in (0, 2, 5):
        force = np.zeros(len(plate.frequency_hz))
        force[mode] = 1.0
        answer = coupled_velocities(cavity, walls, frequency, loss, 0.0, force)
        pressure = pressure_of_walls(interior, [SOURCE], answer, frequency, root, DENSITY)[0]
        assert pressure == pytest.approx(-moved[mode], rel=1e-3)


@pytest.mark.parametrize("frequency", [150.0, 286.0, 433.0, 900.0])
def test_power_of_the_source_goes_into_walls_and_air(interior, plate, frequency):
    """½ Re(p Q*) at the source; ½ η ω_m² |q|² / ω of the walls; ½ ωη/(ρc²) ∫|p|² dV of the air, mode by mode."""
    cavity = box_cavity(interior, 1000.0, SOURCE, SOUND_SPEED, DENSITY, kept=4.0)
    walls, loss = WallModes(plate.frequency_hz, 0.02), 0.02
    omega, volume = 2.0 * math.pi * frequency, math.prod(SIZE)
    moved = coupled_velocities(cavity, walls, frequency, loss)
    square = cavity.squared_wave_number(frequency, loss)
    beside = np.array(SOURCE) + 1e-3 * np.concatenate([np.eye(3), -np.eye(3)])
    at_source = pressure_of_source(interior, beside, SOURCE, np.sqrt(square)).mean()
    at_source += pressure_of_walls(interior, [SOURCE], moved, frequency, np.sqrt(square), DENSITY)[0]
    put_in = 0.5 * (at_source * np.conj(4.0 * math.pi / (1j * omega * DENSITY))).real
    of_walls = 0.5 * walls.loss_factor * ((2.0 * math.pi * plate.frequency_hz) ** 2 * np.abs(moved) ** 2).sum() / omega
    drive = 4.0 * math.pi * cavity.source - 1j * omega * DENSITY * (cavity.walls @ moved)
    squares = (np.abs(drive * cavity.responses(square) / volume) ** 2).sum() * volume
    squares += 8.0 / cavity.wave_number_rad_m[-1]  # of the source's near field: Σ (4π)²/(V k_n^4) beyond the kept modes
    of_air = 0.5 * omega * loss / (DENSITY * SOUND_SPEED**2) * squares
    assert put_in == pytest.approx(of_walls + of_air, rel=1e-2)  # the walls' near field is left out
    assert min(of_walls, of_air) > 1e-4 * put_in


def air_by_finite_elements(size_m, source_m, plate, order=5, edge_m=0.14):
    """Stiffness, mass, source and wall integrals of the air in NGSolve's elements."""
    ngsolve = pytest.importorskip("ngsolve")
    from netgen.csg import CSGeometry, OrthoBrick, Pnt
    from scipy.sparse import csc_matrix

    half = [0.5 * size for size in size_m]
    geometry = CSGeometry()
    geometry.Add(OrthoBrick(Pnt(*(-h for h in half)), Pnt(*half)))
    grid = ngsolve.Mesh(geometry.GenerateMesh(maxh=edge_m))
    space = ngsolve.H1(grid, order=order)
    u, v = space.TnT()
    with ngsolve.TaskManager():
        matrices = []
        for form in (ngsolve.grad(u) * ngsolve.grad(v) * ngsolve.dx, u * v * ngsolve.dx):
            held = ngsolve.BilinearForm(form).Assemble().mat
            rows, columns, values = held.COO()
            matrices.append(csc_matrix((np.array(values), (np.array(rows), np.array(columns)))))
        top = ngsolve.specialcf.normal(3)[2]
        across = []
        for m, n in plate.numbers.tolist():
            shape = 2.0 / math.sqrt(plate.mass * size_m[0] * size_m[1])
            shape = shape * ngsolve.sin(m * math.pi * (ngsolve.x / size_m[0] + 0.5))
            shape = shape * ngsolve.sin(n * math.pi * (ngsolve.y / size_m[1] + 0.5))
            there = ngsolve.IfPos(top - 0.5, shape, 0.0)
            across.append(
                ngsolve.LinearForm(there * v * ngsolve.ds(bonus_intorder=8)).Assemble().vec.FV().NumPy().copy()
            )
    field = ngsolve.GridFunction(space)
    place = grid(*source_m)
    at_source = np.zeros(space.ndof)
    for number in space.GetDofNrs(ngsolve.ElementId(ngsolve.VOL, place.nr)):
        field.vec[:] = 0.0
        field.vec[number] = 1.0
        at_source[number] = field(place)
    return *matrices, at_source, np.array(across).T


@pytest.fixture(scope="module")
def soft_plate():
    """Thin enough for the air to turn its modes over: its first lies below the air's spring."""
    return SupportedPlate((0.5, 0.4, 0.3), *steel(0.0012), 700.0)


def test_a_cavity_with_one_flexible_wall_is_what_finite_elements_of_the_air_give(soft_plate, conformance):
    from scipy.sparse.linalg import splu

    size, source = soft_plate.size_m, (0.1, 0.05, -0.06)
    interior = box_interior(size, soft_plate.outward, soft_plate.bending_rad_m, 4.0 * soft_plate.bending_rad_m)
    cavity = box_cavity(interior, 700.0, source, SOUND_SPEED, DENSITY, kept=3.0)
    walls = WallModes(soft_plate.frequency_hz, 0.02)
    stiffness, mass, at_source, across = air_by_finite_elements(size, source, soft_plate)
    worst = 0.0
    for frequency in (40.0, 120.0, 343.0, 425.0, 510.0, 640.0):
        omega = 2.0 * math.pi * frequency
        air = splu((stiffness - cavity.squared_wave_number(frequency, 0.01) * mass).tocsc().astype(np.complex128))
        held = np.column_stack([4.0 * math.pi * at_source, -1j * omega * DENSITY * across]).astype(np.complex128)
        pressures = across.T @ air.solve(held)
        expected = np.linalg.solve(np.diag(walls.impedance(frequency)) - pressures[:, 1:], pressures[:, 0])
        found = coupled_velocities(cavity, walls, frequency, 0.01)
        worst = max(worst, np.abs(found - expected).max() / np.abs(expected).max())
    conformance(
        "modal velocities of a plate before a cavity, worst",
        0.0,
        worst,
        2e-3,
        "1",
        "program: NGSolve, air by finite elements",
    )


def test_the_air_moves_the_plates_resonances(soft_plate):
    """The first mode of the soft plate sweeps volume and is stiffened by the air; one that sweeps none gets heavier."""
    size = soft_plate.size_m
    interior = box_interior(size, soft_plate.outward, soft_plate.bending_rad_m, 4.0 * soft_plate.bending_rad_m)
    cavity = box_cavity(interior, 700.0, (0.1, 0.05, -0.06), SOUND_SPEED, DENSITY)
    walls = WallModes(soft_plate.frequency_hz, 0.005)
    moved = {}
    for mode in (0, 1):
        assert tuple(soft_plate.numbers[mode]) == ((1, 1), (2, 1))[mode]
        natural = soft_plate.frequency_hz[mode]
        force = np.eye(len(walls.frequency_hz))[mode]
        frequencies = np.arange(0.7, 1.6, 0.002) * natural
        answers = [abs(coupled_velocities(cavity, walls, f, 0.001, 0.0, force)[mode]) for f in frequencies]
        moved[mode] = frequencies[int(np.argmax(answers))] / natural
    swept = 4.0 / math.pi**2 * 2.0 * math.sqrt(size[0] * size[1] / soft_plate.mass)
    spring = DENSITY * SOUND_SPEED**2 / math.prod(size) * swept**2
    alone = math.sqrt(1.0 + spring / (2.0 * math.pi * soft_plate.frequency_hz[0]) ** 2)
    assert moved[0] == pytest.approx(alone, rel=0.02)  # one mode on a spring of air; the others add a little mass
    assert 0.9 < moved[1] < 0.999


@pytest.mark.parametrize(
    ("place", "message"),
    [((0.5, 0.0, 0.0), "is not inside it, 20 mm off the walls"), ((0.0, 0.0, 0.235), r"\|z\| < 0\.23 m")],
)
def test_a_source_must_be_inside(interior, place, message):
    with pytest.raises(CavityError, match=message):
        box_cavity(interior, 1000.0, place, SOUND_SPEED, DENSITY)


def test_functions_that_do_not_reach_are_refused(interior):
    with pytest.raises(CavityError, match="do not reach"):
        box_cavity(interior, 20000.0, SOURCE, SOUND_SPEED, DENSITY)


def test_other_values_are_refused(cavity, plate):
    walls = WallModes(plate.frequency_hz, 0.02)
    with pytest.raises(CavityError, match="are for 0 to 1000 Hz, got 1200"):
        coupled_velocities(cavity, walls, 1200.0, 0.01)
    with pytest.raises(CavityError, match="loss factor of a cavity must be 0 to 1, got 2"):
        coupled_velocities(cavity, walls, 200.0, 2.0)
    with pytest.raises(CavityError, match="loss factor of walls must be 0 to 1"):
        WallModes(plate.frequency_hz, -0.1)
    with pytest.raises(CavityError, match=r"coupled with .* wall modes, the walls have 3"):
        coupled_velocities(cavity, WallModes(plate.frequency_hz[:3], 0.02), 200.0, 0.01)
    with pytest.raises(CavityError, match=r"source of 2 cavity modes and 1 wall modes must have the shape \(2,\)"):
        CavityModes(
            1.0, 343.0, 1.2, 100.0, np.zeros(2), np.zeros((2, 1)), np.zeros((0, 1, 1)), np.zeros(3), np.zeros((0, 1))
        )
    with pytest.raises(CavityError, match="volume_m3 of a cavity must be > 0"):
        CavityModes(
            0.0, 343.0, 1.2, 100.0, np.zeros(1), np.zeros((1, 1)), np.zeros((0, 1, 1)), np.zeros(1), np.zeros((0, 1))
        )
    assert IMPEDANCE > 0.0
