"""Tables of a calibration: values, levels, contributions, correlations, priors, posterior, the next measurement."""

from __future__ import annotations

from typing import Final

from tdacoustic.fitting.calibrated import FittedParameter
from tdacoustic.fitting.calibration import Calibration
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.reporting.document import Cell, Column, Shown, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.parameters import key_words, uncertain_words
from tdacoustic.reporting.sections.sound_paths import heard_paths
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import CampaignCalibration
from tdacoustic.studies.words import unit_of

__all__ = [
    "MOST_ROWS",
    "contributions_table",
    "correlation_table",
    "levels_table",
    "next_measurement_table",
    "parameters_table",
    "posterior_table",
    "sources_table",
    "transfer_table",
]

MOST_ROWS: Final = 8
"""Candidates for the next measurement that are shown."""

_WHAT: Final = {"overall": mark("overall"), "mesh order": mark("mesh order")}
_TITLES: Final = {
    "motor": (mark("Motor before"), mark("Motor after")),
    "mesh": (mark("Meshing before"), mark("Meshing after")),
    "structure": (mark("Structure before"), mark("Structure after")),
    "total": (mark("Total before"), mark("Total after")),
}
"""Of a path before and after the calibration."""


def parameters_table(found: Calibration) -> Table:
    """Return the fitted values with their intervals, bounds and priors."""
    columns = (
        Column("words", say("Parameter")),
        Column("unit", say("Unit")),
        Column("initial", say("Before"), kind="number"),
        Column("value", say("After"), kind="number"),
        Column("stderr", "±", "1 σ", kind="number"),
        Column("low", say("95 % from"), kind="number"),
        Column("high", say("95 % to"), kind="number"),
        Column("bounds", say("Bounds")),
        Column("prior", say("Prior or expression")),
        Column("parameter", say("Key")),
    )
    rows: list[list[Cell]] = []
    for p in found.parameters:
        low, high = (None, None) if p.ci95 is None else map(_end, p.ci95)
        before = p.expression or (say("none") if p.prior is None else f"{p.prior[0]:.4g} ± {p.prior[1]:.3g}")
        bounds, before = (pretty_signs(text) for text in (say("{low:g} to {high:g}", low=p.low, high=p.high), before))
        unit = unit_of(p.key) if "." in p.key else ""
        words = key_words(p.key, found.fleet)
        rows.append([words, unit, p.initial, *_with_error(p), low, high, bounds, before, p.key])
    caption = say(
        "Fitted parameters. ± is the standard error by linearisation at the fitted values; the interval is by profile "
        "likelihood, which follows the curved model and need not lie evenly about the value."
    )
    return Table("calibrated-parameters", caption, columns, rows, origin="calculated")


def _with_error(parameter: FittedParameter) -> tuple[Cell, Cell]:
    """A fitted value and its standard error, rounded for reading to what the error allows; whole in the download."""
    value, stderr = parameter.value, parameter.stderr
    if stderr is None or not stderr > 0.0:
        return value, stderr
    shown, error = uncertain_words(value, stderr)
    return Shown(shown, value), Shown(error, stderr)


def _end(value: float | None) -> Cell:
    """An end of an interval, three significant digits of it for reading."""
    return None if value is None else Shown(pretty_signs(f"{value:.3g}"), value)


def levels_table(result: CampaignCalibration) -> Table:
    """Return each datum beside the model before and after, and the prediction of each condition left out."""
    found = result.calibration
    left = {item.condition: item for item in found.left_out}
    columns = (
        Column("condition", say("Condition")),
        Column("train_speed_km_h", say("Speed"), "km/h", 1, "number"),
        Column("what", say("Level")),
        Column("receiver", say("At")),
        Column("origin", say("Standing"), kind="origin"),
        Column("measured_db", say("Held against"), "dB", 1, "number"),
        Column("before_db", say("Model before"), "dB", 1, "number"),
        Column("predicted_db", say("Model after"), "dB", 1, "number"),
        Column("error_db", say("After less level"), "dB", 1, "number"),
        Column("sigma_db", "σ", "dB", 1, "number"),
        Column("left_out_db", say("Condition left out"), say("model less level, dB"), 1, "number"),
        Column("left_out_sigma_db", say("its σ"), "dB", 1, "number"),
    )
    rows: list[list[Cell]] = []
    for level in found.levels:
        datum, others = level.datum, left.get(level.datum.group)
        rows.append(
            [
                datum.condition.name,
                datum.condition.train_speed_km_h,
                _what(datum) if datum.weighting == "Z" else say("{what}, A-weighted", what=_what(datum)),
                datum.receiver.name,
                datum.origin,
                datum.level_db,
                level.before_db,
                level.predicted_db,
                level.error_db,
                level.sigma_db,
                None if others is None else others.error_db,
                None if others is None else others.sigma_db,
            ]
        )
    return Table("calibration-levels", say("Levels and model by condition"), columns, rows)


def _what(datum: MeasuredLevel) -> str:
    """What of the sound a level is of; a third octave stays as it is named."""
    return say(_WHAT.get(datum.what, datum.what))


