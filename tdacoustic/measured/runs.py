"""The runs of a campaign with what was measured in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.campaign import CampaignRun
from tdacoustic.measured.results import RunMeasurement
from tdacoustic.quality import Verdict
from tdacoustic.recording import Recording, span_of

__all__ = ["MeasuredRun", "receivers", "receivers_of"]


@dataclass(frozen=True)
class MeasuredRun:
    """One run of a campaign and its measurement.

    Parameters
    ----------
    run : CampaignRun
    recording : Recording or None
        None where the run could not be read or is rejected.
    measurement : RunMeasurement or None
    verdicts : tuple of Verdict
        What stands outside the measurement: why it could not be read, flags of its logs, a rejection.
    """

    run: CampaignRun
    recording: Recording | None
    measurement: RunMeasurement | None
    verdicts: tuple[Verdict, ...] = ()

    @property
    def name(self) -> str:
        """Name of the run."""
        return self.run.name

    @property
    def all_verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts from outside and inside the measurement."""
        return self.verdicts + (self.measurement.verdicts if self.measurement is not None else ())

    @property
    def usable_channels(self) -> tuple[str, ...]:
        """Signal channels without a ``bad``."""
        if self.measurement is None:
            return ()
        return tuple(result.channel for result in self.measurement.channels if result.usable)

    @property
    def span_s(self) -> tuple[float, float] | None:
        """First and last instant of its signals; None where there is none."""
        return None if self.recording is None else span_of([c for c in self.recording.channels if not c.is_speed])

    @property
    def motor_speed_hz(self) -> float | None:
        """Steady speed of the motor's shaft in revolutions per second, measured or else stated; None for a run-up."""
        if self.measurement is None or not self.measurement.steady:
            return None
        profile = self.measurement.speed.of_shaft("motor")
        if profile is not None and profile.si_symbol == "1/s":
            return abs(profile.mean)
        return None if self.run.motor_speed_rpm is None else self.run.motor_speed_rpm / 60.0

    @property
    def train_speed_km_h(self) -> float | None:
        """The campaign's train speed, else a measured steady one."""
        if self.run.train_speed_km_h is not None:
            return self.run.train_speed_km_h
        if self.measurement is None or not self.measurement.steady:
            return None
        profile = next((p for p in self.measurement.speed.profiles if p.si_symbol == "m/s"), None)
        return None if profile is None else 3.6 * abs(profile.mean)


def receivers(runs: Sequence[MeasuredRun]) -> tuple[str, ...]:
    """Return the receivers of runs that could be read, as `receivers_of` does."""
    return receivers_of([run.recording for run in runs if run.recording is not None])


def receivers_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return the microphones that stand for the noise: those of role receiver, else all without a role."""
    channels = {channel.name: channel for recording in recordings for channel in recording.channels}
    microphones = [channel for channel in channels.values() if channel.quantity == "sound_pressure"]
    chosen = [channel for channel in microphones if channel.role == "receiver"]
    return tuple(channel.name for channel in chosen or [c for c in microphones if c.role is None])
