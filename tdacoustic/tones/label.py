"""Whose tone is it: order and owner of a tone, by what the fleet's kinematics expects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Protocol

__all__ = ["OWNERS", "Excited", "ExpectedTone", "ToneLabel", "ToneLike", "expected_tones", "label_tones"]

SIGMAS: Final = 3.0
"""Standard deviations within which a tone counts as an expected one; as in `lines.families`."""

CROWDED: Final = 0.25
"""An expected tone's reach over the distance to the next one of its own family, from which on any tone would fall on
the family somewhere and none is named by it [assumed: by chance at most half of all tones would]."""

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


class Excited(Protocol):
    """What the kinematics expects at a motor speed; `fleet.Excitation` is one."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def frequency_hz(self) -> float: ...  # noqa: D102
    @property
    def harmonic(self) -> int: ...  # noqa: D102
    @property
    def hz_per_motor_hz(self) -> float: ...  # noqa: D102


@dataclass(frozen=True)
class ExpectedTone:
    """A frequency at which a tone of known origin may lie.

    Parameters
    ----------
    name : str
        As ``"mesh x2"``.
    kind : str
        Of the excitation, a key of `OWNERS`.
    frequency_hz, error_hz : float
        One standard deviation: of the speed, by how much the frequency follows it.
    harmonic : float
        Multiple of its family's first; 1 where it stands alone.
    """

    name: str
    kind: str
    frequency_hz: float
    error_hz: float
    harmonic: float = 1.0


def expected_tones(
    excitations: Sequence[Excited], motor_hz: float, motor_hz_error: float, fixed_error: float = 0.0
) -> tuple[ExpectedTone, ...]:
    """Return excitations with the error that the motor's speed leaves.

    Parameters
    ----------
    excitations : sequence of Excited
        At one motor speed.
    motor_hz, motor_hz_error : float
        Turns of the motor per second and one standard deviation: a tacho's 1e-4 of them, a stated train speed's
        5e-3 (`attribution.kinematic`), and the scatter within the time that the tones are of.
    fixed_error : float
        Relative standard deviation of the part that does not follow the motor, an inverter's carrier.
    """
    found = []
    for item in excitations:
        standing_hz = abs(item.frequency_hz - item.hz_per_motor_hz * motor_hz)
        error_hz = abs(item.hz_per_motor_hz) * motor_hz_error + standing_hz * fixed_error
        found.append(ExpectedTone(item.name, item.kind, item.frequency_hz, error_hz, float(item.harmonic)))
    return tuple(found)


@dataclass(frozen=True)
class ToneLabel:
    """Origin of one tone.

    Parameters
    ----------
    excitation : str or None
        Name of the nearest expected tone within reach; None where there is none.
    owner : str or None
        Component that it belongs to.
    distance_hz : float or None
        Tone minus expected frequency.
    tolerance_hz : float or None
        Reach that was allowed.
    also : tuple of str
        Others within their reach, the nearest first: with any of another owner the label is ambiguous.
    ambiguous : bool
    """

    excitation: str | None
    owner: str | None
    distance_hz: float | None = None
    tolerance_hz: float | None = None
    also: tuple[str, ...] = ()
    ambiguous: bool = False


def label_tones(
    tones: Sequence[ToneLike], expected: Sequence[ExpectedTone], owners: Mapping[str, str] = OWNERS
) -> tuple[ToneLabel, ...]:
    """Give each tone the origin of the expected tone that lies nearest, in standard deviations.

    A tone may lie beside an expected one by `SIGMAS` standard deviations of both. Of a family whose members' reach
    fills much of the distance between them (`CROWDED`) none is named.

    Parameters
    ----------
    tones : sequence of ToneLike
    expected : sequence of ExpectedTone
    owners : mapping of str to str
        Component by kind of excitation.

    Returns
    -------
    tuple of ToneLabel
        In the order of the tones.
    """
    return tuple(_label(tone, expected, owners) for tone in tones)


def _label(tone: ToneLike, expected: Sequence[ExpectedTone], owners: Mapping[str, str]) -> ToneLabel:
    within = []
    for candidate in expected:
        tolerance = SIGMAS * math.hypot(tone.frequency_error_hz, candidate.error_hz)
        distance = tone.frequency_hz - candidate.frequency_hz
        crowded = tolerance > CROWDED * candidate.frequency_hz / max(1.0, candidate.harmonic)
        if abs(distance) <= tolerance and not crowded:
            within.append((abs(distance) / tolerance if tolerance > 0.0 else 0.0, distance, tolerance, candidate))
    if not within:
        return ToneLabel(None, None)
    within.sort(key=lambda entry: entry[0])
    _, distance, tolerance, best = within[0]
    owner = owners.get(best.kind)
    return ToneLabel(
        best.name,
        owner,
        distance,
        tolerance,
        tuple(entry[3].name for entry in within[1:]),
        any(owners.get(entry[3].kind) != owner for entry in within[1:]),
    )
