"""From the stored numbers of a TDMS channel to values in its unit.

A channel's properties describe a list of scales, each fed by the one that it names or
by a stored number; the last one gives the values. The arithmetic of the simple kinds is
done here in float64, and that of resistance thermometers, which npTDMS solves value by
value; that of strain gauges, thermistors and thermocouples is npTDMS's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.tdms.layouts import RAW
from tdacoustic.formats.tdms.metadata import PropertyValue

__all__ = ["Scaling", "ScalingError", "limits_of", "read_scaling"]

Values = NDArray[np.float64]

MAX_SCALES = 64
MAX_POINTS = 100_000
SENSORS: Final = ("Strain", "Thermistor", "Thermocouple")
RTD_NUMBERS: Final = ("Current_Excitation", "R0_Nominal_Resistance", "A", "B", "C", "Lead_Wire_Resistance")
NEWTON_STEPS = 20
DEFAULT_COEFFICIENTS = 4


class ScalingError(Exception):
    """Why a channel's values cannot be brought into its unit, in words."""


@dataclass(frozen=True)
class Scale:
    """One scale: its kind, its numbers, and what feeds it.

    Parameters
    ----------
    kind : str
        ``stored``, ``same``, ``linear``, ``polynomial``, ``table``, ``add``, ``subtract``, ``rtd`` or one of `SENSORS`.
    sources : tuple of int
        Scales that feed it; of ``stored`` the number of the DAQmx scaler, or `RAW`.
    numbers : tuple of float
        Slope and intercept; coefficients, lowest power first; the x, then the y of a table; `RTD_NUMBERS`, the last
        being the resistance of all leads that are measured.
    properties : tuple of (str, float)
        Of a sensor, as npTDMS takes them.
    index : int
        Its number, by which npTDMS finds the properties.
    """

    kind: str
    sources: tuple[int, ...]
    numbers: tuple[float, ...] = ()
    properties: tuple[tuple[str, float], ...] = ()
    index: int = 0


@dataclass(frozen=True)
class Scaling:
    """The scales of a channel; the last one gives its values.

    Parameters
    ----------
    scales : tuple of (int, Scale)
        Only those that the last one needs, each behind what feeds it.
    """

    scales: tuple[tuple[int, Scale], ...]

    def apply(self, stored: Mapping[int, Values]) -> Values:
        """Scale stored numbers.

        Parameters
        ----------
        stored : mapping of int to ndarray
            By number of the DAQmx scaler, or under `RAW`.

        Raises
        ------
        ValueError
            A sensor's equation has no solution for a value.
        """
        values: dict[int, Values] = {RAW: stored[RAW]} if RAW in stored else {}
        with np.errstate(all="ignore"):
            for index, scale in self.scales:
                values[index] = _scaled(scale, values, stored)
        return values[self.scales[-1][0]]


def _scaled(scale: Scale, values: Mapping[int, Values], stored: Mapping[int, Values]) -> Values:
    if scale.kind == "stored":
        return stored[scale.sources[0]]
    given = [values[source] for source in scale.sources]
    if scale.kind == "linear":
        slope, intercept = scale.numbers
        scaled: Values = given[0] * slope
        scaled += intercept
        return scaled
    if scale.kind == "polynomial":
        powers = scale.numbers or (0.0,)
        return np.asarray(np.polynomial.polynomial.polyval(given[0], powers), dtype=np.float64)
    if scale.kind == "table":
        half = len(scale.numbers) // 2
        return np.asarray(np.interp(given[0], scale.numbers[:half], scale.numbers[half:]))
    if scale.kind == "add":
        return given[0] + given[1]
    if scale.kind == "subtract":
        return given[1] - given[0]  # the right operand is what the left one is taken from, as in NI's own programs
    if scale.kind == "same":
        return given[0]
    if scale.kind == "rtd":
        return _rtd(given[0], scale.numbers)
    sensed: Values = _sensor(scale).scale(given[0])
    return sensed


