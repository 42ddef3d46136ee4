"""Contributions of groups of references to receivers, by operational transfer-path analysis, with what they leave open.

A group's contribution is ``u_g = T_g x_g`` (`tdacoustic.contributions.transfer`); ``K[g, h]`` is the cross spectrum of
two of them, so that ``K[g, g]`` is the contribution's power, ``K[g, h]`` what both share, and what is not explained is
the power of ``y - sum u_g``. All powers are corrected for the scatter of the paths (in the mean a path that is none
would contribute the residual over the number of averages).

*What cross-talk does.* Solving for all paths at once does not undo cross-talk: ``T_g x_g`` carries what leaked into x_g
(P. Gajdatsy et al., Mech. Syst. Signal Process. 24 (2010) 1963). Let p_g be what source g, independent of the others,
really sends to the receiver. Sources are seen in other groups' references too, so ``u = B p``, the columns of B summing
to one. One state's K leaves B open: any rotation of the sources gives the same K, and two leaks of opposite phase give
no coherence at all. So a contribution is stated as known (``ok``) only where several states whose mix of sources
differs tell B, so well that three standard deviations lie within 3 dB (`tdacoustic.contributions.separation`); then p_g
is what is given. In all other cases K[g, g] is given, *flagged*, with the range of its readings:

- source g leaks into the others' references: then p_g has the power that group g explains **alone** (first in order);
- others leak into those of g: then it has what g explains **on top of** all others (last in order);
- both: to first order ``K[g, h] = conj(B[h, g]) P_g + B[g, h] P_h``, and as long as the two terms do not cancel,
  ``P_g / K[g, g]`` lies within ``(1 ± m)²``, ``m = sum_h |K[g, h]| / K[g, g]``.

The lower end leaves 3 dB at ``m = 1 - sqrt(1/2) = 0.293``, or where the coherence with the others reaches 0.5.

*Refused*, no number and an upper bound alone, where noise of the sensors makes the split, as on any rig with a single
source:

- a source makes up more than 95 % of another group's references, which then might as well be its owner, or less than
  5 % of its own;
- noise of the references, 20 dB below each [assumed], or what is given as such, would be worth more than a quarter of
  the source's sound after what the separation and the paths do to it;
- where the states do not tell the sources: other groups explain all but 5 % of what the group does.

*Flagged* too where a source without a reference could be mistaken for it: one as loud as the residual, R, that leaks
into the references at 10 dB below their power [assumed], changes the amplitude of a contribution P by
``sqrt(0.1 R / P)`` at most, 3 dB at ``P = 1.2 R``. One that leaks more is not seen by any of this: everything that is
loud needs a reference.

Neglected: sources that are coherent with each other, which have no contribution of their own; noise of the references,
which lowers the paths, but by rule ``"noise_floor"`` (the residual shows it).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions.matrices import explained_power, inverse_root
from tdacoustic.contributions.parts import GroupPart, Readings, SpanContributions, group_part, leading
from tdacoustic.contributions.separation import seen_shares, separate
from tdacoustic.contributions.states import HeldStates, OperatingState, PathSettings, Span
from tdacoustic.contributions.transfer import Transmissibility, state_weights, transmissibility
from tdacoustic.errors import AnalysisError

__all__ = ["path_contributions"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

CHUNK_BYTES: Final = 64 * 2**20
"""Matrices of all draws handled at once."""
UNTOLD: Final = 1.0
"""Variance of the logarithm of a line's power from which on the states are taken not to tell it."""
SENSOR_NOISE: Final = 0.01
"""Noise of a reference over its power, where it is not given [assumed]."""
WORST: Final = 2.0
"""Scatter of the logarithm of such a line's power, 9 dB [assumed]; all of a span's are wrong together."""


