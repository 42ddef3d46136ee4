"""Kinds of tables and values that every file people write shares."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

__all__ = ["NonNegative", "Positive", "Table", "Text", "each_once"]


class Table(BaseModel):
    """A table of a TOML file: frozen, no unknown keys, no conversion between types, no NaN or infinity."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


def _text(value: str) -> str:
    if not value.strip():
        raise ValueError("must not be empty")
    return value


def each_once(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return values of which none may stand twice; for validators."""
    twice = next((value for i, value in enumerate(values) if value in values[:i]), None)
    if twice is not None:
        raise ValueError(f"names {twice!r} twice")
    return values


Text = Annotated[str, AfterValidator(_text)]
"""A text that is not empty."""

Positive = Annotated[float, Field(gt=0.0)]
"""A finite number above zero."""

NonNegative = Annotated[float, Field(ge=0.0)]
"""A finite number, zero or above."""
