"""The insertion loss of a housing: what it takes from a source inside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.cavity import boundary_layer_loss_factor, field_incidence_db
from tdacoustic.drive.gear_unit import gear_unit_of
from tdacoustic.drive.source_inside import HousingCavity, SourceInside, cavity_task
from tdacoustic.fleet import Fleet
from tdacoustic.gears.masuda import SPHERE_OF_1_M_DB
from tdacoustic.housing import Box, HousingModes
from tdacoustic.radiation import mean_over_sphere_db
from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.radiation.received import MeanVectors
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress

if TYPE_CHECKING:
    from tdacoustic.drive.housing_steps import HousingTasks
    from tdacoustic.drive.prediction import GearState

__all__ = [
    "INSERTION_LOSS",
    "AirLosses",
    "InsertionLoss",
    "MeshLoss",
    "air_tasks",
    "insertion_loss_task",
    "lines_a_band",
    "loss_db",
    "with_conditions",
]

Real = NDArray[np.float64]
Point = tuple[float, float, float]

LOWEST_HZ: Final = 50.0
LINES_A_WIDTH: Final = 2.0
"""Lines within the half-power width η f of the sharpest resonance, η the smaller loss factor of walls and air. Their
sum misses a resonance's energy by 2 exp(-2π) = 0.4 % at most; with one line it would be 9 %."""

LEAST_A_BAND: Final = 16
MOST_LINES: Final = 5000
"""Cap on the lines of an insertion loss: ten seconds of the reference housing's to 1.5 kHz. To 3 kHz it is reached
below a loss factor of 0.0017."""

_BAND: Final = 0.1 * math.log(10.0)
"""Width of a third octave on the axis of ln f."""

ASIDE_M: Final = 0.05
"""How far the source is moved to see what its place does."""


@dataclass(frozen=True)
class MeshLoss:
    """The insertion loss at a condition's mesh frequency.

    Parameters
    ----------
    condition : str
    frequency_hz : float
    loss_db : float or None
        None beyond the housing's frequencies, as of the others.
    mass_law_db : float
    of_air_db : (float, float) or None
        With half and with twice the loss factor of the air inside.
    beside_db : (float, float) or None
        Lowest and highest with the source there and `ASIDE_M` off along x, y, z.
    """

    condition: str
    frequency_hz: float
    loss_db: float | None
    mass_law_db: float
    of_air_db: tuple[float, float] | None = None
    beside_db: tuple[float, float] | None = None


@dataclass(frozen=True)
class AirLosses:
    """What the loss factor of the air inside means at a frequency.

    Parameters
    ----------
    loss_factor : float
    frequency_hz : float
    bare_walls : float
        The loss factor by viscosity and heat conduction at the bare walls alone.
    absorption : float
        Absorption coefficient of the walls that would give the loss factor: 4 ω V η / (c S), of a diffuse field.
    """

    loss_factor: float
    frequency_hz: float
    bare_walls: float
    absorption: float


@dataclass(frozen=True)
class InsertionLoss:
    """Sound power level of a source in free field less that which the housing radiates with the source inside.

    Parameters
    ----------
    source_m : (float, float, float)
        In the drive frame.
    walls : tuple of (float, float)
        Area in m² and mass in kg/m² of each pair of walls.
    impedance_pa_s_m : float
    air : AirLosses
    frequency_hz, loss_db, mass_law_db : ndarray, shape (n,)
        Over lines equally far apart on a logarithmic axis; the transmission loss of limp walls by the mass law of field
        incidence beside it.
    band_hz, band_db : ndarray, shape (bands,)
        Third octaves by their exact middles, and their means: of the radiated energy of equally strong lines.
    at_mesh : tuple of MeshLoss
        At the conditions' mesh frequencies.
    lines_a_width : float
        Lines within the half-power width of the sharpest resonance. Below `LINES_A_WIDTH` their count was capped at
        `MOST_LINES`, and the means of the bands are rough.
    """

    source_m: Point
    walls: tuple[tuple[float, float], ...]
    impedance_pa_s_m: float
    air: AirLosses
    frequency_hz: Real
    loss_db: Real
    mass_law_db: Real
    band_hz: Real
    band_db: Real
    at_mesh: tuple[MeshLoss, ...] = ()
    lines_a_width: float = LINES_A_WIDTH


