"""Where contributions are told: the whole, third octaves, tones, orders, and what is broadband, state by state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from tdacoustic.attribution.excitation import Expected, owner_of
from tdacoustic.attribution.kinematic import RunKinematics
from tdacoustic.campaign import Exclude
from tdacoustic.contributions import Span
from tdacoustic.fleet import Kinematics
from tdacoustic.measured.runs import MeasuredRun

__all__ = [
    "BROADBAND",
    "TONES",
    "WHOLE",
    "NamedSpan",
    "SpanKind",
    "Stretch",
    "orders_between",
    "spans",
    "steady_tones",
    "third_octaves",
]

SpanKind = Literal["total", "tones", "broadband", "band", "order", "tone"]

WHOLE, TONES, BROADBAND = "total", "tones", "broadband"
"""Names of the spans that every state has; the second and third where it has tones."""

LOBE: Final = 2.5
"""Lines to each side of a tone that its lobe fills (Hann: two, and a half for where it lies between lines)."""
MESH_HARMONICS: Final = 3
"""Harmonics of each mesh that are told though no noise line shows them."""
OTHER_HARMONICS: Final = 4
"""Harmonics of the inverter and the motor's fields that are told in a run-up, where lines are not sought."""
LEAST_LINES: Final = 3.0
"""Lines that a third octave takes, at least."""
MOST: Final = 12
"""Tones and orders of a state that are told one by one, the loudest first; the rest are in the tones together."""
SHAFTS: Final = ("motor shaft", "wheelset")

NOMINAL_HZ: Final = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
"""Nominal mid-band frequencies of a decade of third octaves (IEC 61260-1)."""


@dataclass(frozen=True)
class Stretch:
    """A tone or an order of a state.

    Parameters
    ----------
    name : str
    low_hz, high_hz : float
    order : float or None
        Per turn of the motor; None where its frequency does not follow the speed, or none is known.
    known : bool
        Whether an expected excitation owns it.
    mean_square : float
        Of the noise line there; 0 where there is none.
    """

    name: str
    low_hz: float
    high_hz: float
    order: float | None
    known: bool
    mean_square: float


@dataclass(frozen=True)
class NamedSpan:
    """A span with what it is of."""

    span: Span
    kind: SpanKind
    order: float | None = None


def steady_tones(
    run: MeasuredRun,
    receivers: Sequence[str],
    kinematics: RunKinematics | None,
    excludes: Iterable[Exclude],
    step_hz: float,
) -> tuple[Stretch, ...]:
    """Return the noise lines of a steady run with their owners, and expected orders that no noise line shows.

    Parameters
    ----------
    run : MeasuredRun
    receivers : sequence of str
    kinematics : RunKinematics or None
    excludes : iterable of Exclude
        Lines inside are none of the drive's.
    step_hz : float
        Line spacing of the cross spectra.
    """
    assert run.measurement is not None
    expected = () if kinematics is None else kinematics.expected
    turns_hz = None if kinematics is None else kinematics.motor_hz
    scatter = run.measurement.speed.scatter
    banned = [item for item in excludes if item.condition == run.run.condition]
    found: list[Stretch] = []
    shown: set[str] = set()
    for receiver in receivers:
        result = run.measurement.channel(receiver)
        for line in result.lines if result is not None and result.usable else ():
            hz = line.frequency_hz
            if any(b.channel in (None, receiver) and b.frequency_hz[0] <= hz <= b.frequency_hz[1] for b in banned):
                continue
            match, _ = owner_of(hz, line.frequency_error_hz, expected)
            moving_hz = max(scatter * hz, 0.0 if scatter > 0.0 else line.width_hz) if line.width_hz else 0.0
            half = LOBE * (step_hz + moving_hz)
            if match is None:
                found.append(Stretch(f"tone {hz:.0f} Hz", hz - half, hz + half, None, False, line.rms**2))
                continue
            shown.add(match.expected.name)
            order = _order(match.expected, turns_hz)
            found.append(Stretch(match.expected.name, hz - half, hz + half, order, True, line.rms**2))
    for item in expected:
        if item.name not in shown and item.kind == "mesh" and item.harmonic <= MESH_HARMONICS:
            half = LOBE * step_hz + 2.0 * item.error_hz
            hz = item.frequency_hz
            found.append(Stretch(item.name, hz - half, hz + half, _order(item, turns_hz), True, 0.0))
    return _merged(found)


def _order(item: Expected, turns_hz: float | None) -> float | None:
    return None if turns_hz is None or item.base == "carrier" else item.frequency_hz / turns_hz


