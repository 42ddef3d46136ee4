"""The report of the modelled side, section by section."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.reporting.document import Document, Sentences
from tdacoustic.results import FleetPrediction

__all__ = ["predicted_report"]


def predicted_report(result: FleetPrediction) -> Document:
    """Return the report on the modelled side of a fleet.

    Parameters
    ----------
    result : FleetPrediction
    """
    return Document(
        title=result.fleet.name,
        subtitle="Rapid model of the drive's gears",
        origin="calculated",
        summary=[Sentences(result.prediction.doubts)],
        footer=[f"Made with tdacoustic {__version__}."],
    )
