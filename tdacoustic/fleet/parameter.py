"""A value and where it comes from."""

from __future__ import annotations

from typing import Any, Final, Generic, TypeVar, get_args

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from tdacoustic.toml_models import NonNegative, Text

__all__ = ["ASSUMED", "DEFAULT", "PARAMETER_KEYS", "Parameter", "default"]

ASSUMED: Final = "assumed"
"""Origin of a bare value in a fleet file."""

DEFAULT: Final = "assumed, default"
"""Origin of a value that the file leaves out and that has a default."""

PARAMETER_KEYS: Final = ("value", "origin", "stderr")
"""Keys of a parameter that is written as a table."""

T = TypeVar("T")


class Parameter(Generic[T]):
    """One parameter of a fleet file.

    In the file it is a bare value, which is assumed, or ``{ value = 7.35, origin = "paper, Table 3" }``.

    Parameters
    ----------
    value : T
        In the unit that its key names.
    origin : str
        Where it comes from, in words.
    stderr : float or None
        One standard deviation, of a calibrated value.

    Examples
    --------
    >>> Parameter(1051.12, "paper, Table 1").origin
    'paper, Table 1'
    >>> Parameter(120.0).is_assumed
    True
    """

    # no dataclass: of those pydantic makes its own schema where they are generic, and does not ask ours
    __slots__ = ("_origin", "_stderr", "_value")

    def __init__(self, value: T, origin: str = ASSUMED, stderr: float | None = None) -> None:
        self._value, self._origin, self._stderr = value, origin, stderr

    @property
    def value(self) -> T:
        """In the unit that its key names."""
        return self._value

    @property
    def origin(self) -> str:
        """Where it comes from, in words."""
        return self._origin

    @property
    def stderr(self) -> float | None:
        """One standard deviation, of a calibrated value."""
        return self._stderr

    @property
    def is_assumed(self) -> bool:
        """Whether nothing outside of us stands behind the value."""
        return self.origin.startswith(ASSUMED)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Parameter):
            return NotImplemented
        return (self.value, self.origin, self.stderr) == (other.value, other.origin, other.stderr)

    def __hash__(self) -> int:
        return hash((self.value, self.origin, self.stderr))

    def __repr__(self) -> str:
        stderr = "" if self.stderr is None else f", stderr={self.stderr!r}"
        return f"Parameter({self.value!r}, {self.origin!r}{stderr})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Parameter, (self.value, self.origin, self.stderr)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read a bare value, a table of `PARAMETER_KEYS`, or a `Parameter` again."""
        kind = (*get_args(source), Any)[0]
        fields = {
            "value": core_schema.typed_dict_field(handler.generate_schema(kind), required=True),
            "origin": core_schema.typed_dict_field(handler.generate_schema(Text), required=False),
            "stderr": core_schema.typed_dict_field(handler.generate_schema(NonNegative | None), required=False),
        }
        table = core_schema.typed_dict_schema(
            fields, extra_behavior="forbid", config={"strict": True, "allow_inf_nan": False}
        )
        made = core_schema.no_info_after_validator_function(lambda entries: cls(**entries), table)
        return core_schema.no_info_before_validator_function(_as_table, made)


def _as_table(value: Any) -> Any:
    if isinstance(value, Parameter):
        return {"value": value.value, "origin": value.origin, "stderr": value.stderr}
    return value if isinstance(value, dict) else {"value": value}


def default(value: T, origin: str = DEFAULT) -> Parameter[T]:
    """Return a parameter that a file may leave out."""
    return Parameter(value, origin)
