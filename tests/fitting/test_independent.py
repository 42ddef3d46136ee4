"""A calibration solved without the program's fitting: by scipy alone, and on a grid of the two parameters.

The levels are those of the truth of the calibration study (tests/evidence/drive_levels.py) with a fixed scatter. The
plain function asks `tdacoustic.gears` for the motion and takes the rest from that module: no fleet, no level model, no
interpolation, no lmfit.
"""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares
from scipy.stats import norm

import tdacoustic as td
from tdacoustic.drive import Receiver
from tdacoustic.fitting.calibration import calibrate_fleet
from tdacoustic.fitting.free import free_parameter
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.fitting.settings import FitSettings
from tdacoustic.gears import ContactLines, GearSystem, steady_state

TESTS = Path(__file__).resolve().parents[1]
CONSTANT, DAMPING = "masuda.constant_db", "gear_dynamics.mesh_damping_ratio"
SIGMA_DB, MODEL_SIGMA_DB, TOTAL_SIGMA_DB = 0.32, 0.24, 0.4
SCATTER_DB = np.array([0.31, -0.52, 0.18, 0.44, -0.27, 0.36])
NAMES = {CONSTANT: "Masuda constant", DAMPING: "logarithm of the mesh damping ratio"}
UNITS = {CONSTANT: "dB", DAMPING: "1"}
LOW, HIGH = 0.005, 0.5
"""Usual bounds of the damping ratio; the constant's are far off."""


class Problem:
    """Six levels, and the model of them as a plain function."""

    def __init__(self, truth, drive_levels):
        self.truth = truth
        drive = truth.drive()
        pair = drive_levels.geometry(drive.numbers["gear_pair"][0])
        held = drive_levels.gears(drive, pair)
        operation = drive.numbers["operation"]
        self.torque = drive_levels.bare(operation["torque_n_m"])
        diameter = 1e-3 * drive_levels.bare(drive.numbers["train"]["wheel_diameter_mm"])
        speeds = drive_levels.bare(operation["train_speed_km_h"])
        self.turns_hz = [speed / 3.6 / (math.pi * diameter) * pair.ratio for speed in speeds]
        self.teeth = drive_levels.bare(drive.numbers["gear_pair"][0]["teeth"])[0]
        self.held, self.pair, self.masuda_db = held, pair, drive_levels.masuda_db
        self.motor_w = sum(10.0 ** ((line + drive.motor_gain_db) / 10.0) for line in drive.motor_lines_db)
        self.levels_db = np.array(drive_levels.levels_at_4_m_db(drive)) + SCATTER_DB

    def mesh_at_4_m_db(self, damping):
        """Meshing noise in each condition for a constant of 0 dB."""
        held = self.held
        lines = ContactLines(held.contact_lines.transverse_contact_ratio, held.contact_lines.overlap_ratio)
        system = GearSystem(
            tuple(held.masses_kg),
            tuple(held.inertias_kg_m2),
            held.base_radii_m,
            tuple(held.bearing_stiffness_n_per_m),
            tuple(held.bearing_damping_n_s_per_m),
            held.pressure_angle_rad,
            held.base_helix_angle_rad,
            lines,
            held.mesh_stiffness_n_per_m,
            damping,
            held.half_backlash_m,
            tuple(held.transmission_error_m),
            held.mesh_damping,
        )
        found = []
        for turns_hz in self.turns_hz:
            swing_um = 1e6 * steady_state(system, turns_hz * self.teeth, self.torque).dte_pp_m
            omega = 2.0 * math.pi * turns_hz
            at_1_m_db = self.masuda_db(
                self.pair, omega * self.pair.pitch_radius_m, omega * self.torque / 1e3, swing_um, 0.0
            )
            found.append(at_1_m_db - 20.0 * math.log10(4.0))
        return np.array(found)

    def residuals(self, constant_db, mesh_db):
        """Over the standard deviation; of constants of any shape, one row each."""
        motor = self.motor_w / (4.0 * math.pi * 4.0**2)
        mesh = 10.0 ** ((np.asarray(constant_db)[..., None] + mesh_db) / 10.0)
        return (10.0 * np.log10(motor + mesh) - self.levels_db) / TOTAL_SIGMA_DB

    def plain(self, place):
        constant_db, log_damping = place
        return self.residuals(constant_db, self.mesh_at_4_m_db(math.exp(log_damping)))


@pytest.fixture(scope="module")
def problem():
    folders = [str(TESTS / "evidence"), str(TESTS / "gears")]
    sys.path[:0] = folders
    try:
        import calibration_study
        import drive_levels

        yield Problem(calibration_study.Truth.draw(8), drive_levels)
    finally:
        for folder in folders:
            sys.path.remove(folder)


