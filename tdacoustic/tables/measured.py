"""The tables of the measured side as views of its results."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from tdacoustic.attribution import Dominance, RunKinematics, SourceLine
from tdacoustic.attribution.kinds_of_evidence import ConditionAgreement
from tdacoustic.campaign import Campaign
from tdacoustic.measured.levels import ConditionLevels, RunLevel
from tdacoustic.measured.results import ChannelResult
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.tables.schema import COLUMNS
from tdacoustic.units import level_db

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["measured_tables"]


def measured_tables(
    campaign: Campaign,
    runs: Sequence[MeasuredRun],
    levels: ConditionLevels,
    sources: Sequence[SourceLine],
    dominance: Sequence[Dominance],
    kinematics: Mapping[str, RunKinematics],
    agreements: Mapping[str, ConditionAgreement] | None = None,
) -> dict[str, pd.DataFrame]:
    """Return ``quality``, ``levels``, ``bands``, ``lines``, ``sources`` and ``dominance`` as frames.

    With a fleet also ``kinematics``: speed and mesh of each steady run, calculated and observed.

    Parameters
    ----------
    campaign : Campaign
    runs : sequence of MeasuredRun
    levels : ConditionLevels
    sources, dominance : sequences
        Of the attribution.
    kinematics : mapping of str to RunKinematics
        By run; empty without a fleet.
    agreements : mapping of str to ConditionAgreement, optional
        By condition.
    """
    tested = [run for run in runs if run.run.kind == "test" and run.measurement is not None]
    rows: dict[str, Iterable[Row]] = {
        "quality": _quality_rows(campaign, runs),
        "levels": _level_rows(campaign, levels),
        "bands": _band_rows(tested),
        "lines": _line_rows(tested, kinematics),
        "sources": _source_rows(sources),
        "dominance": _dominance_rows(dominance, levels, agreements or {}),
    }
    if kinematics:
        rows["kinematics"] = _kinematic_rows(tested, kinematics)
    return {name: frame_of(name, table) for name, table in rows.items()}


def _quality_rows(campaign: Campaign, runs: Sequence[MeasuredRun]) -> Iterator[Row]:
    for run in runs:
        for verdict in run.all_verdicts:
            yield {"run": run.name, **{key: getattr(verdict, key) for key in ("channel", "check", "verdict", "detail")}}
    for level in campaign.levels:
        origin = level.origin or "origin not stated"
        words = f"{level.level_db:g} dB at {level.distance_m:g} m in condition {level.condition}, {origin}"
        yield {"run": "", "channel": "", "check": "level without log", "verdict": "ok", "detail": words}


def _components(run: MeasuredRun) -> Mapping[str, str | None]:
    return {} if run.recording is None else {channel.name: channel.component for channel in run.recording.channels}


def _level_rows(campaign: Campaign, levels: ConditionLevels) -> Iterator[Row]:
    yield from (_level_row(level) for level in levels.runs)
    for number, known in enumerate(campaign.levels, start=1):
        yield {
            "run": f"level {number}",
            "condition": known.condition,
            "train_speed_km_h": levels.train_speed_km_h.get(known.condition),
            "channel": f"{known.distance_m:g} m",
            "component": "air",
            "quantity": "sound_pressure",
            "rms": 20e-6 * 10.0 ** (known.level_db / 20.0) if known.weighting == "Z" else None,
            "level_db": known.level_db if known.weighting == "Z" else None,
            "reference": "20 uPa",
            "laeq_db": known.level_db if known.weighting == "A" else None,
            "correction": "none",
            "si_unit": "Pa",
            "distance_m": known.distance_m,
            "role": "receiver",
        }


def _level_row(level: RunLevel) -> Row:
    return {key: getattr(level, key) for key in COLUMNS["levels"].split()}


def _band_rows(runs: Sequence[MeasuredRun]) -> Iterator[Row]:
    for run, result in _usable(runs):
        quantity = _quantity(run, result)
        for band in result.bands:
            yield {
                "run": run.name,
                "condition": run.run.condition,
                "channel": result.channel,
                "band_hz": band.nominal_hz,
                "level_db": level_db(math.sqrt(band.mean_square), quantity),
                "filter_dependent": band.filter_dependent,
            }


def _usable(runs: Sequence[MeasuredRun]) -> Iterator[tuple[MeasuredRun, ChannelResult]]:
    for run in runs:
        if run.measurement is not None:
            yield from ((run, result) for result in run.measurement.channels if result.usable)


def _quantity(run: MeasuredRun, result: ChannelResult) -> str:
    return "other" if run.recording is None else run.recording[result.channel].quantity


def _line_rows(runs: Sequence[MeasuredRun], kinematics: Mapping[str, RunKinematics]) -> Iterator[Row]:
    for run, result in _usable(runs):
        quantity, component = _quantity(run, result), _components(run).get(result.channel)
        turns_hz = kinematics[run.name].motor_hz if run.name in kinematics else run.motor_speed_hz
        families = {
            index: f"{family.fundamental_hz:.6g} Hz x {number}"
            for family in result.families
            for index, number in family.members
        }
        for index, line in enumerate(result.lines):
            yield {
                "run": run.name,
                "condition": run.run.condition,
                "channel": result.channel,
                "component": component,
                "frequency_hz": line.frequency_hz,
                "frequency_error_hz": line.frequency_error_hz,
                "level_db": level_db(line.rms, quantity),
                "prominence_db": line.prominence_db,
                "order": line.frequency_hz / turns_hz if turns_hz else None,
                "family": families.get(index),
                "rms": line.rms,
            }


def _kinematic_rows(runs: Sequence[MeasuredRun], kinematics: Mapping[str, RunKinematics]) -> Iterator[Row]:
    for run in runs:
        found = kinematics.get(run.name)
        if found is not None:
            yield {
                "run": run.name,
                "condition": run.run.condition,
                "train_speed_km_h": run.run.train_speed_km_h or found.train_speed_km_h,
                "motor_speed_rpm": 60.0 * found.motor_hz,
                "speed_source": found.speed_source,
                "mesh_frequency_hz": found.mesh_hz,
                "observed_mesh_frequency_hz": found.observed_mesh_hz,
                "observed_mesh_error_hz": found.observed_error_hz,
                "mesh_excess": found.excess,
                "causes": found.causes,
            }


def _source_rows(sources: Sequence[SourceLine]) -> Iterator[Row]:
    for source in sources:
        yield {
            "condition": source.line.condition,
            "channel": source.line.channel,
            "frequency_hz": source.line.frequency_hz,
            "level_db": level_db(math.sqrt(source.line.mean_square), "sound_pressure"),
            "radiator": source.radiator,
            "excitation": source.excitation,
            "source": source.source,
            "conflict": source.conflict,
            "confidence": source.confidence,
            "evidence": source.evidence,
            "order_name": source.excitation_name,
            "frequency_error_hz": source.line.frequency_error_hz,
            "prominence_db": source.line.prominence_db,
        }


def _agreement_columns(found: ConditionAgreement | None) -> Row:
    """The kinds of evidence on the largest source, each alone, and how far they agree.

    ``<kind>_dominant`` is the likeliest source by that kind alone and ``<kind>_confidence`` its probability, both empty
    where the kind is silent; of the contributions ``unexplained`` where no sensor explains most, ``undecided`` where
    the probability is below 0.9. ``evidence_agreement``: ``agree``, ``disagree``, ``single`` or ``silent``;
    ``evidence_source`` and ``evidence_joint``: the source by all kinds together and its probability.
    """
    if found is None:
        return {}
    silent = found.agreement.silent
    sensor, order = ((None, None) if kind in silent else found.leading(kind) for kind in ("sensor", "order"))
    contribution = found.leading("contribution")
    return {
        "sensor_dominant": sensor[0],
        "sensor_confidence": sensor[1],
        "order_dominant": order[0],
        "order_confidence": order[1],
        "contribution_dominant": found.contribution_dominant,
        "contribution_confidence": contribution[1],
        "evidence_agreement": found.agreement.word,
        "evidence_source": found.agreement.source,
        "evidence_joint": found.agreement.probability,
        "evidence_words": "; ".join(part for part in (found.agreement.words, found.contribution_words) if part),
    }


def _dominance_rows(
    dominance: Sequence[Dominance], levels: ConditionLevels, agreements: Mapping[str, ConditionAgreement]
) -> Iterator[Row]:
    for verdict in dominance:
        yield {
            "condition": verdict.condition,
            "train_speed_km_h": levels.train_speed_km_h.get(verdict.condition),
            "weighting": "Z",
            "dominant": verdict.dominant,
            **{f"{name}_share": share for name, share in verdict.shares.items()},
            "line_fraction": verdict.line_fraction,
            "dominant_excitation": verdict.dominant_excitation,
            "confidence": verdict.confidence,
            "leading": verdict.leading,
            "n_runs": float(verdict.n_runs),
            "spread_db": verdict.spread_db,
            **_agreement_columns(agreements.get(verdict.condition)),
        }