def sources_table(result: CampaignCalibration) -> Table:
    """Return where each datum and its standard deviation come from."""
    columns = (
        Column("condition", say("Condition")),
        Column("what", say("Level")),
        Column("receiver", say("At")),
        Column("sigma_db", say("Its own σ"), "dB", 2, "number"),
        Column("source", say("From")),
    )
    data = [level.datum for level in result.calibration.levels]
    rows: list[list[Cell]] = [[d.condition.name, _what(d), d.receiver.name, d.sigma_db, d.source] for d in data]
    return Table("calibration-level-sources", say("Where the levels come from"), columns, rows)


def contributions_table(found: Calibration) -> Table:
    """Return the level of each path at each receiver, before and after; of the structure where it has one."""
    heard = [path.key for path in heard_paths((*found.before, *found.after))]
    paths = [path for path in _TITLES if path != "structure" or path in heard]
    columns = (
        Column("condition", say("Condition")),
        Column("receiver", say("At")),
        *(
            Column(f"{path}_{side}_db", say(title), "dB", 1, "number")
            for path in paths
            for side, title in zip(("before", "after"), _TITLES[path], strict=True)
        ),
    )
    rows: list[list[Cell]] = []
    for before, after in zip(found.before, found.after, strict=True):
        for receiver in dict.fromkeys(level.receiver for level in before.levels):
            levels = [sound.level_db(receiver, path) for path in paths for sound in (before, after)]
            rows.append([before.condition, receiver, *levels])
    return Table("calibration-contributions-table", say("Contributions"), columns, rows, origin="calculated")


def correlation_table(found: Calibration) -> Table | None:
    """Return the correlation of the moved parameters; None of fewer than two, or where it cannot be had."""
    names = [parameter.key for parameter in found.moved]
    if found.correlation is None or len(names) < 2:
        return None
    columns = (
        Column("parameter", say("Parameter")),
        *(Column(f"with_{i}", name, digits=3, kind="number") for i, name in enumerate(names, 1)),
    )
    rows: list[list[Cell]] = [[name, *map(float, row)] for name, row in zip(names, found.correlation, strict=True)]
    return Table("calibration-correlation", say("Correlation of the parameters"), columns, rows, origin="calculated")


def next_measurement_table(found: Calibration) -> Table | None:
    """Return the most telling measurements that could be made; None where none was asked for."""
    held = found.next_measurements[:MOST_ROWS]
    if not held:
        return None
    names = list(held[0].remaining)
    columns = (
        Column("train_speed_km_h", say("Speed"), "km/h", 1, "number"),
        Column("torque_n_m", say("Torque"), "N m", 0, "number"),
        Column("receiver", say("At")),
        Column("expected_db", say("Expected"), "dB", 1, "number"),
        *(Column(f"remaining_{i}", name, say("interval left, %"), 0, "number") for i, name in enumerate(names, 1)),
    )
    rows: list[list[Cell]] = [
        [
            item.condition.train_speed_km_h,
            item.condition.torque_n_m,
            item.receiver.name,
            item.expected_db,
            *(100.0 * item.remaining[name] for name in names),
        ]
        for item in held
    ]
    return Table(
        "next-measurements", say("What one more level would do to the intervals"), columns, rows, origin="calculated"
    )


def posterior_table(found: Calibration) -> Table | None:
    """Return the sampled posterior with its convergence figures; None where none was sampled."""
    if found.posterior is None:
        return None
    columns = (
        Column("parameter", say("Parameter")),
        Column("median", say("Median"), kind="number"),
        Column("low", say("95 % from"), kind="number"),
        Column("high", say("95 % to"), kind="number"),
        Column("autocorrelation", say("Autocorrelation"), say("steps"), 1, "number"),
        Column("effective_samples", say("Effective samples"), digits=0, kind="number"),
        Column("r_hat", "R-hat", digits=3, kind="number"),
    )
    rows: list[list[Cell]] = [
        [p.key, p.median, *p.ci95, p.autocorrelation, p.effective_samples, p.r_hat] for p in found.posterior.parameters
    ]
    caption = say(
        "Posterior: {walkers} walkers, {steps} steps each, {acceptance:.0f} % of the proposals taken",
        walkers=found.posterior.walkers,
        steps=found.posterior.steps,
        acceptance=100.0 * found.posterior.acceptance,
    )
    return Table("calibration-posterior", caption, columns, rows, origin="calculated")


def transfer_table(found: Calibration) -> Table | None:
    """Return earlier values beside new ones; None where nothing was carried over."""
    if not found.transferred:
        return None
    columns = (
        Column("parameter", say("Parameter")),
        Column("earlier", say("Earlier fleet"), kind="number"),
        Column("earlier_stderr", "±", "1 σ", kind="number"),
        Column("prior_sigma", say("Prior here"), "1 σ", kind="number"),
        Column("alone", say("These data alone"), kind="number"),
        Column("alone_stderr", "±", "1 σ", kind="number"),
        Column("difference", say("Apart"), "σ", 1, "number"),
        Column("together", say("Together"), kind="number"),
        Column("origin", say("Where from")),
    )
    values = {parameter.key: parameter.value for parameter in found.parameters}
    rows: list[list[Cell]] = [
        [
            t.key,
            t.earlier,
            t.earlier_stderr,
            t.prior_sigma,
            t.alone,
            t.alone_stderr,
            t.difference,
            values[t.key],
            t.origin,
        ]
        for t in found.transferred
    ]
    return Table("calibration-transfer", say("The earlier fleet and this one"), columns, rows, origin="calculated")