@dataclass(frozen=True)
class InsertionSettings:
    """What an insertion loss depends on besides modes, air and means over the surface.

    Parameters
    ----------
    box : Box
    position_m : (float, float, float)
    impedance_pa_s_m : float
    loss_factor, cavity_loss_factor : float
    surface_db : float
        Mean level over the surface of the means less the sound power level.
    highest_hz : float
    """

    box: Box
    position_m: Point
    impedance_pa_s_m: float
    loss_factor: float
    cavity_loss_factor: float
    surface_db: float
    highest_hz: float


def loss_db(mean_square_pa2: float, surface_db: float) -> float:
    """Return the insertion loss from the mean of |p|² over a surface, of a source of 1 Pa at 1 m in free space.

    Parameters
    ----------
    mean_square_pa2 : float
    surface_db : float
        Mean level over that surface less the sound power level (`mean_over_sphere_db`).
    """
    return SPHERE_OF_1_M_DB + surface_db - 10.0 * math.log10(max(mean_square_pa2, 1e-30))


def _insertion_loss(
    settings: InsertionSettings, modes: HousingModes, mean: MeanVectors, cavity: HousingCavity
) -> InsertionLoss:
    inside = SourceInside(cavity, modes.frequency_hz, settings.position_m)
    least = min(settings.loss_factor, settings.cavity_loss_factor)
    a_band = lines_a_band(least, settings.highest_hz)
    numbers, frequencies = _axis(a_band, settings.highest_hz)
    found = np.empty(len(frequencies))
    for number, frequency in enumerate(frequencies.tolist()):
        moved = inside.velocities(frequency, settings.loss_factor, settings.cavity_loss_factor)
        found[number] = loss_db(mean.of_modes(frequency, moved), settings.surface_db)
        if number % a_band == 0:
            tell_progress(number / len(frequencies))
    walls = _walls(settings.box)
    mass_law = field_incidence_db(frequencies, walls, settings.impedance_pa_s_m)
    bands = _third_octaves(numbers, found, a_band)
    air = _air_losses(cavity, settings.cavity_loss_factor)
    lines = frequencies, found, mass_law, *bands
    width = least * a_band / _BAND
    return InsertionLoss(inside.source_m, walls, settings.impedance_pa_s_m, air, *lines, lines_a_width=width)


INSERTION_LOSS: Final = Step("insertion-loss", 2, _insertion_loss, "Insertion loss of the housing over frequency")


def _air_losses(cavity: HousingCavity, loss_factor: float, frequency_hz: float = 500.0) -> AirLosses:
    surface, volume = cavity.interior.surface_m2, cavity.interior.volume_m3
    bare = boundary_layer_loss_factor(frequency_hz, surface, volume)
    absorption = 8.0 * math.pi * frequency_hz * volume * loss_factor / (cavity.modes.sound_speed_m_s * surface)
    return AirLosses(loss_factor, frequency_hz, bare, absorption)


def _walls(box: Box) -> tuple[tuple[float, float], ...]:
    """Area and mass per area of the three pairs of walls, seats left out."""
    found = []
    for normal, panel in enumerate(box.thickness_m):
        first, second = (size for axis, size in enumerate(box.extent_m) if axis != normal)
        found.append((2.0 * first * second, box.density_kg_m3 * panel))
    return tuple(found)


def lines_a_band(loss_factor: float, highest_hz: float) -> int:
    """Return how many lines each third octave takes for `LINES_A_WIDTH`, `MOST_LINES` in all at most.

    Parameters
    ----------
    loss_factor : float
        The smallest of walls and air.
    highest_hz : float

    Examples
    --------
    Up to 3 kHz with the reference housing's 0.01 of the air, with 0.002, and with less than the cap allows:

    >>> lines_a_band(0.01, 3000.0), lines_a_band(0.002, 3000.0), lines_a_band(0.0005, 3000.0)
    (47, 231, 281)
    """
    bands = 10.0 * math.log10(max(highest_hz / LOWEST_HZ, 10.0**0.1))
    most = max(math.floor(MOST_LINES / bands), LEAST_A_BAND)
    wanted = LINES_A_WIDTH * _BAND / max(loss_factor, 1e-6)
    return max(LEAST_A_BAND, min(math.ceil(wanted), most))


