"""The modelled side of a fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tdacoustic.drive import Prediction
from tdacoustic.fleet import Fleet
from tdacoustic.results.analysis import LogInput
from tdacoustic.steps import Record
from tdacoustic.steps.record import versions

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
        ``speed_sweep``.
    inputs : tuple of LogInput
        The fleet file.
    records : tuple of (str, Record)
        Key and record of every step.

    Examples
    --------
    ``predict("fleet.toml").tables["conditions"]`` is a pandas frame.
    """

    fleet: Fleet
    prediction: Prediction
    tables: Mapping[str, pd.DataFrame]
    inputs: tuple[LogInput, ...]
    records: tuple[tuple[str, Record], ...]

    @property
    def versions(self) -> dict[str, str]:
        """Versions of Python and the libraries that made the numbers."""
        return dict(next((record.libraries for _, record in self.records), versions()))
