"""Contributions of a whole campaign: its operating states, its spans, and what the step found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tdacoustic.attribution.contribution_spans import NamedSpan
from tdacoustic.attribution.contribution_step import Contributions
from tdacoustic.attribution.line_coherence import CoherentGroups, LineCoherence
from tdacoustic.contributions import SpanContributions

__all__ = ["CampaignContributions", "ContributionState"]


@dataclass(frozen=True)
class ContributionState:
    """An operating state.

    Parameters
    ----------
    name : str
        As the step knows it.
    run : str
    condition : str
    train_speed_km_h, motor_hz : float or None
        Of a run-up's state the mean over its segments.
    steady : bool
        Whether it is a whole steady run; else the segments of a run-up about one speed.
    """

    name: str
    run: str
    condition: str
    train_speed_km_h: float | None
    motor_hz: float | None
    steady: bool


@dataclass(frozen=True)
class CampaignContributions:
    """Contributions of a campaign.

    Parameters
    ----------
    groups : tuple of (str, tuple of str)
        Component and its references.
    states : tuple of ContributionState
    spans : tuple of NamedSpan
    result : Contributions
    notes : tuple of str
        Runs and channels left out, and why.
    """

    groups: tuple[tuple[str, tuple[str, ...]], ...]
    states: tuple[ContributionState, ...]
    spans: tuple[NamedSpan, ...]
    result: Contributions
    notes: tuple[str, ...]

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the groups."""
        return tuple(name for name, _ in self.groups)

    def state(self, name: str) -> ContributionState:
        """Return the state of that name."""
        return next(state for state in self.states if state.name == name)

    def rows(self) -> Iterator[tuple[ContributionState, NamedSpan, SpanContributions]]:
        """Yield what was found, state by state, with its state and span."""
        states = {state.name: state for state in self.states}
        held: dict[str, list[tuple[NamedSpan, SpanContributions]]] = {name: [] for name in states}
        named = {(item.span.name, name): item for item in self.spans for name in (item.span.states or tuple(states))}
        for found in self.result.found:
            held[found.state].append((named[found.span, found.state], found))
        for name, items in held.items():
            yield from ((states[name], span, found) for span, found in items)

    def coherent(self, state: str) -> CoherentGroups | None:
        """Return the most coherent references of two components in a state; None of one component."""
        return next((item for item in self.result.coherent if item.state == state), None)

    def coherences(self) -> Iterator[tuple[ContributionState, LineCoherence]]:
        """Yield the coherences with their states."""
        states = {state.name: state for state in self.states}
        yield from ((states[item.state], item) for item in self.result.coherences)
