"""The modelled side of a fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tdacoustic.drive import Prediction
from tdacoustic.drive.patterns import Pattern, PatternPair, pattern_of, pattern_pairs
from tdacoustic.drive.what_if import WhatIfAnswer
from tdacoustic.fleet import Fleet
from tdacoustic.results.analysis import LogInput
from tdacoustic.steps import Record
from tdacoustic.steps.record import versions
from tdacoustic.studies import Studies

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["FleetPrediction"]


@dataclass(frozen=True)
class FleetPrediction:
    """The modelled side of a fleet.

    Parameters
    ----------
    fleet : Fleet
    prediction : Prediction
    tables : mapping of str to DataFrame
        ``conditions``, ``predictions``, ``sound_lines``, ``directivity``, ``bearing_forces``, ``helix``,
        ``speed_sweep``, ``coupling``, ``coupling_conditions``, ``near_field``, ``what_if``,
        ``patterns``, ``pattern_correlation``, ``sensitivity``, ``references``, ``features``, ``sweep_points``,
        ``sweeps``, ``sweep_sensitivity``.
    inputs : tuple of LogInput
        The fleet file.
    records : tuple of (str, Record)
        Key and record of every step.
    what_if : WhatIfAnswer or None
        What changes of the drive do to its levels.
    studies : Studies
        Sensitivities, design sweeps, and another source's numbers and features beside the model's.

    Examples
    --------
    ``predict("fleet.toml").tables["conditions"]`` is a pandas frame.
    """

    fleet: Fleet
    prediction: Prediction
    tables: Mapping[str, pd.DataFrame]
    inputs: tuple[LogInput, ...]
    records: tuple[tuple[str, Record], ...]
    what_if: WhatIfAnswer | None = None
    studies: Studies = field(default_factory=Studies)

    @property
    def patterns(self) -> tuple[Pattern, ...]:
        """The level around the drive in a few numbers, of each condition and helix angle."""
        return tuple(pattern_of(around) for around in self.prediction.directivity)

    @property
    def pattern_pairs(self) -> tuple[PatternPair, ...]:
        """How alike the levels around the drive of each two conditions, and of each two helix angles, are."""
        return pattern_pairs(self.prediction.directivity)

    @property
    def versions(self) -> dict[str, str]:
        """Versions of Python and the libraries that made the numbers."""
        return dict(next((record.libraries for _, record in self.records), versions()))
