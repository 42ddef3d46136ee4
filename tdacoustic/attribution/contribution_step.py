"""Step: contributions of components to the receivers of a campaign, from the cross spectra of all its runs.

Paths are those of all operating states together, so the step takes all runs, alike by default (``"equal"``). What
sounds at a tone does so in few of them; in the others its sensors show a floor of their own, which need not sound and
then takes the path down. Where parts and residual of a tone do not add up to the whole, each state counts by its power
(``"power"``) instead, if that is known and adds up better: on the demonstration, whose tones are known, that is 1
instead of 2 dB below the truth. On a drive whose broadband sound takes the same path as its tones ``"equal"`` adds up,
and ``"power"`` alone would tell nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from tdacoustic.attribution.line_coherence import CoherentGroups, LineCoherence, line_coherences
from tdacoustic.contributions import (
    CrossSpectra,
    OperatingState,
    PathSettings,
    Span,
    SpanContributions,
    path_contributions,
)
from tdacoustic.contributions.matrices import explained_power
from tdacoustic.errors import AnalysisError
from tdacoustic.steps import Step
from tdacoustic.steps.progress import tell_progress

__all__ = [
    "CONTRIBUTIONS",
    "ContributionSettings",
    "Contributions",
    "RunState",
    "contributions_of_runs",
    "paths_changed",
]

SAME_LINES: Final = 1e-9
"""Relative difference of line spacings that are one."""
ADDS_UP: Final = 0.1
"""Part of the power that parts and residual may miss: 0.5 dB [assumed]."""
MISFIT: Final = 0.25
"""Part of the power that a state's own paths explain more than those of all states, from which on these do not fit it:
1.2 dB where all is explained [assumed]."""
CHANGED: Final = "paths differ from state to state"
ALONE: Final = "has sensors alone: what another source makes and is felt there too counts as its own"


@dataclass(frozen=True)
class RunState:
    """An operating state: a run, or its segments of one speed.

    Parameters
    ----------
    name : str
    source : str
        Name of the input with the run's cross spectra.
    segments : tuple of int or None
        Of a run-up, those about one speed; None for all.
    lines_hz : tuple of float
        Where its coherences are told; empty: at its loudest lines.
    """

    name: str
    source: str
    segments: tuple[int, ...] | None
    lines_hz: tuple[float, ...] = ()


@dataclass(frozen=True)
class ContributionSettings:
    """States, groups and spans of a campaign.

    Parameters
    ----------
    states : tuple of RunState
    groups : tuple of (str, tuple of str)
        Component and its references, which all states have.
    receivers : tuple of str
        A state may lack some.
    bands : tuple of Span
        Whole, broadband and bands: states count alike.
    tones : tuple of Span
        Lobes of tones and orders: states may count by their power.
    paths : PathSettings
    """

    states: tuple[RunState, ...]
    groups: tuple[tuple[str, tuple[str, ...]], ...]
    receivers: tuple[str, ...]
    bands: tuple[Span, ...]
    tones: tuple[Span, ...]
    paths: PathSettings


@dataclass(frozen=True)
class Contributions:
    """What the step returns.

    Parameters
    ----------
    found : tuple of SpanContributions
        One a span, state and receiver.
    coherences : tuple of LineCoherence
    coherent : tuple of CoherentGroups
        One a state; none where one component alone has references.
    left_out : tuple of (str, str)
        States, and why.
    """

    found: tuple[SpanContributions, ...]
    coherences: tuple[LineCoherence, ...]
    coherent: tuple[CoherentGroups, ...]
    left_out: tuple[tuple[str, str], ...]


def contributions_of_runs(settings: ContributionSettings, **spectra: CrossSpectra) -> Contributions:
    """Step: split the receivers' powers by the states of all runs.

    Raises
    ------
    AnalysisError
        No state is left, or see `tdacoustic.contributions.path_contributions`.
    """
    references = tuple(name for _, names in settings.groups for name in names)
    states, left_out = _states(settings, spectra)
    found: list[SpanContributions] = []
    sets: dict[tuple[str, ...], list[str]] = {}
    for receiver in settings.receivers:
        having = tuple(name for name, (held, _) in states.items() if receiver in held.receivers)
        if having:
            sets.setdefault(having, []).append(receiver)
    groups = dict(settings.groups)
    n_lines = min((held.plan.n_lines for held, _ in states.values()), default=0)
    for number, (having, receivers) in enumerate(sets.items()):
        held_states = [OperatingState(name, _only(states[name][0], references, receivers, n_lines)) for name in having]
        bands, tones = _spans_of(settings.bands, having), _spans_of(settings.tones, having)
        alike = path_contributions(held_states, groups, [*bands, *tones], settings.paths)
        tell_progress((number + 0.7) / len(sets))
        by_power = replace(settings.paths, weighting="power")
        loud = {
            _place(item): item for item in (path_contributions(held_states, groups, tones, by_power) if tones else ())
        }
        found += [_adding_up(item, loud.get(_place(item))) for item in alike]
        tell_progress((number + 1.0) / len(sets))
    by_name = {span.name: span for span in (*settings.bands, *settings.tones) if span.states is None}
    by_state = {(span.name, state): span for span in (*settings.bands, *settings.tones) for state in span.states or ()}
    own = {name: _Own(_only(held, references, held.receivers, n_lines)) for name, (held, _) in states.items()}
    found = [
        _fitting(item, own[item.state], by_state.get((item.span, item.state)) or by_name[item.span]) for item in found
    ]
    if len(settings.groups) == 1:
        found = [_of_one_group(item) for item in found]
    coherences: list[LineCoherence] = []
    coherent: list[CoherentGroups] = []
    for name, (held, lines_hz) in states.items():
        told, worst = line_coherences(name, _only(held, references, held.receivers, n_lines), groups, lines_hz)
        coherences += told
        coherent += [worst] if worst is not None else []
    return Contributions(tuple(found), tuple(coherences), tuple(coherent), tuple(left_out))


def _place(found: SpanContributions) -> tuple[str, str, str]:
    return found.span, found.state, found.receiver


def _adding_up(alike: SpanContributions, by_power: SpanContributions | None) -> SpanContributions:
    """Of two weightings of the states the second, where the first does not add up and the second does so better."""
    if by_power is None or _missing(alike) <= ADDS_UP or not _is_known(by_power):
        return alike
    return by_power if _missing(by_power) < _missing(alike) else alike


def _missing(found: SpanContributions) -> float:
    """Part of the power by which parts and residual miss the whole."""
    held = found.residual + sum(part.mean_square or 0.0 for part in found.groups.values())
    return abs(found.total - held) / found.total if found.total > 0.0 else 0.0


def _is_known(found: SpanContributions) -> bool:
    """Whether the loudest part is."""
    loudest = max(found.groups.values(), key=lambda part: part.path_mean_square)
    return loudest.verdict == "ok"


Held = tuple[CrossSpectra, tuple[float, ...]]


def _states(
    settings: ContributionSettings, spectra: dict[str, CrossSpectra]
) -> tuple[dict[str, Held], list[tuple[str, str]]]:
    """Spectra of each state and the lines of its coherences; those of another line spacing than most are left out."""
    steps = {state.name: spectra[state.source].plan.frames.resolution_hz for state in settings.states}
    usual = Counter(round(step, 9) for step in steps.values()).most_common(1)[0][0]
    held: dict[str, Held] = {}
    left_out = []
    for state in settings.states:
        if abs(steps[state.name] - usual) > SAME_LINES * usual + 1e-9:
            left_out.append(
                (state.name, f"its lines are {steps[state.name]:.5g} Hz apart, those of most {usual:.5g} Hz")
            )
            continue
        try:
            of_run = spectra[state.source]
            chosen = of_run if state.segments is None else of_run.select(state.segments)
        except AnalysisError as error:
            left_out.append((state.name, str(error)))
            continue
        held[state.name] = chosen, state.lines_hz
    if not held:
        raise AnalysisError("no operating state is left: " + "; ".join(f"{name}: {why}" for name, why in left_out))
    return held, left_out


def _only(spectra: CrossSpectra, references: Sequence[str], receivers: Sequence[str], n_lines: int) -> CrossSpectra:
    """Some channels of the spectra, up to a line."""
    rows = [spectra.references.index(name) for name in references]
    heard = [spectra.receivers.index(name) for name in receivers]
    columns = [*rows, *(len(spectra.references) + place for place in heard)]
    plan = replace(spectra.plan, n_lines=n_lines, n_references=len(rows), n_receivers=len(heard))
    density, receiver_density = spectra.density[..., :n_lines], spectra.receiver_density[..., :n_lines]
    if columns != list(range(density.shape[2])):  # a copy only where channels are left out: all runs' are held at once
        density, receiver_density = density[:, rows][:, :, columns], receiver_density[:, heard]
    return replace(
        spectra,
        plan=plan,
        references=tuple(references),
        receivers=tuple(receivers),
        density=density,
        receiver_density=receiver_density,
    )


def _spans_of(spans: Sequence[Span], states: Sequence[str]) -> list[Span]:
    """Spans with those of their states that there are; those of none dropped."""
    found = []
    for span in spans:
        names = None if span.states is None else tuple(name for name in span.states if name in states)
        if names is None or names:
            found.append(replace(span, states=names))
    return found


class _Own:
    """What all references explain of each receiver within a state alone, line by line."""

    def __init__(self, spectra: CrossSpectra) -> None:
        matrices = spectra.mean()
        self.frequencies_hz, self.step_hz = matrices.frequencies_hz, spectra.plan.frames.resolution_hz
        self.receivers = matrices.receivers
        power, rank = explained_power(matrices.s_xx, matrices.s_xy, range(len(matrices.references)))
        self.enough = matrices.averages > len(matrices.references)
        left = np.maximum(matrices.s_yy - power, 0.0) * (rank / np.maximum(matrices.averages - rank, 1.0))[:, None]
        self.explained, self.total = np.maximum(power - left, 0.0), matrices.s_yy

    def share(self, span: Span, receiver: str) -> float | None:
        """Part of a receiver's power in a span, corrected for its bias; None with too few averages."""
        place = self.receivers.index(receiver)
        width = span.width_hz(self.frequencies_hz, self.step_hz)
        total = float(width @ self.total[:, place])
        return float(width @ self.explained[:, place]) / total if self.enough and total > 0.0 else None


