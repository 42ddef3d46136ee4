"""Random conditions of the reference drive, each solved by the harmonic balance and integrated in time, and compared.

The two ways share the numbers of the drive and nothing else: the integration takes the trapezoids of equations (5) and
(6) and marches seven coordinates, the balance takes their Fourier series and one coordinate.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from reference_drive import reference_system

from tdacoustic.gears import GearSystem, SteadyState, bearing_forces, steady_state
from tdacoustic.gears.harmonic_balance import periodic_solution
from tdacoustic.gears.integration import TimeSolution, integrate, settle
from tdacoustic.gears.steady_state import STABLE, _first_stable

SEED = 20261122
GROUPS = {"all loads": (100.0, 8000.0), "light loads": (100.0, 600.0)}
"""Range of torque in N m. The first is the study; the second has many motions with separation and many without a
period, and shows what happens there."""

MULTIPLIER = 0.98
"""Motions with a larger one are left out: they settle too slowly in time to be compared at these tolerances."""

SAME = 0.02
"""Of the peak to peak: a larger difference is another motion, not an inaccurate one."""

IN_CONTACT, SEPARATING = 1e-4, 1e-3
"""Bounds of the largest difference of δ over its peak to peak, between the balance and the converged integration."""

FINER, FORGOTTEN = 8, 1e-3
"""The converged integration: steps so many times finer than the default, for as long as the largest multiplier needs
to let this part of the default's error remain. Both methods of integration are of second order where stiffness has
kinks and teeth part, so that about 1/64 of that error is left."""

FIGURES = ("balance", "integration", "each_other", "bearing_line")
"""Largest differences of δ over a period over its peak to peak: balance and default integration to the converged one,
and to each other. Then of the main line of the bearing forces, balance to converged, over the largest of the six."""

MODULES = ("system", "contact_lines", "harmonic_balance", "floquet", "integration", "kernels", "steady_state")
MODULES += ("foundation", "mesh_poles")


@dataclass(frozen=True)
class Condition:
    """One draw; what it leaves out is as of the reference drive."""

    group: str
    index: int
    mesh_hz: float
    torque_n_m: float
    mesh_damping_ratio: float
    helix_angle_deg: float
    transmission_error_m: float

    @classmethod
    def draw(cls, group: str, index: int) -> Condition:
        rng = np.random.default_rng([SEED, list(GROUPS).index(group), index])
        low, high = GROUPS[group]
        return cls(
            group,
            index,
            float(rng.uniform(100.0, 1500.0)),
            float(math.exp(rng.uniform(math.log(low), math.log(high))) * rng.choice([-1.0, 1.0])),
            float(rng.uniform(0.02, 0.1)),
            float(rng.uniform(0.1, 12.0)),
            float(rng.uniform(2e-6, 10e-6)),
        )

    def system(self) -> GearSystem:
        return reference_system(
            helix_angle_deg=self.helix_angle_deg,
            mesh_damping_ratio=self.mesh_damping_ratio,
            transmission_error_m=(self.transmission_error_m,),
        )


def row_of(condition: Condition) -> dict[str, Any]:
    """Return the condition, what became of it, and the differences where the two ways were compared."""
    system = condition.system()
    row = {**asdict(condition), **_from_rest(condition, system)}
    state = steady_state(system, condition.mesh_hz, condition.torque_n_m)
    row["multiplier"] = None if math.isnan(state.floquet_max) else state.floquet_max
    row["separates"] = bool(state.separates)
    left_out = _left_out(state)
    if left_out is None:
        settled = _settled_from_beside(condition, system, state)
        differences = _differences(condition, system, state, settled)
        if differences is None:
            left_out = "the integration leaves for another motion"
        else:
            row |= differences
    row["left_out"] = left_out
    return row


def _from_rest(condition: Condition, system: GearSystem) -> dict[str, Any]:
    """What the integration reaches from rest, and whether the balance alone, which never integrates, finds it."""
    mesh_hz, torque = condition.mesh_hz, condition.torque_n_m
    settled = settle(system, mesh_hz, torque)
    delta = settled.displacement_m[0]
    error = system.transmission_error_at(np.arange(delta.size) / delta.size)
    touching = np.abs(delta - error) > system.half_backlash_m
    row = {"from_rest": settled.repeats_after, "from_rest_separates": not bool(touching.all()), "alone": "nothing"}
    judged = _first_stable(system, mesh_hz, system.mean_force_n(torque), None)
    if judged is not None and judged[1] <= STABLE:
        swing = float(np.ptp(delta))
        row["alone"] = "the same" if abs(judged[0].dte_pp_m - swing) <= SAME * swing else "another"
    return row


def _left_out(state: SteadyState) -> str | None:
    if state.method == "time_integration":
        if state.repeats_after is None:
            return "the motion does not repeat"
        if state.repeats_after > 1:
            return "the motion repeats after several mesh periods"
        return "found by the integration only"
    return "largest multiplier 0.98 or more" if state.floquet_max >= MULTIPLIER else None


def _settled_from_beside(condition: Condition, system: GearSystem, state: SteadyState) -> TimeSolution:
    """Integrate from a state 0.1 % beside the balance's, each coordinate by a draw of its own."""
    rng = np.random.default_rng([SEED, len(GROUPS), condition.index])
    start = state.state * (1.0 + 1e-3 * rng.standard_normal(state.state.size))
    return settle(system, condition.mesh_hz, condition.torque_n_m, start)


