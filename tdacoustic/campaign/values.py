"""Paths and bands, which several tables of a campaign have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ValidationInfo

from tdacoustic.toml_models import NonNegative, address_problem, is_address, path_problem

__all__ = ["FrequencyBand", "StatedLog", "StatedPath", "WrittenPath", "ascending"]


@dataclass(frozen=True)
class WrittenPath:
    """A path as the file has it, and where that is.

    Parameters
    ----------
    text : str
        As written.
    path : Path
        Relative to the campaign's folder, a backslash read as ``/``. Of an address (a log's URL) where it was fetched
        to; its mere text before that.
    """

    text: str
    path: Path

    @classmethod
    def of(cls, text: str, folder: Path) -> WrittenPath:
        """Resolve a text against the campaign's folder; an address stands for itself."""
        return cls(text, Path(text)) if is_address(text) else cls(text, folder / text.replace("\\", "/"))

    def __str__(self) -> str:
        return self.text

    @property
    def url(self) -> str | None:
        """The text of an address, else None."""
        return self.text if is_address(self.text) else None

    @property
    def to_fetch(self) -> bool:
        """Whether it is an address that was not fetched yet."""
        return self.url is not None and self.path == Path(self.text)


def _path(value: Any, info: ValidationInfo) -> WrittenPath:
    if isinstance(value, WrittenPath):
        return value
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"must be a path relative to the campaign file, got {value!r}")
    problem = path_problem(value)
    if problem is not None:
        raise ValueError(f"must be a path: {value[:80]!r} {problem}")
    return WrittenPath.of(value, (info.context or {}).get("folder", Path()))


def _log(value: Any, info: ValidationInfo) -> WrittenPath:
    if not isinstance(value, str) or not is_address(value):
        return _path(value, info)
    problem = address_problem(value)
    if problem is not None:
        raise ValueError(f"must be a path or a URL: {value[:80]!r} {problem}")
    return WrittenPath.of(value, Path())


def ascending(value: tuple[float, float]) -> tuple[float, float]:
    """Return ``[from, to]`` that rises; for validators."""
    if not value[0] < value[1]:
        raise ValueError(f"must be [from, to] with from < to, got [{value[0]:g}, {value[1]:g}]")
    return value


FrequencyBand = Annotated[tuple[NonNegative, NonNegative], AfterValidator(ascending)]
"""``[from, to]`` in Hz."""

StatedLog = Annotated[WrittenPath, BeforeValidator(_log)]
"""A `StatedPath`, or a URL by the rule of `tdacoustic.toml_models.address_problem`."""

StatedPath = Annotated[WrittenPath, BeforeValidator(_path)]
"""A path by the rule of `tdacoustic.toml_models.paths`, resolved against the folder in the validation context."""
