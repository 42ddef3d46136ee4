"""Which parameters of a fleet a fit may move, and how far."""

from __future__ import annotations

import keyword
import math
from collections.abc import Sequence
from typing import Final, Literal

from tdacoustic.errors import FittingError, FleetError
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fleet import Fleet

__all__ = ["checked_free", "free_parameter"]

Scale = Literal["linear", "log"]

_BOUNDS: Final[dict[str, tuple[float, float, Scale]]] = {
    "masuda.constant_db": (-100.0, 100.0, "linear"),
    "model.structure_gain_db": (-60.0, 60.0, "linear"),
    "model.motor_gain_db": (-60.0, 60.0, "linear"),
    "gear_dynamics.mesh_damping_ratio": (0.005, 0.5, "log"),
    "gear_dynamics.bearing_damping_ratio": (0.005, 0.5, "log"),
}
"""Bounds and scale of parameters that are often freed [assumed]; levels in dB get 40 dB to both sides, others a tenth
to ten times their value, as far as a fleet file may have that."""

_DECIBELS: Final = 40.0
_HALVINGS: Final = 24


def free_parameter(
    fleet: Fleet,
    key: str,
    *,
    initial: float | None = None,
    low: float | None = None,
    high: float | None = None,
    prior: tuple[float, float] | None = None,
    scale: Scale | None = None,
    expression: str | None = None,
) -> FreeParameter:
    """Return a parameter of a fleet as one that a fit may move, with its usual bounds.

    Parameters
    ----------
    fleet : Fleet
    key : str
        Of a single number, or of an entry of a list (``"gear_dynamics.mass_kg.2"``). A name without a dot is an
        auxiliary parameter for expressions: it needs `initial`, and bounds if it is to have any.
    initial : float, optional
        Where the search starts. Default: the fleet's value.
    low, high : float, optional
        Bounds. Default: the usual ones.
    prior : (float, float), optional
        Mean and standard deviation in the parameter's own unit. On a logarithmic scale the deviation is taken relative
        to the mean.
    scale : {"linear", "log"}, optional
    expression : str, optional
        See `FreeParameter`.

    Raises
    ------
    FittingError
        It is no single number or a whole one, zero without bounds, or bounds and values contradict each other.
    """
    auxiliary = "." not in key
    if auxiliary and (not key.isidentifier() or keyword.iskeyword(key)):
        raise FittingError(f"{key!r} can be no name in an expression: letters, digits and _, first a letter")
    value = initial if auxiliary else _value(fleet, key)
    if value is None:
        raise FittingError(f"{key} is no parameter of a fleet, and an auxiliary one needs a value to start from")
    start = value if initial is None else initial
    stated = low is not None and high is not None
    unbounded: tuple[float, float, Scale] = (-math.inf, math.inf, "linear")
    if expression is not None or auxiliary or (stated and scale is not None):
        usual_low, usual_high, usual_scale = unbounded
    elif stated:
        assert low is not None
        usual_low, usual_high, usual_scale = -math.inf, math.inf, "log" if min(low, start) > 0.0 else "linear"
        usual_scale = _BOUNDS[key][2] if key in _BOUNDS else "linear" if _is_level(key) else usual_scale
    else:
        usual_low, usual_high, usual_scale = _usual(fleet, key, value)
    chosen = usual_scale if scale is None else scale
    lowest = min(usual_low, start) if low is None else low
    highest = max(usual_high, start) if high is None else high
    if prior is not None and chosen == "log":
        if not prior[0] > 0.0:
            raise FittingError(f"{key}: a prior on a logarithmic scale needs a mean above 0, got {prior[0]:g}")
        prior = (math.log(prior[0]), prior[1] / prior[0])
    return FreeParameter(key, float(start), float(lowest), float(highest), prior, chosen, expression)


def _value(fleet: Fleet, key: str) -> float:
    value = fleet.value_of(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FittingError(f"{key} is no single number and cannot be freed")
    if isinstance(value, int):
        raise FittingError(f"{key} is a whole number and cannot be freed")
    return value


def _is_level(key: str) -> bool:
    return "_db" in key.rpartition(".")[2] or "_db." in key


def _usual(fleet: Fleet, key: str, value: float) -> tuple[float, float, Scale]:
    if key in _BOUNDS:
        return _BOUNDS[key]
    if _is_level(key):
        return value - _DECIBELS, value + _DECIBELS, "linear"
    if value == 0.0:
        raise FittingError(f"{key} is 0 and has no usual bounds: it needs min and max")
    ends = _allowed(fleet, key, value, 0.1 * value), _allowed(fleet, key, value, 10.0 * value)
    return min(ends), max(ends), "log" if value > 0.0 else "linear"


def _allowed(fleet: Fleet, key: str, value: float, end: float) -> float:
    """The end of the usual bounds, or the last value towards it that a fleet file may have."""
    inside, outside = value, end
    for _ in range(_HALVINGS):
        try:
            fleet.replaced({key: end})
        except FleetError:
            outside = end
        else:
            inside = end
            if end == outside:
                break
        end = 0.5 * (inside + outside)
    return inside


def checked_free(fleet: Fleet, names: Sequence[str]) -> None:
    """Raise for parameters whose every value would ask for modes or transfer vectors of its own.

    Parameters
    ----------
    fleet : Fleet
    names : sequence of str
        Of parameters that a calibration is to move; those that are none of the fleet's are not looked at.

    Raises
    ------
    FittingError
    """
    if fleet.radiation.method.value == "point_sources":
        return
    from tdacoustic.drive.housing_steps import housing_tasks
    from tdacoustic.drive.insertion_loss import air_tasks

    def keys(of: Fleet) -> tuple[str, ...]:
        tasks = housing_tasks(of)
        inside = air_tasks(of, tasks)[:1] if of.masuda.placement.value == "inside" else ()
        return tuple(task.key for task in (tasks.modes, tasks.mean, *inside))

    before = keys(fleet)
    for name in names:
        if "." not in name or "[" in name:
            continue
        value = fleet.value_of(name)
        if keys(fleet.replaced({name: 0.9999 * value if value else 1e-3})) != before:
            raise FittingError(
                f"{name} cannot be free with boundary elements: the housing's modes or transfer vectors depend on it, "
                "and each value of it would take minutes"
            )
