"""Whose tone is it: order and owner of a tone, by what the fleet's kinematics expects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Protocol

__all__ = ["OWNERS", "ExpectedTone", "ToneLabel", "ToneLike", "label_tones", "matching_tolerance_hz"]

SIGMAS: Final = 3.0
"""Standard deviations within which a tone counts as an expected one; as in `lines.families`."""

OWNERS: Final[Mapping[str, str]] = MappingProxyType(
    {"mesh": "gearbox", "motor": "motor", "inverter": "motor", "wheelset": "wheelset"}
)
"""Component that an excitation's kind belongs to, as in the attribution of lines."""


class ToneLike(Protocol):
    """What is labelled: `EcmaTone`, `RatedTone` or a `lines.Line`."""

    @property
    def frequency_hz(self) -> float: ...  # noqa: D102
    @property
    def frequency_error_hz(self) -> float: ...  # noqa: D102


class ExpectedTone(Protocol):
    """What is expected at a motor speed; `fleet.Excitation` is one."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def frequency_hz(self) -> float: ...  # noqa: D102
    @property
    def order(self) -> float | None: ...  # noqa: D102
    @property
    def hz_per_motor_hz(self) -> float: ...  # noqa: D102


@dataclass(frozen=True)
class ToneLabel:
    """Order and owner of one tone.

    Parameters
    ----------
    excitation : str or None
        Name of the nearest expected excitation within reach; None where there is none.
    owner : str or None
        Component that it belongs to.
    order : float or None
        Expected order per turn of the motor; without an excitation, the tone's own frequency over the motor's, None
        where the motor stands.
    distance_hz : float or None
        Tone minus expected frequency.
    tolerance_hz : float or None
        Reach that was allowed.
    also : tuple of str
        Other excitations within their reach, the nearest first: with any of another owner the label is ambiguous.
    ambiguous : bool
    """

    excitation: str | None
    owner: str | None
    order: float | None
    distance_hz: float | None
    tolerance_hz: float | None
    also: tuple[str, ...] = ()
    ambiguous: bool = False


def matching_tolerance_hz(
    tone: ToneLike, expected: ExpectedTone, motor_hz_error: float, sigmas: float = SIGMAS
) -> float:
    """Return how far a tone may lie beside an expected frequency.

    So many standard deviations of the tone's own frequency and of the speed, by how much the
    expected frequency follows it.

    Parameters
    ----------
    tone : ToneLike
    expected : ExpectedTone
    motor_hz_error : float
        One standard deviation of the motor's turns per second: a tacho's 1e-4 of them, a stated train speed's
        5e-3 (`attribution.kinematic`), and the scatter within the run.
    """
    return sigmas * math.hypot(tone.frequency_error_hz, expected.hz_per_motor_hz * motor_hz_error)


def label_tones(
    tones: Sequence[ToneLike],
    expected: Sequence[ExpectedTone],
    motor_hz: float,
    motor_hz_error: float,
    owners: Mapping[str, str] = OWNERS,
) -> tuple[ToneLabel, ...]:
    """Give each tone the order and owner of the expected excitation that lies nearest, in standard deviations.

    Parameters
    ----------
    tones : sequence of ToneLike
    expected : sequence of ExpectedTone
        At `motor_hz`, as `Kinematics.excitations` gives them.
    motor_hz, motor_hz_error : float
        Turns of the motor per second and one standard deviation.
    owners : mapping of str to str
        Component by kind of excitation.

    Returns
    -------
    tuple of ToneLabel
        In the order of the tones.
    """
    return tuple(_label(tone, expected, motor_hz, motor_hz_error, owners) for tone in tones)


def _label(
    tone: ToneLike, expected: Sequence[ExpectedTone], motor_hz: float, motor_hz_error: float, owners: Mapping[str, str]
) -> ToneLabel:
    within = []
    for candidate in expected:
        tolerance = matching_tolerance_hz(tone, candidate, motor_hz_error)
        distance = tone.frequency_hz - candidate.frequency_hz
        if abs(distance) <= tolerance:
            within.append((abs(distance) / tolerance if tolerance > 0.0 else 0.0, distance, tolerance, candidate))
    own_order = tone.frequency_hz / motor_hz if motor_hz > 0.0 else None
    if not within:
        return ToneLabel(None, None, own_order, None, None)
    within.sort(key=lambda entry: entry[0])
    _, distance, tolerance, best = within[0]
    owner = owners.get(best.kind)
    return ToneLabel(
        best.name,
        owner,
        best.order if best.order is not None else own_order,
        distance,
        tolerance,
        tuple(entry[3].name for entry in within[1:]),
        any(owners.get(entry[3].kind) != owner for entry in within[1:]),
    )
