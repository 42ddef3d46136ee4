"""What binding a run's logs to the campaign's channels gives."""

from __future__ import annotations

from dataclasses import dataclass

from tdacoustic.recording import Recording

__all__ = ["Bound", "Refusal"]


@dataclass(frozen=True)
class Refusal:
    """A channel that a run cannot give.

    Parameters
    ----------
    run, channel : str
    reason : str
        A whole message: the channel, the run, the file, what is wrong, and which key would help.
    """

    run: str
    channel: str
    reason: str


@dataclass(frozen=True)
class Bound:
    """A run's recording, and what did not get into it.

    Parameters
    ----------
    recording : Recording
        The channels that could be bound, in the campaign's order; possibly none.
    refused : tuple of Refusal
    warnings : tuple of str
        What is usable but doubtful; each also stands in the flags of its channel.
    absent : tuple of str
        Channels of the campaign that the run was not asked for, as a calibrator run of another recorder.
    """

    recording: Recording
    refused: tuple[Refusal, ...] = ()
    warnings: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()
