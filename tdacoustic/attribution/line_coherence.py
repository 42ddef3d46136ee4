"""Coherences of an operating state at the lines that matter: sensors with receivers, and with each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions import (
    Coherence,
    CrossMatrices,
    CrossSpectra,
    multiple_coherence,
    ordinary_coherence,
    partial_coherence,
    reference_coherence,
)
from tdacoustic.errors import AnalysisError

__all__ = ["CoherentGroups", "LineCoherence", "line_coherences"]

LOUDEST: Final = 5
"""Lines at which the coherence of a state without noise lines is told."""
APART: Final = 4
"""Lines between two of them, at least."""


@dataclass(frozen=True)
class LineCoherence:
    """A coherence of a state at one line.

    Parameters
    ----------
    state : str
    kind : str
        ``ordinary``: a reference with a receiver; ``multiple``: all references together; ``partial``: a reference with
        a receiver once those of all other components are taken off; ``references``: two of different components.
    reference : str
        Empty for a multiple one.
    other : str
        Receiver, or the second reference.
    frequency_hz : float
        Of the line.
    value, corrected, low, high : float
        As estimated, without its bias, and the interval of 95 %.
    averages : float
    determined : bool
    """

    state: str
    kind: str
    reference: str
    other: str
    frequency_hz: float
    value: float
    corrected: float
    low: float
    high: float
    averages: float
    determined: bool


@dataclass(frozen=True)
class CoherentGroups:
    """The most coherent references of two components in a state, over the lines that are told, by their power."""

    state: str
    first: str
    second: str
    coherence: float


def line_coherences(
    state: str, spectra: CrossSpectra, groups: Mapping[str, tuple[str, ...]], lines_hz: Sequence[float]
) -> tuple[list[LineCoherence], CoherentGroups | None]:
    """Return the coherences at the lines that matter, and the most coherent references of two components.

    Parameters
    ----------
    state : str
    spectra : CrossSpectra
    groups : mapping of str to tuple of str
        Component and its references.
    lines_hz : sequence of float
        Empty: the loudest lines.
    """
    matrices = spectra.mean()
    matrices = replace(matrices, averages=_floored(matrices.averages))
    step = spectra.plan.frames.resolution_hz
    last = len(matrices.frequencies_hz) - 1
    loudness = np.asarray(matrices.s_yy.sum(axis=1))
    chosen = list(dict.fromkeys(round(hz / step) for hz in lines_hz if 2.0 * step <= hz <= last * step))
    chosen = chosen or _loudest(loudness)
    few = _at(matrices, chosen)
    owner = {name: group for group, names in groups.items() for name in names}
    told: list[LineCoherence] = []
    try:
        told += _rows(state, "ordinary", few, ordinary_coherence(few), few.references)
        told += _rows(state, "multiple", few, multiple_coherence(few), ("",))
        for group, names in groups.items():
            others = [name for name in few.references if owner[name] != group]
            if others:
                told += _rows(state, "partial", few, partial_coherence(few, names, others), names)
    except AnalysisError:  # fewer averages than references: the contributions say so
        pass
    between = reference_coherence(few)
    weight = loudness[chosen] / max(float(loudness[chosen].sum()), np.finfo(float).tiny)
    worst: CoherentGroups | None = None
    for i, first in enumerate(few.references):
        for j in range(i + 1, len(few.references)):
            second = few.references[j]
            if owner[first] == owner[second]:
                continue
            told += [_row(state, "references", first, second, between, (i, j), k) for k in range(len(chosen))]
            mean = float(between.corrected[i, j] @ weight)
            if worst is None or mean > worst.coherence:
                worst = CoherentGroups(state, first, second, mean)
    return told, worst


def _floored(averages: float) -> float:
    """Whole averages, many by fives: states then share the laws of their intervals, which take tenths of a second."""
    return float(np.floor(averages) if averages < 20.0 else 5.0 * np.floor(averages / 5.0))


def _loudest(loudness: NDArray[np.float64]) -> list[int]:
    """Lines of the receivers' highest peaks, some way apart."""
    chosen: list[int] = []
    for line in np.argsort(-loudness):
        if line >= 2 and all(abs(int(line) - other) >= APART for other in chosen):
            chosen.append(int(line))
        if len(chosen) == LOUDEST:
            break
    return sorted(chosen)


def _at(matrices: CrossMatrices, lines: Sequence[int]) -> CrossMatrices:
    at = list(lines)
    return replace(
        matrices,
        frequencies_hz=matrices.frequencies_hz[at],
        s_xx=matrices.s_xx[at],
        s_xy=matrices.s_xy[at],
        s_yy=matrices.s_yy[at],
    )


def _rows(
    state: str, kind: str, matrices: CrossMatrices, coherence: Coherence, references: Sequence[str]
) -> list[LineCoherence]:
    """Rows of a coherence of shape ([n_references,] n_receivers, n_lines)."""
    found = []
    for i, reference in enumerate(references):
        for j, receiver in enumerate(matrices.receivers):
            place = (j,) if kind == "multiple" else (i, j)
            found += [
                _row(state, kind, reference, receiver, coherence, place, k) for k in range(len(matrices.frequencies_hz))
            ]
    return found


def _row(
    state: str, kind: str, reference: str, other: str, coherence: Coherence, place: tuple[int, ...], line: int
) -> LineCoherence:
    at = (*place, line)
    return LineCoherence(
        state,
        kind,
        reference,
        other,
        float(coherence.frequencies_hz[line]),
        float(coherence.value[at]),
        float(coherence.corrected[at]),
        float(coherence.low[at]),
        float(coherence.high[at]),
        coherence.averages,
        bool(coherence.determined[at]),
    )