def _fitting(found: SpanContributions, own: _Own, span: Span) -> SpanContributions:
    """Flag what the paths of all states do not fit: the sensors explain more of it within this state alone."""
    alone = own.share(span, found.receiver)
    if alone is None or found.total <= 0.0 or alone - (1.0 - found.residual / found.total) < MISFIT:
        return found
    by_all = 100.0 * max(0.0, 1.0 - found.residual / found.total)
    reason = (
        f"{CHANGED}: alone, its sensors explain {100.0 * min(alone, 1.0):.0f} % of this sound, by the paths of all "
        f"states {by_all:.0f} %"
    )
    parts = {
        name: replace(part, verdict="flagged", reason=reason, high=max(part.high, alone * found.total), low=0.0)
        if part.verdict in ("ok", "flagged")
        else replace(part, high=max(part.high, alone * found.total))
        for name, part in found.groups.items()
    }
    return replace(found, groups=parts)


def paths_changed(found: SpanContributions) -> bool:
    """Whether the paths of all states do not fit this one: then its residual too is an upper bound."""
    return any(part.reason.startswith(CHANGED) for part in found.groups.values())


def _of_one_group(found: SpanContributions) -> SpanContributions:
    """Contributions where one component alone has references: nothing tells another source's part in it."""
    parts = {
        name: replace(part, verdict="flagged", reason=f"{name} {ALONE}") if part.verdict == "ok" else part
        for name, part in found.groups.items()
    }
    return replace(found, groups=parts)


CONTRIBUTIONS = Step("contributions", 2, contributions_of_runs, "Contributions of components, from all runs")
"""Inputs: the cross spectra of each run, under the names that the settings give them."""