def _axis(a_band: int, highest_hz: float) -> tuple[NDArray[np.int64], Real]:
    """Numbers and frequencies of lines that stand in the middles of equal parts of third octaves.

    Line n is in the band of number n // a_band, whose exact middle is 10^(band/10) Hz (base ten, IEC 61260-1).
    """
    first, last = (a_band * (10.0 * math.log10(end) + 0.5) - 0.5 for end in (LOWEST_HZ, highest_hz))
    numbers = np.arange(math.ceil(first - 1e-9), math.floor(last + 1e-9) + 1)
    return numbers, np.asarray(10.0 ** (0.1 * ((numbers + 0.5) / a_band - 0.5)))


def _third_octaves(numbers: NDArray[np.int64], lines_db: Real, a_band: int) -> tuple[Real, Real]:
    """Exact middles and means of the bands that the lines fill."""
    bands, counts = np.unique(numbers // a_band, return_counts=True)
    full = bands[counts == a_band]
    means = [-10.0 * math.log10(float(np.mean(10.0 ** (-0.1 * lines_db[numbers // a_band == band])))) for band in full]
    return np.asarray(10.0 ** (0.1 * full)), np.array(means)


def insertion_loss_task(fleet: Fleet, box: Box, body: BodyInAir, modes: Task, mean: Task, cavity: Task) -> Task:
    """Return the task of a fleet's insertion loss.

    Parameters
    ----------
    fleet : Fleet
    box : Box
        With the fleet's own loss factor.
    body : BodyInAir
    modes, mean, cavity : Task
        Of the housing, of the means over the surface, of the air inside.
    """
    settings = InsertionSettings(
        replace(box, loss_factor=0.02),
        body.position_m,
        body.impedance_pa_s_m,
        fleet.number("housing.loss_factor"),
        fleet.number("housing.cavity_loss_factor"),
        mean_over_sphere_db(fleet.radiation.sphere_radius_m.value, fleet.radiation.space.value),
        fleet.radiation.max_frequency_hz.value,
    )
    label = f"{LOWEST_HZ:g} to {settings.highest_hz:g} Hz"
    return INSERTION_LOSS.task(label, settings, modes=modes, mean=mean, cavity=cavity)


def air_tasks(fleet: Fleet, tasks: HousingTasks) -> tuple[Task, ...]:
    """Return the tasks of the air inside a fleet's housing and of its insertion loss; none without such air.

    Parameters
    ----------
    fleet : Fleet
    tasks : HousingTasks

    Raises
    ------
    FleetError
        As `cavity_task`.
    """
    cavity = cavity_task(fleet, gear_unit_of(fleet), tasks.box, tasks.body, tasks.modes)
    if cavity is None or not isinstance(tasks.box, Box):
        return ()
    return cavity, insertion_loss_task(fleet, tasks.box, tasks.body, tasks.modes, tasks.mean, cavity)


def with_conditions(
    held: InsertionLoss,
    states: Sequence[GearState],
    inside: SourceInside,
    mean: MeanVectors,
    surface_db: float,
    loss_factors: tuple[float, float],
) -> InsertionLoss:
    """Return an insertion loss with those at the conditions' mesh frequencies, and what they depend on.

    Parameters
    ----------
    held : InsertionLoss
    states : sequence of GearState
    inside : SourceInside
    mean : MeanVectors
    surface_db : float
    loss_factors : (float, float)
        Of the walls and of the air.
    """
    mass_law = field_incidence_db([state.mesh_hz for state in states], held.walls, held.impedance_pa_s_m).tolist()
    places = [inside.moved(tuple(way)) for way in (*(ASIDE_M * np.eye(3)), *(-ASIDE_M * np.eye(3)))]
    beside = [inside, *(place for place in places if place is not None)]
    found = []
    for state, law in zip(states, mass_law, strict=True):
        frequency = state.mesh_hz
        if not mean.frequency_hz[0] <= frequency <= mean.frequency_hz[-1]:
            found.append(MeshLoss(state.condition.name, frequency, None, law))
            continue

        def loss(source: SourceInside, part: float = 1.0, frequency: float = frequency) -> float:
            moved = source.velocities(frequency, loss_factors[0], min(part * loss_factors[1], 1.0))
            return loss_db(mean.of_modes(frequency, moved), surface_db)

        around = [loss(place) for place in beside]
        of_air = loss(inside, 0.5), loss(inside, 2.0)
        found.append(MeshLoss(state.condition.name, frequency, around[0], law, of_air, (min(around), max(around))))
    return replace(held, at_mesh=tuple(found))
