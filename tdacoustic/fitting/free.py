"""Which parameters of a fleet a fit may move, and how far."""

from __future__ import annotations

import math
from typing import Final, Literal

from tdacoustic.errors import FittingError
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fleet import Fleet

__all__ = ["free_parameter"]

Scale = Literal["linear", "log"]

_BOUNDS: Final[dict[str, tuple[float, float, Scale]]] = {
    "masuda.constant_db": (-100.0, 100.0, "linear"),
    "model.structure_gain_db": (-60.0, 60.0, "linear"),
    "model.motor_gain_db": (-60.0, 60.0, "linear"),
    "gear_dynamics.mesh_damping_ratio": (0.005, 0.5, "log"),
    "gear_dynamics.bearing_damping_ratio": (0.005, 0.5, "log"),
}
"""Bounds and scale of parameters that are often freed [assumed]; levels in dB get 40 dB to both sides, others a tenth
to ten times their value."""

_DECIBELS: Final = 40.0


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
        It is no single number, or zero without usual bounds, or bounds and values contradict each other.
    """
    auxiliary = "." not in key
    value = _value(fleet, key) if not auxiliary else initial
    if value is None:
        raise FittingError(f"{key} is no parameter of a fleet, and an auxiliary one needs a value to start from")
    start = value if initial is None else initial
    unbounded: tuple[float, float, Scale] = (-math.inf, math.inf, "linear")
    usual_low, usual_high, usual_scale = unbounded if auxiliary else _usual(fleet, key, value)
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
        raise FittingError(f"{fleet.path}: {key} is no single number and cannot be freed")
    return float(value)


def _usual(fleet: Fleet, key: str, value: float) -> tuple[float, float, Scale]:
    if key in _BOUNDS:
        return _BOUNDS[key]
    if "_db" in key.rpartition(".")[2] or "_db." in key:
        return value - _DECIBELS, value + _DECIBELS, "linear"
    if value == 0.0:
        raise FittingError(
            f"{fleet.path}: {key} is 0: a parameter is freed from a tenth to ten times its value, and this one needs "
            "bounds of its own"
        )
    if value < 0.0:
        return 10.0 * value, 0.1 * value, "linear"
    return 0.1 * value, 10.0 * value, "log"
