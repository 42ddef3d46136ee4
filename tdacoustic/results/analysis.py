"""The measured side of a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tdacoustic.attribution import Dominance, RunKinematics, RunSlip, SourceLine
from tdacoustic.attribution.contributions import CampaignContributions
from tdacoustic.attribution.kinds_of_evidence import ConditionAgreement
from tdacoustic.attribution.mode_comparison import SpeedModes
from tdacoustic.campaign import Campaign
from tdacoustic.errors import AnalysisError
from tdacoustic.fleet import Fleet
from tdacoustic.measured import ChannelResult
from tdacoustic.measured.listening import Listening
from tdacoustic.measured.order_results import RunOrders
from tdacoustic.measured.run_clocks import RunClocks
from tdacoustic.measured.run_sensors import CampaignSensors
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.measured.tonality import Tonality
from tdacoustic.railway import RailwayMeasures
from tdacoustic.spectra import Spectrum
from tdacoustic.steps import Record
from tdacoustic.steps.record import versions

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Analysis", "LogInput"]


@dataclass(frozen=True)
class LogInput:
    """A log that entered the analysis."""

    written: str
    sha256: str
    n_bytes: int
    format: str


@dataclass(frozen=True)
class Analysis:
    """The measured side of a campaign.

    Parameters
    ----------
    campaign : Campaign
    runs : tuple of MeasuredRun
    sources : tuple of SourceLine
    dominance : tuple of Dominance
    tables : mapping of str to DataFrame
        ``quality``, ``levels``, ``bands``, ``lines``, ``sources``, ``dominance``, ``speeds``, and what else there is.
    problems : tuple of str
        What could not be done, one line each.
    inputs : tuple of LogInput
    records : tuple of (str, Record)
        Key and record of every step, upstream first.
    fleet : Fleet or None
    kinematics : mapping of str to RunKinematics
        By steady run; empty without a fleet.
    slips : mapping of str to tuple of RunSlip
        By run, where it has several speeds.
    tonality : Tonality or None
        Tones and levels over time of the microphones; None without a second pass.
    railway : RailwayMeasures or None
        None where the campaign asks for nothing of the railway standards.
    orders : mapping of str to RunOrders
        By run whose shaft's turns are known.
    contributions : CampaignContributions or None
        None where no run has sensors and microphones on one raster, or without a second pass.
    modes : tuple of SpeedModes, or None
        Traction, braking and coasting at one speed; None where no runs can be compared.
    agreements : mapping of str to ConditionAgreement
        By condition, the kinds of evidence on its dominant source; empty without a second pass.
    sensors : CampaignSensors
        Scales from a sensor database and from calibrators, and what calibrators say of all scales.
    clocks : mapping of str to RunClocks
        By run of several logs, how their times lie on one axis.
    listening : Listening or None
        Excerpts of the sound; None without a second pass, or where the campaign wants none.

    Examples
    --------
    ``analyze("campaign.toml").tables["levels"]`` is a pandas frame.
    """

    campaign: Campaign
    runs: tuple[MeasuredRun, ...]
    sources: tuple[SourceLine, ...]
    dominance: tuple[Dominance, ...]
    tables: Mapping[str, pd.DataFrame]
    problems: tuple[str, ...]
    inputs: tuple[LogInput, ...]
    records: tuple[tuple[str, Record], ...]
    fleet: Fleet | None = None
    kinematics: Mapping[str, RunKinematics] = field(default_factory=dict)
    slips: Mapping[str, tuple[RunSlip, ...]] = field(default_factory=dict)
    tonality: Tonality | None = None
    railway: RailwayMeasures | None = None
    orders: Mapping[str, RunOrders] = field(default_factory=dict)
    contributions: CampaignContributions | None = None
    modes: tuple[SpeedModes, ...] | None = None
    agreements: Mapping[str, ConditionAgreement] = field(default_factory=dict)
    sensors: CampaignSensors = field(default_factory=CampaignSensors)
    clocks: Mapping[str, RunClocks] = field(default_factory=dict)
    listening: Listening | None = None

    def result(self, run: str, channel: str) -> ChannelResult:
        """Return spectrum, levels and lines of a channel of a run.

        Raises
        ------
        AnalysisError
            There is no such run, or no such channel in it.
        """
        for measured in self.runs:
            if measured.name == run:
                found = measured.measurement.channel(channel) if measured.measurement is not None else None
                if found is None:
                    raise AnalysisError(f"run {run!r} has no channel {channel!r}")
                return found
        raise AnalysisError(f"no run {run!r}; there are {', '.join(m.name for m in self.runs)}")

    def spectrum(self, run: str, channel: str) -> Spectrum:
        """Return the averaged spectrum of a channel of a run.

        Raises
        ------
        AnalysisError
            There is none: a run-up is not averaged.
        """
        spectrum = self.result(run, channel).spectrum
        if spectrum is None:
            raise AnalysisError(f"run {run!r}, channel {channel!r}: a run-up has no averaged spectrum")
        return spectrum

    @property
    def settings(self) -> dict[str, Any]:
        """Every setting of ``[analysis]`` with its value."""
        return {key: value for key, value in self.campaign.settings.items() if key.startswith("analysis.")}

    @property
    def versions(self) -> dict[str, str]:
        """Versions of Python and the libraries that made the numbers."""
        return dict(next((record.libraries for _, record in self.records), versions()))
