"""Kinds of tables and values that every file people write shares."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

__all__ = ["NonNegative", "Positive", "Table", "Text"]


class Table(BaseModel):
    """A table of a TOML file: frozen, no unknown keys, no conversion between types, no NaN or infinity."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


def _text(value: str) -> str:
    if not value.strip():
        raise ValueError("must not be empty")
    return value


Text = Annotated[str, AfterValidator(_text)]
"""A text that is not empty."""

Positive = Annotated[float, Field(gt=0.0)]
"""A finite number above zero."""

NonNegative = Annotated[float, Field(ge=0.0)]
"""A finite number, zero or above."""
