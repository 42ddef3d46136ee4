"""Is it tonal: the tasks that hear the runs, and their tones rated and ascribed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.measured.hearing import ChannelAudibility, Hearing
from tdacoustic.measured.hearing_step import HEARING, METHODS, HearingSettings
from tdacoustic.measured.tasks import as_read
from tdacoustic.measured.tonality import RunTonality, RunTone, SpeedSpan, Tonality, ToneCurves
from tdacoustic.tones import audible_level_db, ecma_tones, label_tones, mean_audibility, prominent_level_db, rated_tone
from tdacoustic.tones.ecma_418 import NOTES as ECMA_LIMITS
from tdacoustic.tones.ecma_418 import EcmaTone
from tdacoustic.workflows.tone_origins import (
    NOBODY,
    SpeedOverTime,
    Stretch,
    ToneOrigin,
    expected_at,
    expected_in_run,
    known_origin,
    origin,
)

if TYPE_CHECKING:
    from tdacoustic.attribution import SourceLine
    from tdacoustic.measured import ChannelResult
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.steps import Task
    from tdacoustic.tones import ExpectedTone, RatedTone
    from tdacoustic.tones.label import ToneLike
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = ["ECMA", "KIND", "PROMINENCE", "RATIO", "hearing_tasks", "tonality"]

KIND: Final = "tones"
ECMA: Final = "ECMA-418-1:2024"
RATIO: Final = f"{ECMA} tone-to-noise ratio"
PROMINENCE: Final = f"{ECMA} prominence ratio"

MOST_CLASSES: Final = 12
"""Speed classes of a run-up at most."""
SAME_TONE_LINES: Final = 1.0
"""Tones of nobody in two spectra of a class no farther apart than this many lines are one [assumed, as in `tones`]."""
SMEARED: Final = 5e-3
"""Relative change of the speed within a spectrum from which on it is said that tones smear: 2.7 Hz at 540 Hz."""
CURVE_POINTS: Final = 100
CURVE_HZ: Final = (50.0, 15500.0)


def hearing_tasks(first: FirstPass) -> dict[str, Task]:
    """Return the task that hears each test run with a usable microphone, by run.

    Parameters
    ----------
    first : FirstPass
    """
    tasks = {}
    for run in first.measured:
        names = _microphones(run)
        if names and run.recording is not None:
            channels = tuple(as_read(run.recording[name]) for name in names)
            tasks[run.name] = HEARING.task(
                f"run {run.name}", HearingSettings(channels), logs=first.prepared[run.name].logs
            )
    return tasks


def _microphones(run: MeasuredRun) -> list[str]:
    if run.recording is None:
        return []
    return [name for name in run.usable_channels if run.recording[name].quantity == "sound_pressure"]


def tonality(first: FirstPass, second: SecondPass, sources: Sequence[SourceLine]) -> Tonality:
    """Rate the tones of all runs that were heard, each with its order and owner.

    Parameters
    ----------
    first : FirstPass
    second : SecondPass
    sources : sequence of SourceLine
        The noise lines whose source was judged.
    """
    heard: Mapping[str, Hearing] = second.of_kind(KIND)
    tones: list[RunTone] = []
    ratings: list[RunTonality] = []
    curves: list[ToneCurves] = []
    for run in first.measured:
        ratings += _unusable(first, run)
        if run.name not in heard:
            continue
        held = [source for source in sources if source.line.condition == run.run.condition]
        rate = _RunRating(first, run, heard[run.name], held)
        for channel in _microphones(run):
            rate.channel(channel)
        tones += rate.tones
        ratings += rate.ratings
        curves += rate.curves
    limits = [(method.name, method.limits) for method in METHODS] + [(ECMA, ECMA_LIMITS)]
    return Tonality(tuple(tones), tuple(ratings), tuple(curves), dict(heard), tuple(limits) if ratings else ())


def _unusable(first: FirstPass, run: MeasuredRun) -> Iterator[RunTonality]:
    """Microphones of a run that cannot be rated, and why."""
    assert run.measurement is not None
    wanted = {
        channel.name
        for channel in first.campaign.channels
        if channel.role in ("receiver", "near_field") or channel.scale.stated_quantity() == "sound_pressure"
    }
    if run.recording is not None:
        wanted |= {channel.name for channel in run.recording.channels if channel.quantity == "sound_pressure"}
    for name in sorted(wanted - set(_microphones(run))):
        said = [v.detail for v in run.measurement.verdicts if v.channel == name and v.verdict == "bad"]
        note = f"not rated, the channel cannot be used: {'; '.join(said) or 'no samples of it'}"
        for method in (*(method.name for method in METHODS), ECMA):
            yield RunTonality(run.name, run.run.condition, name, method, None, None, None, 0, (note,))


@dataclass(frozen=True)
class _Sighting:
    """A tone of one spectrum of a run-up."""

    frequency_hz: float
    frequency_error_hz: float
    level_db: float
    audibility_db: float


class _RunRating:
    """Rates the channels of one run and keeps the rows."""

    def __init__(self, first: FirstPass, run: MeasuredRun, hearing: Hearing, sources: Sequence[SourceLine]) -> None:
        assert run.measurement is not None
        self._run, self._hearing, self._sources = run, hearing, sources
        self._drive = first.drive(run)
        self._known = first.kinematics.get(run.name)
        self._expected = expected_in_run(self._known)
        self._steady = run.measurement.steady
        leading = run.measurement.speed.leading
        self._speed = None if self._steady or leading is None else SpeedOverTime(leading, self._drive)
        self.tones: list[RunTone] = []
        self.ratings: list[RunTonality] = []
        self.curves: list[ToneCurves] = []

    def channel(self, name: str) -> None:
        """Rate one channel by all methods."""
        for method in METHODS:
            rated = self._hearing.rated(name, method.name)
            if rated is None:
                why = self._hearing.reason(name, "audibility") or "not rated"
                self._rating(name, method.name, None, (why,))
            elif self._speed is None:
                self._steady_audibility(rated)
            else:
                self._run_up_audibility(rated, self._speed)
        self._ecma(name)

    # ------------------------------------------------------------ audibility

    def _rating(self, channel: str, method: str, rated: ChannelAudibility | None, notes: Iterable[str] = ()) -> None:
        """Add the row of a whole run."""
        said = (*(rated.notes if rated is not None else ()), *notes)
        self.ratings.append(
            RunTonality(
                self._run.name,
                self._run.run.condition,
                channel,
                method,
                None if rated is None else rated.mean_db,
                None if rated is None else rated.uncertainty_db,
                None if rated is None or not self._steady else rated.adjustment_db,
                0 if rated is None else int(rated.starts_s.size),
                tuple(said),
                run_up=not self._steady,
            )
        )

    def _steady_audibility(self, rated: ChannelAudibility) -> None:
        self._rating(rated.channel, rated.method, rated, _excluded_words(rated.excluded))
        for tone in rated.tones:
            found = self._origin(rated.channel, tone, rated.line_spacing_hz)
            self.tones.append(self._audible_tone(rated, tone, self._order(tone), found, None))

    def _audible_tone(
        self,
        rated: ChannelAudibility,
        tone: RatedTone,
        order: float | None,
        found: ToneOrigin,
        span: SpeedSpan | None,
    ) -> RunTone:
        heard = tone.over_threshold
        unheard = ("below the lower threshold of hearing",) if heard is False else ()
        return RunTone(
            run=self._run.name,
            condition=self._run.run.condition,
            channel=rated.channel,
            method=rated.method,
            frequency_hz=tone.frequency_hz,
            frequency_error_hz=tone.frequency_error_hz,
            level_db=tone.level_db,
            weighting="A",
            value_db=tone.audibility_db,
            criterion_db=0.0,
            prominent=None,
            audible=None if heard is None else heard and tone.audibility_db > 0.0,
            combined_into_hz=None,
            n_spectra=tone.n_spectra,
            order=order,
            owner=found.owner,
            excitation=found.excitation,
            notes=(*unheard, *found.notes),
            speed=span,
        )

    def _origin(self, channel: str, tone: ToneLike, spacing_hz: float) -> ToneOrigin:
        """Origin of a tone of a steady run."""
        known = known_origin(tone, channel, self._run.name, self._sources, spacing_hz)
        if known is not None:
            return known
        return origin(label_tones([tone], self._expected)[0])

    def _order(self, tone: ToneLike) -> float | None:
        turns_hz = self._run.motor_speed_hz if self._known is None else self._known.motor_hz
        return tone.frequency_hz / turns_hz if turns_hz else None

    # ------------------------------------------------------------ run-ups

    def _run_up_audibility(self, rated: ChannelAudibility, speed: SpeedOverTime) -> None:
        raster = next(raster for raster in self._hearing.rasters if rated.channel in raster.channels)
        starts = raster.start_s + rated.starts_s
        stretches = [speed.stretch(start, start + rated.averaging_s) for start in starts]
        known = {index: stretch for index, stretch in enumerate(stretches) if stretch is not None}
        changes = [stretch.change for stretch in known.values()]
        notes = ["a run-up: the mean is over unlike sounds, and there is no tone adjustment"]
        notes += _excluded_words(rated.excluded)
        if changes and max(changes) > SMEARED:
            notes.append(
                f"the speed changes by up to {100 * max(changes):.2g} % within a spectrum of {rated.averaging_s:.2g} s:"
                " tones that follow it smear, and are rated too low or not at all"
            )
        if len(known) < len(stretches):
            notes.append(f"spectra without a speed, in no speed class: {len(stretches) - len(known)}")
        self._rating(rated.channel, rated.method, rated, notes)
        for members in _speed_classes(known):
            self._speed_class(rated, speed, members)

    def _speed_class(self, rated: ChannelAudibility, speed: SpeedOverTime, members: Mapping[int, Stretch]) -> None:
        span, chosen = speed.span(list(members.values())), np.array(sorted(members))
        mean, uncertainty = mean_audibility(
            list(rated.decisive_db[chosen]), list(rated.decisive_uncertainty_db[chosen])
        )
        self.ratings.append(
            RunTonality(
                self._run.name,
                self._run.run.condition,
                rated.channel,
                rated.method,
                mean,
                uncertainty,
                None,
                len(members),
                (),
                span,
                run_up=True,
            )
        )
        assert self._run.recording is not None
        highest_hz = 0.5 * self._run.recording[rated.channel].sample_rate_hz
        for found, held in _one_tone_each(rated, members, self._drive_expects(members, highest_hz)):
            tone = rated_tone([sighting for _, sighting in held], len(members))
            orders = [s.frequency_hz / turns for index, s in held if (turns := members[index].motor_hz)]
            order = float(np.mean(orders)) if orders else None
            self.tones.append(self._audible_tone(rated, tone, order, found, span))

    def _drive_expects(self, members: Mapping[int, Stretch], highest_hz: float) -> dict[int, tuple[ExpectedTone, ...]]:
        return {index: expected_at(self._drive, stretch, highest_hz) for index, stretch in members.items()}

    # ------------------------------------------------------------ ECMA-418-1

    def _ecma(self, name: str) -> None:
        assert self._run.measurement is not None
        result = self._run.measurement.channel(name)
        if result is None or result.spectrum is None:
            self._rating(name, ECMA, None, ("not rated: the speed changes, there is no averaged spectrum",))
            return
        found = ecma_tones(result.spectrum, result.lines)
        n_prominent = sum(bool(t.tone_to_noise_prominent or t.prominence_prominent) for t in found.tones)
        words = "it gives no mean audibility", f"prominent tones: {n_prominent} of {len(found.tones)}"
        row = RunTonality(
            self._run.name, self._run.run.condition, name, ECMA, None, None, None, 1,
            (*words, *_excluded_words(found.excluded)),
        )  # fmt: skip
        self.ratings.append(row)
        for tone in found.tones:
            self.tones += self._ecma_rows(name, tone, result.spectrum.resolution_hz)
        self._curve(name, result)

    def _ecma_rows(self, name: str, tone: EcmaTone, spacing_hz: float) -> list[RunTone]:
        found = self._origin(name, tone, spacing_hz)
        of_ratio = tone.tone_to_noise_db, tone.tone_to_noise_criterion_db, tone.tone_to_noise_prominent
        of_prominence = tone.prominence_db, tone.prominence_criterion_db, tone.prominence_prominent
        rows = []
        for method, (value_db, criterion_db, prominent) in ((RATIO, of_ratio), (PROMINENCE, of_prominence)):
            rows.append(
                RunTone(
                    run=self._run.name,
                    condition=self._run.run.condition,
                    channel=name,
                    method=method,
                    frequency_hz=tone.frequency_hz,
                    frequency_error_hz=tone.frequency_error_hz,
                    level_db=tone.level_db,
                    weighting="Z",
                    value_db=value_db,
                    criterion_db=criterion_db,
                    prominent=prominent,
                    audible=tone.audible,
                    combined_into_hz=tone.combined_into_hz if method == RATIO else None,
                    n_spectra=1,
                    order=self._order(tone),
                    owner=found.owner,
                    excitation=found.excitation,
                    notes=(*tone.notes, *found.notes),
                )
            )
        return rows

    def _curve(self, name: str, result: ChannelResult) -> None:
        if result.spectrum is None or result.floor is None:
            return
        frequencies = np.geomspace(*CURVE_HZ, CURVE_POINTS)
        prominent = prominent_level_db(result.spectrum, result.floor, frequencies)
        audible = audible_level_db(result.spectrum, result.floor, frequencies)
        if np.isfinite(audible).any():
            self.curves.append(ToneCurves(self._run.name, name, frequencies, prominent, audible))


def _excluded_words(excluded: Sequence[tuple[float, str]]) -> tuple[str, ...]:
    """Tones that a method does not rate, counted by the reason."""
    reasons: dict[str, list[float]] = {}
    for frequency_hz, reason in excluded:
        # Reasons that name the tone's own band, or a line beside it, are one kind each.
        kind = "its critical band reaches beyond the spectrum" if reason.startswith("its critical band") else reason
        kind = "a line that was found twice" if reason.startswith("the same line") else kind
        reasons.setdefault(kind, []).append(frequency_hz)
    return tuple(
        f"not rated: {len(found)} {'tone' if len(found) == 1 else 'tones'} "
        f"({min(found):.0f}" + (f" to {max(found):.0f}" if len(found) > 1 else "") + f" Hz), {reason}"
        for reason, found in reasons.items()
    )


def _speed_classes(stretches: Mapping[int, Stretch]) -> Iterator[dict[int, Stretch]]:
    """Yield the stretches of a run-up class by class, equally wide from the slowest to the fastest."""
    if not stretches:
        return
    means = [stretch.mean for stretch in stretches.values()]
    low, width = min(means), (max(means) - min(means)) / min(MOST_CLASSES, len(stretches))
    classes: dict[int, dict[int, Stretch]] = {}
    for index, stretch in stretches.items():
        number = min(int((stretch.mean - low) / width), MOST_CLASSES - 1) if width > 0.0 else 0
        classes.setdefault(number, {})[index] = stretch
    for number in sorted(classes):
        yield classes[number]


def _one_tone_each(
    rated: ChannelAudibility, members: Mapping[int, Stretch], expected: Mapping[int, Sequence[ExpectedTone]]
) -> Iterator[tuple[ToneOrigin, list[tuple[int, _Sighting]]]]:
    """Yield the tones of a speed class: those of one excitation together, those of nobody by their frequency."""
    seen = rated.seen
    named: dict[ToneOrigin, list[tuple[int, _Sighting]]] = {}
    nobody: list[list[tuple[int, _Sighting]]] = []
    for place in np.argsort(seen.frequency_hz, kind="stable"):
        index = int(seen.spectrum[place])
        if index not in members:
            continue
        sighting = _Sighting(
            float(seen.frequency_hz[place]),
            float(seen.frequency_error_hz[place]),
            float(seen.level_db[place]),
            float(seen.audibility_db[place]),
        )
        found = origin(label_tones([sighting], expected[index])[0])
        if found != NOBODY:
            named.setdefault(found, []).append((index, sighting))
            continue
        last = nobody[-1] if nobody else []
        near = (
            bool(last) and sighting.frequency_hz - last[-1][1].frequency_hz <= SAME_TONE_LINES * rated.line_spacing_hz
        )
        if near and all(index != other for other, _ in last):
            last.append((index, sighting))
        else:
            nobody.append([(index, sighting)])
    for found, held in named.items():
        yield found, _strongest(held)
    for held in nobody:
        yield NOBODY, held


def _strongest(held: Sequence[tuple[int, _Sighting]]) -> list[tuple[int, _Sighting]]:
    """Of several tones of one spectrum that carry one name the most audible."""
    best: dict[int, _Sighting] = {}
    for index, sighting in held:
        if index not in best or sighting.audibility_db > best[index].audibility_db:
            best[index] = sighting
    return sorted(best.items())