def _rtd(volts: Values, numbers: tuple[float, ...]) -> Values:
    """Temperature in degrees Celsius of a resistance thermometer (Callendar-Van Dusen, IEC 60751).

    ``R / R0 = 1 + A T + B T^2``, and below 0 degrees further ``+ C (T - 100) T^3``, there solved by Newton's steps; NaN
    where it has no solution.
    """
    current, r_0, a, b, c, leads = numbers
    ratio = (volts / current - leads) / r_0
    celsius: Values = (-a + np.sqrt(a * a - 4.0 * b * (1.0 - ratio))) / (2.0 * b)
    cold = ~(ratio >= 1.0)
    if not cold.any():
        return celsius
    t, wanted = celsius[cold], ratio[cold]
    for _ in range(NEWTON_STEPS):
        value = 1.0 + t * (a + t * (b + t * c * (t - 100.0)))
        slope = a + t * (2.0 * b + t * c * (4.0 * t - 300.0))
        t = t - (value - wanted) / slope
    missed = ~(np.abs(1.0 + t * (a + t * (b + t * c * (t - 100.0))) - wanted) < 1e-9)
    celsius[cold] = np.where(missed, np.nan, t)
    return celsius


def _sensor(scale: Scale) -> Any:
    from nptdms import scaling

    kinds = {
        "Strain": scaling.StrainScaling,
        "Thermistor": scaling.ThermistorScaling,
        "Thermocouple": scaling.ThermocoupleScaling,
    }
    return kinds[scale.kind].from_properties(dict(scale.properties), scale.index)


def read_scaling(levels: Sequence[Mapping[str, PropertyValue]], stored: frozenset[int]) -> Scaling | None:
    """Read the scaling of a channel.

    Parameters
    ----------
    levels : sequence of mapping
        Properties of the channel, of its group and of the file: the first that describe a scaling count.
    stored : frozenset of int
        Numbers of its DAQmx scalers, or `RAW`.

    Returns
    -------
    Scaling or None
        None where the stored numbers are the values.

    Raises
    ------
    ScalingError
        It is missing, of a kind that is not known, or contradicts itself.
    """
    for properties in levels:
        count = _number_of_scales(properties)
        if count and properties.get("NI_Scaling_Status", "unscaled") != "scaled":
            return _ordered(properties, count, stored)
    if RAW not in stored:
        raise ScalingError("its values are raw DAQmx counts, and no scaling is given")
    return None


def _number_of_scales(properties: Mapping[str, PropertyValue]) -> int:
    given = properties.get("NI_Number_Of_Scales")
    if given is None:
        prefix, suffix = "NI_Scale[", "]_Scale_Type"
        found = [name[len(prefix) : -len(suffix)] for name in properties if name.startswith(prefix)]
        numbers = [int(text) for text in found if text.isascii() and text.isdigit() and len(text) < 4]
        given = max(numbers, default=-1) + 1
    if not isinstance(given, int) or not 0 <= given <= MAX_SCALES:
        raise ScalingError(f"it states {given} scales; 0 to {MAX_SCALES} are read")
    return given


def _ordered(properties: Mapping[str, PropertyValue], count: int, stored: frozenset[int]) -> Scaling:
    """The scales that the last one needs, each behind what feeds it."""
    done: dict[int, Scale] = {}

    def add(index: int, above: tuple[int, ...]) -> None:
        if index in done:
            return
        if index == RAW:
            if RAW not in stored:
                raise ScalingError("a scale is fed by the raw values, and they are DAQmx counts")
            return
        if index in above:
            raise ScalingError(f"scale {index} is fed by itself")
        if not 0 <= index < count:
            raise ScalingError(f"a scale is fed by scale {index}, of {count}")
        scale = _scale(properties, index, stored)
        if scale.kind != "stored":
            for source in scale.sources:
                add(source, (*above, index))
        done[index] = scale

    add(count - 1, ())
    return Scaling(tuple(done.items()))


def _scale(properties: Mapping[str, PropertyValue], index: int, stored: frozenset[int]) -> Scale:
    kind = properties.get(f"NI_Scale[{index}]_Scale_Type")
    if kind is None:
        if index not in stored:
            raise ScalingError(f"its scale {index} is not described, and no stored number has that number")
        return Scale("stored", (index,))
    read = _Properties(properties, f"NI_Scale[{index}]_{kind}_")
    if kind == "Linear":
        return Scale("linear", (read.source(),), (read.number("Slope"), read.number("Y_Intercept")))
    if kind == "Polynomial":
        size = read.count("Coefficients_Size", DEFAULT_COEFFICIENTS)
        return Scale("polynomial", (read.source(),), read.numbers("Coefficients", size))
    if kind == "Table":
        return _table(read)
    if kind in ("Add", "Subtract"):
        return Scale(
            kind.lower(), (read.source("Left_Operand_Input_Source"), read.source("Right_Operand_Input_Source"))
        )
    if kind == "AdvancedAPI":
        return Scale("same", (read.source(),))
    if kind == "RTD":
        return _read_rtd(read)
    if kind in SENSORS:
        return _checked_sensor(Scale(str(kind), (read.source(),), properties=read.all(), index=index))
    raise ScalingError(f"its scale {index} is of the type {str(kind)[:40]!r}, which is not known")