def _differences(
    condition: Condition, system: GearSystem, state: SteadyState, settled: TimeSolution
) -> dict[str, float] | None:
    """Return the differences of three motions that are the same one: balance, integration, one with finer steps."""
    if settled.repeats_after != 1:
        return None
    mesh_hz, torque = condition.mesh_hz, condition.torque_n_m
    delta = settled.displacement_m[0]
    start = np.fft.rfft(state.waveform_m[0], norm="forward") if state.separates else None
    solution = periodic_solution(system, mesh_hz, system.mean_force_n(torque), start)
    assert solution is not None
    at_steps = math.ceil(2 * solution.displacement_m.size / delta.size)
    balanced = solution.displacement_at(at_steps * delta.size)[::at_steps]
    swing = float(np.ptp(delta))
    if np.abs(balanced - delta).max() > SAME * swing:
        return None
    periods = max(4, math.ceil(math.log(FORGOTTEN) / math.log(state.floquet_max)))
    steps = FINER * delta.size
    fine = integrate(system, mesh_hz, torque, 1, settled.state, steps)
    for _ in range(periods):
        fine = integrate(system, mesh_hz, torque, 1, fine.state, steps)
    converged = fine.displacement_m[0, ::FINER]
    forces = bearing_forces(system, state).amplitude_n.reshape(6, -1)
    main = int(np.abs(forces).max(axis=0).argmax())
    off = np.abs(forces[:, main] - _bearing_line(system, fine, main + 1)).max() / np.abs(forces[:, main]).max()
    return {
        "harmonics": solution.n_harmonics,
        "balance": float(np.abs(balanced - converged).max()) / swing,
        "integration": float(np.abs(delta - converged).max()) / swing,
        "each_other": float(np.abs(balanced - delta).max()) / swing,
        "bearing_line": float(off),
    }


def _bearing_line(system: GearSystem, settled: TimeSolution, harmonic: int) -> np.ndarray:
    """Bearing forces at a mesh harmonic from the integrated mesh force, each bearing an oscillator of its own."""
    line = 2.0 * np.fft.rfft(settled.force_n[0], norm="forward")[harmonic]
    omega = 2.0 * np.pi * settled.mesh_hz * harmonic
    spring = np.array(system.bearing_stiffness_n_per_m) + 1j * omega * np.array(system.bearing_damping_n_s_per_m)
    sine, cosine = math.sin(system.pressure_angle_rad), math.cos(system.pressure_angle_rad)
    cos_b, sin_b = math.cos(system.base_helix_angle_rad), math.sin(system.base_helix_angle_rad)
    pinion = np.array([cos_b * sine, cos_b * cosine, sin_b])
    towards = np.concatenate([pinion, -pinion])
    return -towards * line * spring / (spring - omega**2 * np.repeat(system.masses_kg, 3))


def scores(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return counts, percentiles of the differences, and how often the balance found a motion alone."""
    compared = [row for row in rows if row["left_out"] is None]
    left_out = Counter(row["left_out"] for row in rows if row["left_out"] is not None)
    return {
        "conditions": len(rows),
        "in_contact": _spread([row for row in compared if not row["separates"]]),
        "with_separation": _spread([row for row in compared if row["separates"]]),
        "left_out": {"n": sum(left_out.values()), "part": sum(left_out.values()) / len(rows), **dict(left_out)},
        "balance_alone": _alone([row for row in rows if row["from_rest"] == 1 and row["from_rest_separates"]]),
    }


def _spread(rows: list[dict[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {"n": len(rows)}
    for name in FIGURES:
        values = [row[name] for row in rows]
        if values:
            p50, p90, p99 = (float(value) for value in np.percentile(values, (50, 90, 99)))
            found[name] = {"p50": p50, "p90": p90, "p99": p99, "max": max(values)}
    if rows:
        found["worst"] = max(rows, key=lambda row: row["balance"])
    return found


def _alone(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of motions with separation that the integration reaches from rest: what the balance finds without it."""
    counts = Counter(row["alone"] for row in rows)
    return {"n": len(rows), **{name.replace(" ", "_"): counts[name] for name in ("the same", "another", "nothing")}}


def sources() -> str:
    """Return the SHA-256 of the modules that the study rests on; the ends of lines do not count."""
    import tdacoustic.gears

    folder = Path(tdacoustic.gears.__file__).parent
    held = hashlib.sha256()
    for name in MODULES:
        text = (folder / f"{name}.py").read_text(encoding="utf-8")  # universal newlines: CRLF is read as LF
        held.update(f"{name}\n{text}\n".encode())
    return held.hexdigest()
