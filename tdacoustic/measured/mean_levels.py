"""Mean levels of conditions over runs and receivers, and how well they are known.

The standard deviation of a mean level is the root of the sum of squares of

- what the instruments and their calibration leave open, the same for every level;
- the scatter between runs over the root of their number. Two or three runs say little about their own scatter, so the
  squares of all conditions are pooled (each run's mean difference from the means of its receivers; one degree of
  freedom less than runs in each condition), and a condition with one run has the scatter of the others. Where no
  condition was run twice, what the record itself says takes its place, which holds nothing of what changes from run to
  run;
- where the mean stands for a whole surface, the scatter over its receivers over the root of their number, pooled
  alike. One receiver says nothing of the others.

A scatter of few degrees of freedom is widened by Student's quantile, so that ± one standard deviation holds 68 %.

Neglected: what all conditions share (a receiver in a lobe of the directivity, a wrong sensitivity) is one error, and
here it counts as one for each condition; scatter is taken in decibels, which for energies holds below about 3 dB.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from tdacoustic.measured.levels import energy_mean_db

__all__ = ["MeanLevel", "RecordedLevels", "Scatter", "mean_levels", "pooled_scatter"]

ONE_SIGMA: Final = 0.8413447460685429
"""Probability below one standard deviation of a normal distribution."""


@dataclass(frozen=True)
class RecordedLevels:
    """The levels of one condition.

    Parameters
    ----------
    levels_db : mapping of (str, str) to float
        By run and receiver.
    record_sigma_db : mapping of (str, str) to float
        Standard error of each that its own record shows, where it does.
    """

    levels_db: Mapping[tuple[str, str], float]
    record_sigma_db: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @property
    def runs(self) -> tuple[str, ...]:
        """Runs, each once."""
        return tuple(dict.fromkeys(run for run, _ in self.levels_db))

    def of_receivers(self) -> dict[str, float]:
        """Energy mean over the runs of each receiver."""
        held: dict[str, list[float]] = {}
        for (_, receiver), level_db in self.levels_db.items():
            held.setdefault(receiver, []).append(level_db)
        return {receiver: _energy_mean(levels) for receiver, levels in held.items()}

    def run_differences_db(self) -> list[float]:
        """Mean difference of each run from the receivers' means over the runs."""
        held: dict[str, list[float]] = {}
        for (_, receiver), level_db in self.levels_db.items():
            held.setdefault(receiver, []).append(level_db)
        means = {receiver: sum(levels) / len(levels) for receiver, levels in held.items()}
        differences: dict[str, list[float]] = {}
        for (run, receiver), level_db in self.levels_db.items():
            differences.setdefault(run, []).append(level_db - means[receiver])
        return [sum(values) / len(values) for values in differences.values()]

    def record_db(self) -> float | None:
        """Standard error of the mean that the records show; None where one of them shows nothing.

        Receivers of a run hear the same sound and scatter together; runs scatter each on its own.
        """
        if not self.levels_db or any(place not in self.record_sigma_db for place in self.levels_db):
            return None
        energy = {place: 10.0 ** (0.1 * level_db) for place, level_db in self.levels_db.items()}
        total = sum(energy.values())
        parts = dict.fromkeys(self.runs, 0.0)
        for place, value in energy.items():
            parts[place[0]] += value / total * self.record_sigma_db[place]
        return math.sqrt(sum(part**2 for part in parts.values()))


@dataclass(frozen=True)
class MeanLevel:
    """The mean level of a condition.

    Parameters
    ----------
    level_db, sigma_db : float
        Energy mean, and one standard deviation.
    words : str
        What went into both.
    """

    level_db: float
    sigma_db: float
    words: str


@dataclass(frozen=True)
class Scatter:
    """A standard deviation in dB, widened for its degrees of freedom.

    Parameters
    ----------
    plain_db : float
        Root of the pooled mean square.
    freedom : int
    """

    plain_db: float
    freedom: int

    @property
    def sigma_db(self) -> float:
        """So that ± one of it holds 68 %: Student's quantile times the plain one."""
        from scipy import stats

        return self.plain_db * float(stats.t.ppf(ONE_SIGMA, self.freedom))


def pooled_scatter(groups: Iterable[Sequence[float]]) -> Scatter | None:
    """Return the standard deviation within groups of levels, all groups taken together; None where none has two.

    Examples
    --------
    >>> found = pooled_scatter([[80.0, 82.0], [90.0, 90.0], [70.0]])
    >>> found.plain_db, found.freedom
    (1.0, 2)
    """
    square, freedom = 0.0, 0
    for levels in groups:
        mean = sum(levels) / len(levels) if levels else 0.0
        square += sum((level - mean) ** 2 for level in levels)
        freedom += max(0, len(levels) - 1)
    return Scatter(math.sqrt(square / freedom), freedom) if freedom else None


def mean_levels(
    conditions: Mapping[str, RecordedLevels], level_sigma_db: float, over_receivers: bool
) -> dict[str, MeanLevel]:
    """Return the energy mean over runs and receivers of each condition, with its standard deviation.

    Parameters
    ----------
    conditions : mapping of str to RecordedLevels
        Each with a level at least; their scatter is pooled.
    level_sigma_db : float
        Of the instruments and their calibration.
    over_receivers : bool
        Whether the receivers are samples of a surface, so that their scatter makes the mean uncertain.

    Examples
    --------
    >>> one = RecordedLevels({("1a", "left"): 80.0, ("1b", "left"): 80.0})
    >>> found = mean_levels({"1": one}, 0.3, over_receivers=False)["1"]
    >>> found.level_db, round(found.sigma_db, 3)
    (80.0, 0.3)
    """
    of_runs = pooled_scatter(held.run_differences_db() for held in conditions.values())
    of_receivers = None
    if over_receivers:
        of_receivers = pooled_scatter(list(held.of_receivers().values()) for held in conditions.values())
    found = {}
    for name, held in conditions.items():
        levels = held.of_receivers()
        parts = [("instruments", level_sigma_db), _of_runs(held, of_runs)]
        if over_receivers:
            parts.append(_over(of_receivers, len(levels), "receiver"))
        known = [part for _, part in parts if part is not None]
        words = ", ".join(f"{text} {part:.2g} dB" if part is not None else text for text, part in parts)
        counts = f"{_count(len(held.runs), 'run')}, {_count(len(levels), 'receiver')}"
        found[name] = MeanLevel(_energy_mean(levels.values()), math.hypot(*known), f"{counts}; sigma of {words}")
    return found


def _of_runs(held: RecordedLevels, scatter: Scatter | None) -> tuple[str, float | None]:
    if scatter is not None:
        return _over(scatter, len(held.runs), "run")
    record_db = held.record_db()
    if record_db is None:
        return "the spread between runs not known", None
    return "the record itself (no condition was run twice)", record_db


def _over(scatter: Scatter | None, number: int, what: str) -> tuple[str, float | None]:
    if scatter is None:
        return f"the spread over {what}s not known", None
    return f"{what}s (scatter over {scatter.freedom} degrees of freedom)", scatter.sigma_db / math.sqrt(number)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _energy_mean(levels_db: Iterable[float]) -> float:
    level_db = energy_mean_db(levels_db)
    assert level_db is not None  # a receiver is here because it has a level
    return level_db
