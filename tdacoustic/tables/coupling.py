"""Rows of ``coupling.csv`` and ``coupling_conditions.csv``.

In the first ``..._force_..._db`` are amplitudes of bearing forces in dB re 1 N per um of transmission error, both peak;
in the second ``..._spl_4m_..._db`` are levels re 20 uPa.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tdacoustic.drive.coupling import COUPLINGS, CoupledCondition, Coupling, CouplingCurves
from tdacoustic.gears import DIRECTIONS, GEARS
from tdacoustic.tables.frames import Row

__all__ = ["coupled_condition_rows", "coupling_rows"]


def coupling_rows(curves: CouplingCurves) -> Iterator[Row]:
    """Yield one row a frequency; bearing forces in dB re 1 N per um of transmission error, teeth in contact."""
    forces = curves.bearing_force_n_per_um
    forces_db = 20.0 * np.log10(np.where(forces > 0.0, forces, math.nan))  # spur gears have none along their shafts
    for number, frequency in enumerate(curves.frequency_hz.tolist()):
        line = curves.lines[number]
        row: Row = {"frequency_hz": frequency}
        if line is not None:
            row |= {"condition": line[0], "harmonic": float(line[1])}
        for kind, coupling in enumerate(COUPLINGS):
            row[f"receptance_{coupling}_m_per_n"] = float(curves.receptance_m_per_n[kind, number])
            row[f"mesh_force_{coupling}_n_per_um"] = float(curves.mesh_force_n_per_um[kind, number])
            for g, gear in enumerate(GEARS):
                for d, direction in enumerate(DIRECTIONS):
                    row[f"{gear}_{direction}_force_{coupling}_db"] = _known(forces_db[kind, g, d, number])
        yield row


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def coupled_condition_rows(coupling: Coupling) -> Iterator[Row]:
    """Yield one row a condition, with either coupling."""
    yield from (_condition_row(coupling, held) for held in coupling.conditions)


def _condition_row(coupling: Coupling, held: CoupledCondition) -> Row:
    row: Row = {"condition": held.condition, "mesh_frequency_hz": held.mesh_hz, "coupling": coupling.used}
    for kind, name in enumerate(COUPLINGS):
        dte = held.dte_pp_m[kind]
        row[f"dte_pp_{name}_um"] = None if dte is None else 1e6 * dte
        row[f"floquet_max_{name}"] = held.floquet_max[kind]
        row[f"in_contact_{name}"] = held.in_contact[kind]
        row[f"structure_spl_4m_{name}_db"] = held.structure_db[kind]
        row[f"mesh_spl_4m_{name}_db"] = held.mesh_db[kind]
        row[f"spl_4m_{name}_db"] = held.total_db[kind]
    return row