def orders_between(
    drive: Kinematics, low_hz: float, high_hz: float, highest_hz: float, step_hz: float
) -> tuple[Stretch, ...]:
    """Return where the orders lie while the motor turns between two speeds.

    Parameters
    ----------
    drive : Kinematics
    low_hz, high_hz : float
        Turns of the motor per second.
    highest_hz : float
        Of the spectra.
    step_hz : float
        Line spacing.
    """
    at_low = {item.name: item for item in drive.excitations(low_hz, highest_hz)}
    at_high = {item.name: item for item in drive.excitations(high_hz, highest_hz)}
    found = []
    for name, item in at_low.items():
        most = MESH_HARMONICS if item.kind == "mesh" else OTHER_HARMONICS
        if name in at_high and item.harmonic <= most and not name.startswith(SHAFTS):
            ends = sorted((item.frequency_hz, at_high[name].frequency_hz))
            found.append(Stretch(name, ends[0] - LOBE * step_hz, ends[1] + LOBE * step_hz, item.order, True, 0.0))
    return _merged(found)


def _merged(stretches: Iterable[Stretch]) -> tuple[Stretch, ...]:
    """One stretch of those that overlap, as two receivers' lines of one tone do; its name is that of all."""
    found: list[Stretch] = []
    for item in sorted(stretches, key=lambda stretch: stretch.low_hz):
        if not found or item.low_hz >= found[-1].high_hz:
            found.append(item)
            continue
        last = found[-1]
        named = [one for one in (last, item) if one.known] or [max(last, item, key=lambda one: one.mean_square)]
        names = list(dict.fromkeys(part for one in named for part in one.name.split(" + ")))
        found[-1] = Stretch(
            " + ".join(names),
            last.low_hz,
            max(last.high_hz, item.high_hz),
            named[0].order if len(names) == 1 else None,
            last.known or item.known,
            max(last.mean_square, item.mean_square),
        )
    return tuple(found)


def spans(
    tones: Mapping[str, Sequence[Stretch]],
    excluded: Mapping[str, Sequence[tuple[float, float]]],
    low_hz: float,
    high_hz: float,
    step_hz: float,
) -> tuple[NamedSpan, ...]:
    """Return all spans of a campaign's states.

    Parameters
    ----------
    tones : mapping of str to sequence of Stretch
        By state; of a steady one noise lines and orders, of a run-up's orders.
    excluded : mapping of str to sequence of (float, float)
        By state, what the engineer left out.
    low_hz, high_hz : float
        Of the whole.
    step_hz : float
    """
    low_hz = max(low_hz, 2.0 * step_hz)
    found = [NamedSpan(Span(WHOLE, low_hz, high_hz), "total")]
    found += [NamedSpan(band, "band") for band in third_octaves(low_hz, high_hz, step_hz)]
    for state, stretches in tones.items():
        inside = [
            replace(item, low_hz=max(item.low_hz, low_hz), high_hz=min(item.high_hz, high_hz))
            for item in stretches
            if low_hz < 0.5 * (item.low_hz + item.high_hz) < high_hz
        ]
        sounding = [(item.low_hz, item.high_hz) for item in inside if item.mean_square > 0.0]
        if sounding:
            gaps = tuple((a[1], b[0]) for a, b in pairwise(sounding) if b[0] > a[1])
            whole = Span(TONES, sounding[0][0], sounding[-1][1], (state,), gaps)
            found.append(NamedSpan(whole, "tones"))
        apart = _joined([*sounding, *excluded.get(state, ())], low_hz, high_hz)
        if apart:
            found.append(NamedSpan(Span(BROADBAND, low_hz, high_hz, (state,), apart), "broadband"))
        loudest = sorted(inside, key=lambda item: -item.mean_square)[:MOST]
        for item in sorted(loudest, key=lambda item: item.low_hz):
            span = Span(item.name, item.low_hz, item.high_hz, (state,))
            found.append(NamedSpan(span, "order" if item.known else "tone", item.order))
    return tuple(found)


def _joined(stretches: Iterable[tuple[float, float]], low_hz: float, high_hz: float) -> tuple[tuple[float, float], ...]:
    """Stretches inside of limits that do not overlap."""
    found: list[tuple[float, float]] = []
    for low, high in sorted((max(a, low_hz), min(b, high_hz)) for a, b in stretches):
        if high <= low:
            continue
        if found and low <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], high)
        else:
            found.append((low, high))
    return tuple(found)


def third_octaves(low_hz: float, high_hz: float, step_hz: float) -> list[Span]:
    """Return the third octaves (base ten, IEC 61260-1) that lie inside of limits and hold lines enough.

    Parameters
    ----------
    low_hz, high_hz : float
    step_hz : float
        Line spacing.

    Examples
    --------
    >>> [band.name for band in third_octaves(20.0, 140.0, 4.0)]
    ['63 Hz', '80 Hz', '100 Hz']
    """
    found = []
    for number in range(int(np.ceil(10.0 * np.log10(low_hz))), int(np.floor(10.0 * np.log10(high_hz))) + 1):
        centre = 10.0 ** (0.1 * number)
        low, high = centre * 10.0**-0.05, centre * 10.0**0.05
        if low >= low_hz and high <= high_hz and high - low >= LEAST_LINES * step_hz:
            decade, place = divmod(number, 10)
            found.append(Span(f"{NOMINAL_HZ[place] * 10.0**decade:g} Hz", low, high))
    return found