class _Properties:
    """The numbers of one scale."""

    def __init__(self, properties: Mapping[str, PropertyValue], prefix: str) -> None:
        self.properties = properties
        self.prefix = prefix

    def number(self, name: str) -> float:
        value = self.properties.get(self.prefix + name)
        if value is None:
            raise ScalingError(f"its scaling lacks {self.prefix}{name}"[:200])
        if isinstance(value, str | tuple) or not math.isfinite(value):
            raise ScalingError(f"{self.prefix}{name} is {str(value)[:40]!r}, which is no number to scale with")
        return float(value)

    def source(self, name: str = "Input_Source") -> int:
        if name == "Input_Source" and self.prefix + name not in self.properties:
            return RAW
        return int(self.number(name)) & 0xFFFFFFFF

    def count(self, name: str, default: int | None = None) -> int:
        if default is not None and self.prefix + name not in self.properties:
            return default
        value = self.number(name)
        if not 0 <= value <= MAX_POINTS:
            raise ScalingError(f"{self.prefix}{name} is {value:.9g}; 0 to {MAX_POINTS} are read")
        return int(value)

    def numbers(self, name: str, count: int) -> tuple[float, ...]:
        return tuple(self.number(f"{name}[{index}]") for index in range(count))

    def all(self) -> tuple[tuple[str, float], ...]:
        """All of them, as numbers; whole ones stay whole, they are codes."""
        found = []
        for name, value in self.properties.items():
            if name.startswith(self.prefix):
                number = self.number(name[len(self.prefix) :])
                found.append((name, value if isinstance(value, int) else number))
        return tuple(found)


def _table(read: _Properties) -> Scale:
    size = read.count("Pre_Scaled_Values_Size")
    if size != read.count("Scaled_Values_Size") or size == 0:
        raise ScalingError("its table has not as many scaled as stored values, or none")
    stored, scaled = read.numbers("Pre_Scaled_Values", size), read.numbers("Scaled_Values", size)
    if size > 1 and stored[0] > stored[-1]:
        stored, scaled = stored[::-1], scaled[::-1]
    if any(later <= earlier for earlier, later in pairwise(stored)):
        raise ScalingError("the stored values of its table neither rise nor fall throughout")
    return Scale("table", (read.source(),), (*stored, *scaled))


def _read_rtd(read: _Properties) -> Scale:
    *numbers, lead = (read.number(name) for name in RTD_NUMBERS)
    if 0.0 in (numbers[0], numbers[1], numbers[3]):
        raise ScalingError("its RTD scaling divides by zero")
    leads = {2: 2.0 * lead, 3: lead}.get(int(read.number("Resistance_Configuration")), 0.0)
    return Scale("rtd", (read.source(),), (*numbers, leads))


def _checked_sensor(scale: Scale) -> Scale:
    """Try a sensor's scaling on one value, so that what is wrong with it is said at the scan."""
    try:
        with np.errstate(all="ignore"):
            _sensor(scale).scale(np.array([1e-3]))
    except KeyError as error:
        raise ScalingError(f"its {scale.kind} scaling lacks {str(error.args[0])[:100]}") from error
    except ValueError:
        pass  # no solution for this one value
    except Exception as error:  # npTDMS raises the bare class for a bridge that it does not know
        raise ScalingError(f"its {scale.kind} scaling cannot be used ({str(error)[:100]})") from error
    return scale


def limits_of(scaling: Scaling | None, dtype: str) -> tuple[float, float] | None:
    """Smallest and largest value that integers of a type can give; None where the scaling turns back on itself."""
    info = np.iinfo(dtype)
    ends = (float(info.min), float(info.max))
    if scaling is None:
        return ends
    sources = [scale.sources[0] for _, scale in scaling.scales if scale.kind == "stored"]
    if len(sources) > 1 or any(scale.kind in (*SENSORS, "rtd") for _, scale in scaling.scales):
        return None
    values = scaling.apply({source: np.linspace(*ends, 257) for source in (sources or [RAW])})
    steps = np.diff(values)
    if not (np.isfinite(values).all() and ((steps > 0).all() or (steps < 0).all())):
        return None
    return float(values.min()), float(values.max())