def path_contributions(
    states: Sequence[OperatingState],
    groups: Mapping[str, Sequence[str]],
    spans: Sequence[Span],
    settings: PathSettings | None = None,
    noise_density: Mapping[str, Array | float] | None = None,
) -> tuple[SpanContributions, ...]:
    """Split receivers' powers into contributions of groups of references, state by state and span by span.

    Parameters
    ----------
    states : sequence of OperatingState
        With the same references, receivers and lines; OTPA lives on states whose mix of sources differs.
    groups : mapping of str to sequence of str
        References of each component; those in none are not used. Constant channels are left out and named.
    spans : sequence of Span
    settings : PathSettings, optional
    noise_density : mapping of str to ndarray or float, optional
        Of each reference, per Hz, for rule ``"noise_floor"``.

    Returns
    -------
    tuple of SpanContributions
        One a span, state and receiver.

    Raises
    ------
    AnalysisError
        No states, states that do not fit together, a group without living references, a dead receiver, an unknown
        name, a span without lines, or too few averages.
    """
    settings = PathSettings() if settings is None else settings
    held = HeldStates(states, groups, settings, noise_density)
    summed = [_Summed(held, span) for span in spans]
    wanted = np.flatnonzero(np.any([one.width for one in summed], axis=0)) if summed else np.zeros(0, dtype=np.intp)
    n, q, p = held.settings.draws + 1, len(held.used), len(held.receivers)
    size = max(1, CHUNK_BYTES // (16 * n * len(held.states) * q * (q + p)))
    for start in range(0, wanted.size, size):
        chunk = wanted[start : start + size]
        lines = _Lines(held, chunk)
        for one in summed:
            inside = np.flatnonzero(one.width[chunk])
            if inside.size:
                one.add(lines, inside, one.width[chunk[inside]])
    return tuple(result for one in summed for result in one.results())


class _Lines:
    """Powers at some lines, of all states and draws."""

    def __init__(self, held: HeldStates, lines: NDArray[np.intp]) -> None:
        self.held = held
        self.member = np.zeros((len(held.used), len(held.groups)), dtype=np.complex128)  # whose each reference is
        for group, members in enumerate(held.members):
            self.member[members, group] = 1.0
        states = [held.matrices(state, lines) for state in range(len(held.states))]
        own = np.array([np.diagonal(s_xx[0], axis1=1, axis2=2).real for s_xx, _, _ in states])
        weights = state_weights(own, held.averages, held.settings.weighting)
        s_xx, s_xy, s_yy = (
            sum(
                weight[(slice(None), *[None] * (state[kind].ndim - 2))] * state[kind]
                for weight, state in zip(weights, states, strict=True)
            )
            for kind in range(3)
        )
        noise = None if held.noise is None else held.noise[lines] * weights.sum(axis=0)[:, None]
        n = float(held.averages.sum())
        found = transmissibility(s_xx, s_xy, s_yy, n, held.settings.rule, noise)
        self.components = found.freedom[0]
        pooled, bias = self._parts(found, s_xx)
        self.pooled = pooled[0] - bias[0]
        self.alone, self.on_top = self._readings(s_xx[0], s_xy[0], s_yy[0], found.residual[0])
        power = np.maximum(np.diagonal(self.pooled, axis1=-2, axis2=-1).real, 0.0)
        noise_part = power[..., :, None] * power[..., None, :] / n
        square = np.maximum(np.abs(self.pooled) ** 2 - noise_part, 0.0)
        leak = square * inverse_root(power)[..., None, :] ** 4  # |K_gh|² / K_hh²
        leak[..., np.arange(leak.shape[-1]), np.arange(leak.shape[-1])] = 0.0
        sensor_noise = SENSOR_NOISE * np.diagonal(s_xx[0], axis1=1, axis2=2).real if noise is None else noise
        self._separate(found, states, s_xx[0], sensor_noise)
        self.shared, self.total, self.residual, self.leaked = [], [], [], []
        for state, (xx, xy, yy) in enumerate(states):
            parts, bias = self._parts(found, xx)
            share = held.averages[state] / n
            lost = bias.sum(axis=(-2, -1)).real
            predicted = np.einsum("dfqp,dfqp->dfp", found.paths.conj(), xy).real
            self.residual.append(yy - 2.0 * predicted + parts.sum(axis=(-2, -1)).real + (2.0 * share - 1.0) * lost)
            parts = parts - bias
            self.shared.append(parts)
            self.total.append(yy)
            here = np.maximum(np.diagonal(parts[0], axis1=-2, axis2=-1).real, 0.0)
            self.leaked.append(np.einsum("fpgh,fph->fpg", leak, here))

    def _separate(
        self,
        found: Transmissibility,
        states: Sequence[tuple[Complex, Complex, Array]],
        s_xx: Complex,
        sensor_noise: Array,
    ) -> None:
        """The sources' own powers, line by line, from the states together."""
        first = Transmissibility(found.paths[:1], found.freedom[:1], found.spread[:1], found.residual[:1])
        shared = []
        for of_state, _, _ in states:
            parts, bias = self._parts(first, of_state[:1])
            shared.append((parts - bias)[0])
        stacked = np.array(shared)  # (n_states, n_lines, n_receivers, n_groups, n_groups)
        n_states, n_lines, p, g, _ = stacked.shape
        self.sources, self.variance = np.zeros((n_states, n_lines, p, g)), np.zeros((n_lines, p, g))
        self.source_power, self.noise = np.zeros((n_lines, p, g)), np.zeros((n_lines, p, g))
        self.seen = np.zeros((n_lines, p, g, g))
        members = [len(group) for group in self.held.members]
        starts = [group[0] for group in self.held.members]
        own = np.diagonal(s_xx, axis1=1, axis2=2).real
        for receiver in range(p):
            paths = found.paths[0, :, :, receiver]
            # Of references, scaled to unit power, and contributions of the groups.
            seen = np.add.reduceat(s_xx * paths[:, None, :] * inverse_root(own)[:, :, None], starts, axis=2)
            told = separate(np.moveaxis(stacked[:, :, receiver], 0, 1), self.held.averages, seen, members)
            self.sources[:, :, receiver] = np.moveaxis(told.power, 1, 0)
            self.variance[:, receiver] = told.variance
            weights = np.repeat(told.unmix, members, axis=2) * paths.conj()[:, None, :]  # a source by references
            power = np.einsum("fki,fij,fkj->fk", weights, s_xx, weights.conj(), optimize=True).real
            self.source_power[:, receiver] = power
            self.noise[:, receiver] = np.einsum("fki,fi->fk", np.abs(weights) ** 2, sensor_noise)
            shares = seen_shares(told.unmix, seen, members)
            self.seen[:, receiver] = shares * inverse_root(power)[:, None, :] ** 2

    def _parts(self, found: Transmissibility, s_xx: Complex) -> tuple[Complex, Complex]:
        """K and its bias, shape (n_draws, n_lines, n_receivers, n_groups, n_groups)."""
        paths = np.moveaxis(found.paths, -1, 2)[..., None] * self.member  # (..., n_receivers, n_references, n_groups)
        full = paths.conj().swapaxes(-1, -2) @ (s_xx[:, :, None] @ paths)
        scatter = s_xx[:, :, None] * found.spread.swapaxes(-1, -2)
        return full, self.member.T @ (scatter @ self.member)

    def _readings(self, s_xx: Complex, s_xy: Complex, s_yy: Array, residual: Array) -> tuple[Array, Array]:
        """What each group explains alone, and on top of all others, in the states together."""
        q, n = s_xx.shape[-1], float(self.held.averages.sum())
        whole, _ = explained_power(s_xx, s_xy, range(q))
        first, last = [], []
        for members in self.held.members:
            others = [index for index in range(q) if index not in members]
            alone, rank = explained_power(s_xx, s_xy, members)
            rest, _ = explained_power(s_xx, s_xy, others)
            left = np.maximum(s_yy - alone, 0.0) * (rank / np.maximum(n - rank, 1e-9))[:, None]
            first.append(alone - left)
            last.append(whole - rest - residual * len(members) / n)
        return np.stack(first, axis=-1), np.stack(last, axis=-1)


class _Summed:
    """Powers of a span, summed over its lines, of all draws."""

    def __init__(self, held: HeldStates, span: Span) -> None:
        self.held, self.span = held, span
        named = [state.name for state in held.states]
        self.chosen = [k for k, name in enumerate(named) if span.states is None or name in span.states]
        if not self.chosen:
            raise AnalysisError(f"span {span.name!r} is of no state; there are {', '.join(named)}")
        frequencies, step = held.frequencies_hz, held.resolution_hz
        self.width = span.width_hz(frequencies, step)
        self.n_lines = np.count_nonzero(self.width)
        if not self.n_lines or span.high_hz > frequencies[-1] + 0.5 * step or span.low_hz < 1.5 * step:
            raise AnalysisError(
                f"span {span.name!r}, {span.low_hz:g} to {span.high_hz:g} Hz, must lie between the third line and the "
                f"last, {2.0 * step:g} to {frequencies[-1]:g} Hz"
            )
        n, p, g = held.settings.draws + 1, len(held.receivers), len(held.groups)
        count = len(self.chosen)
        self.shared = np.zeros((count, n, p, g, g), dtype=np.complex128)
        self.total, self.residual = np.zeros((count, n, p)), np.zeros((count, n, p))
        self.pooled = np.zeros((p, g, g), dtype=np.complex128)
        self.alone, self.on_top = np.zeros((p, g)), np.zeros((p, g))
        self.leaked = np.zeros((count, p, g))
        self.sources, self.variance = np.zeros((count, p, g)), np.zeros((count, p, g))
        self.untold = np.zeros((count, p, g))
        self.noise, self.source_power = np.zeros((p, g)), np.zeros((p, g))
        self.seen, self.seen_weight = np.zeros((p, g, g)), np.zeros(p)
        self.components = np.zeros(p)

    def add(self, lines: _Lines, inside: NDArray[np.intp], width: Array) -> None:
        """Add lines inside, each by its part in Hz."""
        self.components += lines.components[inside].sum(axis=0) / self.n_lines
        for mine, theirs in (
            (self.pooled, lines.pooled),
            (self.alone, lines.alone),
            (self.on_top, lines.on_top),
            (self.source_power, lines.source_power),
            (self.noise, lines.noise),
        ):
            mine += np.tensordot(width, theirs[inside], axes=1)
        weight = width[:, None] * np.maximum(lines.source_power[inside], 0.0).sum(axis=-1)
        self.seen += np.einsum("fp,fphk->phk", weight, lines.seen[inside])
        self.seen_weight += weight.sum(axis=0)
        variance = lines.variance[inside]
        known = variance < UNTOLD
        for place, state in enumerate(self.chosen):
            power = width[:, None, None] * lines.sources[state][inside]
            self.sources[place] += power.sum(axis=0)
            self.variance[place] += (power**2 * np.where(known, variance, 0.0)).sum(axis=0)
            self.untold[place] += (power * ~known).sum(axis=0)
            self.leaked[place] += np.tensordot(width, lines.leaked[state][inside], axes=1)
            self.shared[place] += np.tensordot(width, lines.shared[state][:, inside], axes=(0, 1))
            self.total[place] += np.tensordot(width, lines.total[state][:, inside], axes=(0, 1))
            self.residual[place] += np.tensordot(width, lines.residual[state][:, inside], axes=(0, 1))

    def results(self) -> list[SpanContributions]:
        """One a state and receiver."""
        return [
            self._result(place, receiver)
            for place in range(len(self.chosen))
            for receiver in range(len(self.held.receivers))
        ]

    def _result(self, place: int, receiver: int) -> SpanContributions:
        held, state = self.held, self.held.states[self.chosen[place]]
        shared = self.shared[place][:, receiver]
        explained = shared.sum(axis=(-2, -1)).real
        residual = self.residual[place][:, receiver]
        probability, segments = held.settings.probability, int(np.count_nonzero(state.spectra.frames))
        parts = {}
        for group, name in enumerate(held.groups):
            readings = self._readings_of(place, receiver, group)
            draws = shared[:, group, group].real
            powers = float(explained[0]), max(0.0, float(residual[0]))
            parts[name] = group_part(draws, readings, *powers, segments, probability, len(held.states))
        parts = _with_what_is_missing(parts, float(self.total[place][0, receiver]), max(0.0, float(residual[0])))
        return SpanContributions.of(
            state=state.name,
            receiver=held.receivers[receiver],
            span=self.span.name,
            band_hz=(self.span.low_hz, self.span.high_hz),
            total=self.total[place][:, receiver],
            residual=residual,
            groups=parts,
            largest=leading(parts, shared, residual, held.settings.seed),
            probability=probability,
            segments=segments,
            components=float(self.components[receiver]),
            n_states=len(held.states),
            left_out=held.left_out,
        )

    def _readings_of(self, place: int, receiver: int, group: int) -> Readings:
        pooled = self.pooled[receiver]
        own, here = float(pooled[group, group].real), float(self.shared[place][0, receiver, group, group].real)
        others = [h for h in range(len(self.held.groups)) if h != group]
        source = float(self.sources[place, receiver, group])
        scatter = float(np.sqrt(self.variance[place, receiver, group])) + WORST * float(
            self.untold[place, receiver, group]
        )
        seen = self.seen[receiver] / max(float(self.seen_weight[receiver]), 1e-300)
        rival = max(others, key=lambda h: abs(pooled[group, h]), default=group)
        return Readings(
            alone=float(self.alone[receiver, group]) / own if own > 0.0 else np.inf,
            on_top=float(self.on_top[receiver, group]) / own if own > 0.0 else 0.0,
            alone_part=min(1.0, max(0.0, float(self.alone[receiver, group])) / max(float(pooled.sum().real), 1e-300)),
            crossed=float(np.abs(pooled[group, others]).sum()) / own if own > 0.0 else np.inf,
            leaked=float(self.leaked[place, receiver, group]) / here if here > 0.0 else np.inf,
            source=source,
            source_scatter=scatter / source if source > 0.0 else np.inf,
            own_share=float(seen[group, group]),
            share_elsewhere=max((float(seen[h, group]) for h in others), default=0.0),
            noise=float(self.noise[receiver, group] / self.source_power[receiver, group])
            if self.source_power[receiver, group] > 0.0
            else np.inf,
            rival=self.held.groups[rival] if others else "",
        )


def _with_what_is_missing(parts: Mapping[str, GroupPart], total: float, residual: float) -> dict[str, GroupPart]:
    """Widen known contributions to where parts and residual would add up to the whole, in proportion.

    Independent parts do add up. Where a state's paths are not those of all states together, power is missing.
    """
    held = sum(part.mean_square or 0.0 for part in parts.values())
    missing = total - residual - held
    if not (held > 0.0 and missing > 0.0):
        return dict(parts)
    wider = 1.0 + missing / held
    return {
        name: replace(part, high=part.high * wider) if part.verdict == "ok" else part for name, part in parts.items()
    }
