"""Steps and tasks: what is computed, and the key it is known by."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from tdacoustic.errors import StoreError
from tdacoustic.steps.codec import canonical_json, fingerprint
from tdacoustic.steps.logfiles import LogFile

__all__ = ["Step", "Task"]

_READING = 2
"""Version of the reading of logs; raised by hand whenever a format's reader gives other samples for the same file."""


@dataclass(frozen=True)
class Step:
    """A named, versioned, pure function.

    Parameters
    ----------
    name : str
    version : int
        Of the step itself; raised by hand whenever its result changes for the
        same settings and inputs, so that old results are not taken for new ones.
    function : callable
        ``function(settings, **inputs) -> frozen dataclass``; a module-level
        function, so that another process can find it.
    title : str
        What it does, in words, for progress and the report's method section.
    """

    name: str
    version: int
    function: Callable[..., Any]
    title: str

    def task(self, label: str, settings: Any, **inputs: Task | LogFile | tuple[LogFile, ...]) -> Task:
        """Return the task of this step with settings and inputs."""
        return Task(self, label, settings, inputs)


@dataclass(frozen=True)
class Task:
    """A step, its settings and its inputs.

    Parameters
    ----------
    step : Step
    label : str
        What it is done to (``"run 1a"``), for progress; not part of the key.
    settings : dataclass
        All that the function reads besides its inputs.
    inputs : mapping of str to Task, LogFile or tuple of LogFile
        Results of other tasks, and logs. A log enters the key by its sha256 (of all its files, where it
        consists of several) alone, so a moved log is still the same log.
    """

    step: Step
    label: str
    settings: Any
    inputs: Mapping[str, Task | LogFile | tuple[LogFile, ...]] = field(default_factory=dict)

    @cached_property
    def key(self) -> str:
        """SHA-256 over the step's name and version, the settings and the inputs' keys."""
        parts = {
            "step": self.step.name,
            "version": self.step.version,
            "settings": fingerprint(self.settings),
            "inputs": {name: _input_key(value) for name, value in self.inputs.items()},
        }
        return hashlib.sha256(canonical_json(parts).encode()).hexdigest()

    @property
    def upstream(self) -> tuple[Task, ...]:
        """The tasks whose results this one needs."""
        return tuple(value for value in self.inputs.values() if isinstance(value, Task))


def _input_key(value: object) -> Any:
    if isinstance(value, Task):
        return value.key
    if isinstance(value, LogFile):
        return f"reading/{_READING} {value.key}"
    if isinstance(value, tuple):
        return [_input_key(item) for item in value]
    raise StoreError(f"a step's input must be a task or a log, got {type(value).__name__}")