@pytest.fixture(scope="module")
def calibrated(problem, tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(problem.truth.fleet_text((CONSTANT, DAMPING)), encoding="utf-8")
    fleet = td.load_fleet(path)
    place = Receiver("4 m", 4.0)
    data = [
        MeasuredLevel(condition, place, float(level), SIGMA_DB, "Z", "synthetic", "evidence")
        for condition, level in zip(td.DriveModel(fleet).conditions, problem.levels_db, strict=True)
    ]
    free = [free_parameter(fleet, key) for key in (CONSTANT, DAMPING)]
    return calibrate_fleet(fleet, data, free, FitSettings(model_sigma_db=MODEL_SIGMA_DB))


@pytest.fixture(scope="module")
def ours(calibrated):
    """Values, standard errors and intervals; the damping as its logarithm."""
    constant, damping = calibrated.parameters
    return {
        "chi square": calibrated.chi_square,
        CONSTANT: (constant.value, constant.stderr, constant.ci68, constant.ci95),
        DAMPING: (
            math.log(damping.value),
            damping.stderr / damping.value,
            tuple(map(math.log, damping.ci68)),
            tuple(map(math.log, damping.ci95)),
        ),
    }


def test_scipy_alone_finds_the_same(problem, ours, conformance):
    """Minimum and standard errors by its `least_squares`, ends of the intervals by its `brentq` on the profile: the
    tolerances are parts of the standard error and of the distance from the minimum (the program's own end is found to
    0.2 % of it, between levels that are interpolated).
    """
    start = [20.0, math.log(0.05)]
    bounds = ([-100.0, math.log(LOW)], [100.0, math.log(HIGH)])
    close = {"xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12}
    best = least_squares(problem.plain, start, "3-point", bounds, x_scale=[1.0, 0.1], **close)
    errors = np.sqrt(np.diag(np.linalg.inv(best.jac.T @ best.jac)))
    source = "program: scipy.optimize alone, on a plain function of the test"
    conformance("chi square of two parameters", 2.0 * best.cost, ours["chi square"], 0.001, "1", source)

    def profile(index, value):
        def held(place):
            both = [place[0], place[0]]
            both[index] = value
            return problem.plain(both)

        other = 1 - index
        only = ([bounds[0][other]], [bounds[1][other]])
        return 2.0 * least_squares(held, [best.x[other]], "3-point", only, **close).cost

    for index, key in enumerate((CONSTANT, DAMPING)):
        value, stderr, ci68, ci95 = ours[key]
        error = errors[index]
        told = NAMES[key]
        conformance(f"{told}, value", best.x[index], value, 0.003 * error, UNITS[key], source)
        conformance(f"{told}, standard error", error, stderr, 0.005 * error, UNITS[key], source)
        for level, interval in ((0.68, ci68), (0.95, ci95)):
            rise = norm.ppf(0.5 * (1.0 + level)) ** 2
            for sign, end in zip((-1.0, 1.0), interval, strict=True):

                def above(place, index=index, rise=rise):
                    return profile(index, place) - 2.0 * best.cost - rise

                expected = brentq(above, best.x[index], best.x[index] + sign * 6.0 * error, xtol=1e-4 * error)
                which = f"{'lower' if sign < 0.0 else 'upper'} end of {100.0 * level:.0f} %"
                conformance(
                    f"{told}, {which}", expected, end, 0.004 * abs(expected - best.x[index]), UNITS[key], source
                )


def test_a_grid_finds_the_same(problem, ours, conformance):
    """Chi square at 481 x 241 places; minimum and profiles are read from them, with parabolas and straight lines: the
    tolerances are parts of the grid's step.
    """
    constants = np.linspace(ours[CONSTANT][0] - 6.0, ours[CONSTANT][0] + 6.0, 481)
    dampings = np.linspace(math.log(LOW), math.log(HIGH), 241)
    surface = np.array(
        [
            (problem.residuals(constants, problem.mesh_at_4_m_db(math.exp(place))) ** 2).sum(axis=-1)
            for place in dampings
        ]
    )
    source = "independent: chi square on a grid of two parameters"
    profiles = {CONSTANT: (constants, least(surface)), DAMPING: (dampings, least(surface.T))}
    for key, (places, profile) in profiles.items():
        value, _, ci68, ci95 = ours[key]
        step = places[1] - places[0]
        lowest, at = vertex(places, profile)
        conformance(f"{NAMES[key]}, least chi square", lowest, ours["chi square"], 0.001, "1", source)
        conformance(f"{NAMES[key]}, value at it", at, value, 0.1 * step, UNITS[key], source)
        for level, interval in ((0.68, ci68), (0.95, ci95)):
            wanted = lowest + norm.ppf(0.5 * (1.0 + level)) ** 2
            for side, end in zip(("lower", "upper"), interval, strict=True):
                expected = crossing(places, profile, wanted, at, side)
                what = f"{NAMES[key]}, {side} end of {100.0 * level:.0f} %"
                conformance(what, expected, end, 0.15 * step, UNITS[key], source)


def least(surface):
    """The least along the first axis, by a parabola through the lowest place and its neighbours; none at an edge."""
    lowest = surface.argmin(axis=0)
    inside = (lowest > 0) & (lowest < surface.shape[0] - 1)
    held, columns = np.clip(lowest, 1, surface.shape[0] - 2), np.arange(surface.shape[1])
    before, at, after = (surface[held + shift, columns] for shift in (-1, 0, 1))
    return np.where(inside, at - (before - after) ** 2 / (8.0 * (before - 2.0 * at + after)), surface.min(axis=0))


def vertex(places, profile):
    i = int(profile.argmin())
    before, at, after = profile[i - 1 : i + 2]
    bend = before - 2.0 * at + after
    return at - (before - after) ** 2 / (8.0 * bend), places[i] + 0.5 * (before - after) / bend * (
        places[1] - places[0]
    )


def crossing(places, profile, wanted, at, side):
    """The place nearest to the minimum where a straight line between two places reaches the wanted chi square."""
    inside = profile <= wanted
    if side == "upper":
        i = int(np.flatnonzero(~inside & (places > at))[0])
        j = i - 1
    else:
        i = int(np.flatnonzero(~inside & (places < at))[-1])
        j = i + 1
    part = (wanted - profile[j]) / (profile[i] - profile[j])
    return places[j] + part * (places[i] - places[j])
