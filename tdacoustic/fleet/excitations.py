"""What is expected to shake a drive at a motor speed (physics.md sections 1, 5 and 7)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

from tdacoustic.fleet.motor import Motor

__all__ = ["Excitation", "ExcitationKind", "mesh_excitations", "motor_excitations", "shaft_excitations"]

ExcitationKind = Literal["mesh", "motor", "inverter", "wheelset"]
"""Families; inverter and motor excitations count as the motor's, mesh as the gearbox's."""

CARRIER_HARMONICS: Final = 6
"""Multiples of a carrier that are expected where the fleet names no excitation."""

MOTOR_SHAFT_HARMONICS: Final = 4
"""Of unbalance, misalignment and looseness [assumed]."""

WHEELSET_HARMONICS: Final = 4
"""Of unbalance and out-of-round wheels [assumed]."""

MOST_MESH_HARMONICS: Final = 1000
"""Of each pair: a drive that all but stands has millions below any frequency, and none of them is heard."""


@dataclass(frozen=True)
class Excitation:
    """One excitation at a motor speed.

    Parameters
    ----------
    name : str
        As ``"mesh x2"`` (``"mesh second x2"`` where there are several pairs), ``"motor shaft x1"``, ``"carrier x2"``.
    kind : str
        One of `ExcitationKind`.
    frequency_hz : float
    order : float or None
        Per turn of the motor; None where the frequency is not proportional to the motor's speed.
    pair : str or None
        Name of the gear pair of a mesh.
    harmonic : int
        Multiple of its family's first; 1 where it has none.
    hz_per_motor_hz : float
        By how much the frequency follows the motor's speed at constant carrier: its order, 0 of a line that stands
        still, and what remains of a sideband.
    """

    name: str
    kind: ExcitationKind
    frequency_hz: float
    order: float | None
    pair: str | None = None
    harmonic: int = 1
    hz_per_motor_hz: float = 0.0


def _of_order(
    name: str, kind: ExcitationKind, order: float, motor_hz: float, pair: str | None, harmonic: int
) -> Excitation:
    return Excitation(name, kind, order * motor_hz, order, pair, harmonic, order)


def mesh_excitations(orders: Mapping[str, float], motor_hz: float, highest_hz: float) -> Iterator[Excitation]:
    """Yield the mesh harmonics of each pair up to a frequency, `MOST_MESH_HARMONICS` at most; none at standstill.

    Parameters
    ----------
    orders : mapping of str to float
        Meshes for one turn of the motor, by the pair's name.
    motor_hz, highest_hz : float
    """
    for pair, order in orders.items():
        label = "mesh" if len(orders) == 1 else f"mesh {pair}"
        first_hz = order * motor_hz
        held = highest_hz / first_hz * (1.0 + 1e-12) if first_hz > 0.0 else 0.0
        for harmonic in range(1, int(min(held, MOST_MESH_HARMONICS)) + 1):
            yield _of_order(f"{label} x{harmonic}", "mesh", harmonic * order, motor_hz, pair, harmonic)


def shaft_excitations(wheelset_order: float, motor_hz: float) -> Iterator[Excitation]:
    """Yield the low harmonics of the motor's shaft and of the wheelset."""
    for harmonic in range(1, MOTOR_SHAFT_HARMONICS + 1):
        yield _of_order(f"motor shaft x{harmonic}", "motor", float(harmonic), motor_hz, None, harmonic)
    for harmonic in range(1, WHEELSET_HARMONICS + 1):
        yield _of_order(f"wheelset x{harmonic}", "wheelset", harmonic * wheelset_order, motor_hz, None, harmonic)


def motor_excitations(
    motor: Motor, motor_hz: float, carrier_hz: float | None, supply_hz: float | None
) -> Iterator[Excitation]:
    """Yield what ``[[motor.excitation]]`` names, or a carrier's harmonics where it names nothing.

    frequency = a carrier + b supply + c motor_hz + d (physics.md section 5). It is the inverter's where a is not 0.
    An excitation whose carrier is absent at this speed, or whose amplitude is (`MotorExcitation.acts_at`), is not
    expected.

    Parameters
    ----------
    motor : Motor
    motor_hz : float
    carrier_hz, supply_hz : float or None
        At this speed; None where there is none.
    """
    if not motor.excitation and carrier_hz is not None:
        for harmonic in range(1, CARRIER_HARMONICS + 1):
            yield Excitation(f"carrier x{harmonic}", "inverter", harmonic * carrier_hz, None, None, harmonic)
    supply_order = (supply_hz / motor_hz) if supply_hz is not None and motor_hz > 0.0 else 0.0
    for excitation in motor.excitation:
        a, b, c, d = excitation.terms
        if (a and carrier_hz is None) or not excitation.acts_at(60.0 * motor_hz):
            continue
        moving = b * supply_order + c
        yield Excitation(
            excitation.name,
            "inverter" if a else "motor",
            a * (carrier_hz or 0.0) + moving * motor_hz + d,
            None if a or d else moving,
            None,
            int(a) if not (b or c or d) and a >= 1.0 and a.is_integer() else 1,
            moving,
        )
