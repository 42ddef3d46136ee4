"""Kinds of values that several tables of a campaign share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo

__all__ = ["FrequencyBand", "NonNegative", "Positive", "StatedPath", "Table", "Text", "WrittenPath"]


class Table(BaseModel):
    """A table of ``campaign.toml``: frozen, no unknown keys, no conversion between types, no NaN or infinity."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True)
class WrittenPath:
    """A path as the file has it, and where that is.

    Parameters
    ----------
    text : str
        As written.
    path : Path
        Relative to the campaign's folder, a backslash read as ``/``.
    """

    text: str
    path: Path

    @classmethod
    def of(cls, text: str, folder: Path) -> WrittenPath:
        """Resolve a text against the campaign's folder."""
        return cls(text, folder / text.replace("\\", "/"))

    def __str__(self) -> str:
        return self.text


def _path(value: Any, info: ValidationInfo) -> WrittenPath:
    if isinstance(value, WrittenPath):
        return value
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"must be a path relative to the campaign file, got {value!r}")
    if "\0" in value:
        raise ValueError(f"must be a path, got {value!r}")
    return WrittenPath.of(value, (info.context or {}).get("folder", Path()))


def _text(value: str) -> str:
    if not value.strip():
        raise ValueError("must not be empty")
    return value


def _ascending(value: tuple[float, float]) -> tuple[float, float]:
    if not value[0] < value[1]:
        raise ValueError(f"must be [from, to] with from < to, got [{value[0]:g}, {value[1]:g}]")
    return value


Text = Annotated[str, AfterValidator(_text)]
"""A text that is not empty."""

Positive = Annotated[float, Field(gt=0.0)]
"""A finite number above zero."""

NonNegative = Annotated[float, Field(ge=0.0)]
"""A finite number, zero or above."""

FrequencyBand = Annotated[tuple[NonNegative, NonNegative], AfterValidator(_ascending)]
"""``[from, to]`` in Hz."""

StatedPath = Annotated[WrittenPath, BeforeValidator(_path)]
"""A path, resolved against the folder in the validation context."""
