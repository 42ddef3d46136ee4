"""Parameters that a fit may move, and how lmfit knows them."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

from tdacoustic.errors import FittingError

if TYPE_CHECKING:
    import lmfit

__all__ = ["FreeParameter", "lmfit_parameters", "values_of"]


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that a fit may move.

    Parameters
    ----------
    name : str
        As a fleet's dotted key, ``"masuda.constant_db"``.
    initial : float
    low, high : float
        Bounds; infinite where there are none.
    prior : (float, float), optional
        Mean and standard deviation of what is known before; in the unit of the value, or in its natural logarithm
        where the scale is "log".
    scale : {"linear", "log"}
        On which the parameter is moved and its interval is symmetric.
    expression : str, optional
        Instead of moving it: lmfit's expression of other parameters, by their names.
    fixed : bool
        Whether it stays where it is, for expressions and profiles.

    Raises
    ------
    FittingError
        Bounds that do not hold the initial value, a prior without width, or a logarithm of what is not above zero.
    """

    name: str
    initial: float
    low: float = -math.inf
    high: float = math.inf
    prior: tuple[float, float] | None = None
    scale: Literal["linear", "log"] = "linear"
    expression: str | None = None
    fixed: bool = False

    def __post_init__(self) -> None:
        if not math.isfinite(self.initial):
            raise FittingError(f"{self.name}: the initial value must be a number, got {self.initial!r}")
        if not self.low < self.high:
            raise FittingError(f"{self.name}: bounds must be ascending, got {self.low:g} and {self.high:g}")
        if not self.low <= self.initial <= self.high:
            raise FittingError(
                f"{self.name}: the initial value {self.initial:g} is outside of its bounds, {self.low:g} to "
                f"{self.high:g}"
            )
        if self.prior is not None and not self.prior[1] > 0.0:
            raise FittingError(f"{self.name}: the prior's standard deviation must be > 0, got {self.prior[1]:g}")
        unbounded = self.expression is not None and self.low == -math.inf
        if self.scale == "log" and not (self.initial > 0.0 and (self.low > 0.0 or unbounded)):
            raise FittingError(
                f'{self.name}: scale = "log" needs values and bounds above 0, got {self.initial:g} from {self.low:g}'
            )

    @property
    def is_moved(self) -> bool:
        """Whether the fit moves it."""
        return self.expression is None and not self.fixed

    @property
    def width(self) -> float:
        """Distance of the bounds on the scale of the fit."""
        return self.inner(self.high) - self.inner(self.low)

    def starting_at(self, value: float) -> FreeParameter:
        """Return the parameter with another initial value, brought into its bounds."""
        return replace(self, initial=min(max(value, self.low), self.high))

    def fixed_at(self, value: float) -> FreeParameter:
        """Return the parameter as one that stays at a value, brought into its bounds, without its prior."""
        return replace(self.starting_at(value), fixed=True, prior=None)

    def inner(self, value: float) -> float:
        """Value on the scale of the fit."""
        if self.scale == "linear":
            return value
        return math.log(value) if value > 0.0 else -math.inf

    def outer(self, inner: float) -> float:
        """Value for its place on the scale of the fit."""
        return inner if self.scale == "linear" else math.exp(inner)


@lru_cache(maxsize=1024)
def _symbol(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]", "__", name)


def _expression(parameter: FreeParameter, known: Sequence[FreeParameter]) -> str:
    """The expression in lmfit's symbols, of parameters in their own units."""
    text = str(parameter.expression)
    for other in sorted(known, key=lambda item: -len(item.name)):
        value = _symbol(other.name) if other.scale == "linear" else f"exp({_symbol(other.name)})"
        text = re.sub(rf"(?<![\w.]){re.escape(other.name)}(?![\w.])", value, text)
    return f"log({text})" if parameter.scale == "log" else text


def lmfit_parameters(parameters: Sequence[FreeParameter], inner: Mapping[str, float] | None = None) -> lmfit.Parameters:
    """Return lmfit's parameters, on the scale of the fit.

    Parameters
    ----------
    parameters : sequence of FreeParameter
    inner : mapping of str to float, optional
        Where to start, by name and on the scale of the fit. Default: the initial values.

    Raises
    ------
    FittingError
        Two of one name, or an expression that lmfit does not understand.
    """
    import lmfit

    names = [parameter.name for parameter in parameters]
    twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
    if twice is not None:
        raise FittingError(f"parameter {twice!r} is freed twice")
    made: Any = lmfit.Parameters()
    for parameter in parameters:
        value = (inner or {}).get(parameter.name, parameter.inner(parameter.initial))
        low, high = parameter.inner(parameter.low), parameter.inner(parameter.high)
        made.add(_symbol(parameter.name), value, vary=not parameter.fixed, min=low, max=high)
    for parameter in parameters:
        if parameter.expression is not None:
            _check_circle(parameter, parameters)
    for parameter in parameters:
        if parameter.expression is not None:
            _express(made, parameter, parameters)
    return made


def _check_circle(parameter: FreeParameter, parameters: Sequence[FreeParameter]) -> None:
    """Raise where an expression leads back to its own parameter."""
    seen: set[str] = set()
    waiting = [parameter]
    while waiting:
        text = str(waiting.pop().expression)
        for other in parameters:
            if re.search(rf"(?<![\w.]){re.escape(other.name)}(?![\w.])", text) and other.name not in seen:
                if other.name == parameter.name:
                    raise FittingError(
                        f"{parameter.name}: expression {parameter.expression!r} leads back to the parameter itself"
                    )
                seen.add(other.name)
                waiting += [other] if other.expression is not None else []


def _express(made: Any, parameter: FreeParameter, parameters: Sequence[FreeParameter]) -> None:
    where = f"{parameter.name}: expression {parameter.expression!r}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of asteval, about what is raised or checked below
            made[_symbol(parameter.name)].expr = _expression(parameter, parameters)
            value = float(made[_symbol(parameter.name)].value)
    except Exception as error:  # asteval raises whatever the expression raises
        raise FittingError(f"{where}: {str(error).strip() or 'is no expression'}") from error
    if not math.isfinite(value):
        raise FittingError(f"{where} gives {value!r} where the fit starts")


def values_of(parameters: Sequence[FreeParameter], found: lmfit.Parameters) -> dict[str, float]:
    """Return the values of lmfit's parameters in their own units, by name."""
    return {parameter.name: parameter.outer(float(found[_symbol(parameter.name)].value)) for parameter in parameters}
