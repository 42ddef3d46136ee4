"""The eight equations in exudyn, a multibody program of its own, against the time integration and the balance.

The model's matrices, its mesh force and its contact lines are written here from the printed equations (physics.md
section 2); nothing but the numbers of a `GearSystem` is used, and exudyn integrates all eight coordinates, the rigid
rotation among them.
"""

import functools
import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from reference_drive import RATED_TORQUE_N_M, reference_system

from tdacoustic.gears import bearing_forces, steady_state
from tdacoustic.gears.integration import integrate, static_state

exu = pytest.importorskip("exudyn", reason="exudyn is not installed (pip install exudyn)")

SOURCE = "program: Exudyn, equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
CONDITION_3_HZ, CONDITION_5_HZ = 349.94, 524.90
IN_CONTACT = 1e-4
"""Of the peak to peak, or of the largest line: both programs have errors below 1e-5 at these steps."""
SEPARATING = 1e-3
"""Teeth part and meet between two steps, so that errors fall with the second power of the step only and are passed on
by each impact: both programs have about 1e-4 here."""


class Model:
    """The printed equations of a drive at one mesh frequency and torque."""

    def __init__(self, system, mesh_hz, torque_n_m):
        sine, cosine = math.sin(system.pressure_angle_rad), math.cos(system.pressure_angle_rad)
        cos_b, sin_b = math.cos(system.base_helix_angle_rad), math.sin(system.base_helix_angle_rad)
        (r1, r2), (j1, j2), (m1, m2) = system.base_radii_m, system.inertias_kg_m2, system.masses_kg
        kx1, ky1, kz1, kx2, ky2, kz2 = system.bearing_stiffness_n_per_m
        cx1, cy1, cz1, cx2, cy2, cz2 = system.bearing_damping_n_s_per_m
        self.direction = np.array(
            [cos_b * sine, cos_b * cosine, sin_b, r1 * cos_b, -cos_b * sine, -cos_b * cosine, -sin_b, r2 * cos_b]
        )
        self.mass = np.diag([m1, m1, m1, j1, m2, m2, m2, j2])
        self.stiffness = np.diag([kx1, ky1, kz1, 0.0, kx2, ky2, kz2, 0.0])
        self.damping = np.diag([cx1, cy1, cz1, 0.0, cx2, cy2, cz2, 0.0])
        self.torques = np.array([0.0, 0.0, 0.0, torque_n_m, 0.0, 0.0, 0.0, torque_n_m * r2 / r1])
        self.radii = r1, r2
        self.mesh_hz = mesh_hz
        self.mean_stiffness = system.mesh_stiffness_n_per_m
        self.mesh_damping = 2.0 * system.mesh_damping_ratio * math.sqrt(self.mean_stiffness / (r1**2 / j1 + r2**2 / j2))
        self.damps_apart = system.mesh_damping == "always"
        self.half_backlash = system.half_backlash_m
        self.errors = system.transmission_error_m
        lines = system.contact_lines
        self.short, self.long = sorted((lines.transverse_contact_ratio, lines.overlap_ratio))

    def mesh_stiffness(self, turns):
        """k_m at a time in mesh periods: the trapezoids of all pairs in contact (equations (5) and (6))."""
        whole, total = self.short + self.long, 0.0
        since = turns - math.floor(turns)
        while since < whole:
            total += min(1.0, since / self.short, (whole - since) / self.short)
            since += 1.0
        return self.mean_stiffness * total / self.long

    def mesh_force(self, time, coordinates, velocities):
        delta = sum(v * q for v, q in zip(self.direction, coordinates, strict=True))
        speed = sum(v * q for v, q in zip(self.direction, velocities, strict=True))
        turns = self.mesh_hz * time
        error = sum(size * math.sin(2.0 * math.pi * k * turns) for k, size in enumerate(self.errors, 1))
        beyond = max(delta - error - self.half_backlash, 0.0) + min(delta - error + self.half_backlash, 0.0)
        force = self.mesh_stiffness(turns) * beyond if beyond != 0.0 else 0.0
        return force + self.mesh_damping * speed if beyond != 0.0 or self.damps_apart else force

    def all_coordinates(self, state):
        """The eight coordinates of seven: p = r1 θ1 + r2 θ2, divided evenly."""
        (r1, r2), values = self.radii, list(state)
        return [*values[:3], 0.5 * values[6] / r1, *values[3:6], 0.5 * values[6] / r2]

    def solve(self, state, periods, steps, method="RK44", keep=1):
        """Return (time, coordinates, velocities) at every `keep`-th step from a state of seven coordinates."""
        from exudyn.utilities import NodeGenericODE2, ObjectGenericODE2, SensorNode

        container = exu.SystemContainer()
        mbs = container.AddSystem()
        node = mbs.AddNode(
            NodeGenericODE2(
                referenceCoordinates=[0.0] * 8,
                initialCoordinates=self.all_coordinates(state[:7]),
                initialCoordinates_t=self.all_coordinates(state[7:]),
                numberOfODE2Coordinates=8,
            )
        )

        def force_of_the_mesh(mbs, t, itemNumber, q, q_t):
            force = self.mesh_force(t, q, q_t)
            return [-v * force for v in self.direction.tolist()]

        mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=[node],
                massMatrix=self.mass,
                stiffnessMatrix=self.stiffness,
                dampingMatrix=self.damping,
                forceVector=self.torques,
                forceUserFunction=force_of_the_mesh,
            )
        )
        kinds = (exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t)
        sensors = [
            mbs.AddSensor(SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)) for kind in kinds
        ]
        mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = periods * steps
        settings.timeIntegration.endTime = periods / self.mesh_hz
        settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
        settings.timeIntegration.newton.relativeTolerance = 1e-10
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = keep / (self.mesh_hz * steps)
        mbs.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, method))
        coordinates, velocities = (mbs.GetSensorStoredData(sensor) for sensor in sensors)
        assert coordinates.shape == (periods * steps // keep + 1, 9)
        return coordinates[:, 0], coordinates[:, 1:], velocities[:, 1:]

    def bearing_forces(self, coordinates, velocities):
        """K x + C x' without the rotations, shape (times, 6)."""
        forces = coordinates @ self.stiffness + velocities @ self.damping
        return forces[:, [0, 1, 2, 4, 5, 6]]


def bearings_of_states(system, states):
    """The same from the package's states of seven coordinates."""
    states = np.array(states)
    return states[:, :6] * system.bearing_stiffness_n_per_m + states[:, 7:13] * system.bearing_damping_n_s_per_m


def largest(differences):
    return float(np.abs(differences).max())


@dataclass(frozen=True)
class Case:
    """A drive, a speed and a load; `ours` and `theirs` are how much finer than the package's default the steps are."""

    mesh_hz: float
    torque_n_m: float
    tolerance: float = IN_CONTACT
    method: str = "RK44"
    ours: int = 1
    theirs: int = 2
    periods: int = 12
    changes: dict = field(default_factory=dict)

    @property
    def separates(self):
        return self.tolerance == SEPARATING

    def system(self):
        return reference_system(**self.changes)


COAST = {"helix_angle_deg": 12.0, "transmission_error_m": (5e-6, 2e-6)}
TRANSIENTS = {
    "condition 3": Case(CONDITION_3_HZ, RATED_TORQUE_N_M),
    "condition 5": Case(CONDITION_5_HZ, RATED_TORQUE_N_M),
    "condition 5, implicit": Case(CONDITION_5_HZ, RATED_TORQUE_N_M, method="GeneralizedAlpha", theirs=12),
    "coast, 12 degrees, two sines": Case(CONDITION_5_HZ, -RATED_TORQUE_N_M, changes=COAST),
    "200 N m, separating": Case(CONDITION_5_HZ, 200.0, SEPARATING, ours=2, theirs=4),
    # The force jumps by c_m times the speed as teeth part, so that the error falls with the first power of the step,
    # and this motion multiplies it by 1000 in twelve periods.
    "200 N m, separating, damping in contact": Case(
        CONDITION_5_HZ, 200.0, SEPARATING, ours=16, theirs=32, periods=3, changes={"mesh_damping": "contact"}
    ),
}


@pytest.mark.parametrize("name", TRANSIENTS)
def test_transient_from_rest(conformance, name):
    """From the static deflection; exudyn's steps are a whole number of times finer."""
    case = TRANSIENTS[name]
    system = case.system()
    model, start = Model(system, case.mesh_hz, case.torque_n_m), static_state(system, case.torque_n_m)
    default = integrate(system, case.mesh_hz, case.torque_n_m, 1).displacement_m.size
    steps = case.ours * default
    ours = integrate(system, case.mesh_hz, case.torque_n_m, case.periods, start, steps)
    every = case.theirs // case.ours
    time, coordinates, velocities = model.solve(start, case.periods, case.theirs * default, case.method, every)

    delta = coordinates[:-1] @ model.direction
    off = largest(ours.displacement_m.ravel() - delta) / np.ptp(delta)
    conformance(f"DTE from rest, {name}", 0.0, off, case.tolerance, "of the swing", SOURCE)

    rows = zip(time[:-1], coordinates[:-1].tolist(), velocities[:-1].tolist(), strict=True)
    force = np.array([model.mesh_force(*row) for row in rows])
    if model.damps_apart:  # else it jumps, and a sample may lie on either side of the jump
        off = largest(ours.force_n.ravel() - force) / np.ptp(force)
        conformance(f"mesh force from rest, {name}", 0.0, off, case.tolerance, "of the swing", SOURCE)

    states = [start]
    for _ in range(case.periods):
        states.append(integrate(system, case.mesh_hz, case.torque_n_m, 1, states[-1], steps).state)
    bearings = model.bearing_forces(coordinates, velocities)
    off = largest(bearings_of_states(system, states) - bearings[::steps]) / np.ptp(bearings, axis=0).max()
    conformance(f"bearing forces from rest, {name}", 0.0, off, case.tolerance, "of the largest swing", SOURCE)

    error = system.transmission_error_at(np.arange(delta.size) / steps)
    assert (np.abs(delta - error) < system.half_backlash_m).any() == case.separates


STEADY = {
    "condition 3": Case(CONDITION_3_HZ, RATED_TORQUE_N_M),
    "condition 5": Case(CONDITION_5_HZ, RATED_TORQUE_N_M),
    "coast, 12 degrees, two sines": Case(CONDITION_5_HZ, -RATED_TORQUE_N_M, changes=COAST),
    "200 N m, separating": Case(CONDITION_5_HZ, 200.0, SEPARATING),
}
STEADY_STEPS, STEADY_PERIODS = 512, 200


@functools.cache
def settled(name):
    """The last of 200 mesh periods from rest in exudyn: system, δ, bearing forces, and how much δ still changes."""
    case = STEADY[name]
    system, steps = case.system(), STEADY_STEPS
    model, start = Model(system, case.mesh_hz, case.torque_n_m), static_state(system, case.torque_n_m)
    _, coordinates, velocities = model.solve(start, STEADY_PERIODS, steps)
    last, before = slice(-steps - 1, -1), slice(-2 * steps - 1, -steps - 1)
    delta = coordinates @ model.direction
    change = largest(delta[last] - delta[before]) / np.ptp(delta[last])
    return system, delta[last], model.bearing_forces(coordinates, velocities)[last], change


@pytest.mark.parametrize("name", STEADY)
def test_steady_state(conformance, name):
    """The harmonic balance against what exudyn settles to from rest."""
    case = STEADY[name]
    system, delta, bearings, change = settled(name)
    assert change < 0.1 * case.tolerance
    state = steady_state(system, case.mesh_hz, case.torque_n_m)
    assert state.method == "harmonic_balance"
    assert state.separates == case.separates

    finer = 16.0 * np.fft.irfft(np.fft.rfft(delta), 16 * delta.size)
    swing = float(np.ptp(finer))
    micrometres = 1e6 * swing, 1e6 * state.dte_pp_m, 1e6 * case.tolerance * swing
    conformance(f"DTE peak to peak, {name}", *micrometres, "um", SOURCE)
    off = largest(state.waveform_m[0] - finer[:: finer.size // state.waveform_m.shape[1]]) / swing
    conformance(f"DTE over a period, {name}", 0.0, off, case.tolerance, "of the peak to peak", SOURCE)

    ours, harmonics = bearing_forces(system, state), 20
    series = np.fft.rfft(bearings, axis=0, norm="forward")
    lines = 2.0 * series[1 : harmonics + 1].T.reshape(2, 3, harmonics)
    off = largest(ours.amplitude_n[..., :harmonics] - lines) / largest(lines)
    conformance(f"bearing force lines, {name}", 0.0, off, case.tolerance, "of the largest", SOURCE)
    off = largest(ours.mean_n.ravel() - series[0].real) / largest(lines)
    conformance(f"mean bearing forces, {name}", 0.0, off, case.tolerance, "of the largest line", SOURCE)


def test_the_comparison_can_fail():
    """A pressure angle 0.1 degrees off, which the ratio of the x to the y forces shows, is out of the band by far."""
    system, _, bearings, _ = settled("condition 5")
    other = replace(system, pressure_angle_rad=system.pressure_angle_rad + math.radians(0.1))
    ours = bearing_forces(other, steady_state(other, CONDITION_5_HZ, RATED_TORQUE_N_M))
    lines = 2.0 * np.fft.rfft(bearings, axis=0, norm="forward")[1:6].T.reshape(2, 3, 5)
    assert largest(ours.amplitude_n[..., :5] - lines) > 5.0 * IN_CONTACT * largest(lines)
