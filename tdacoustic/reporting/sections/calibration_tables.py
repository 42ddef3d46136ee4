"""Tables of a calibration: values, levels, contributions, correlations, priors, posterior, the next measurement."""

from __future__ import annotations

from typing import Final

from tdacoustic.fitting.calibration import Calibration
from tdacoustic.reporting.document import Cell, Column, Table
from tdacoustic.reporting.sections.parameters import key_words
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


def parameters_table(found: Calibration) -> Table:
    """Return the fitted values with their intervals, bounds and priors."""
    columns = (
        Column("words", "Parameter"),
        Column("unit", "Unit"),
        Column("initial", "Before", kind="number"),
        Column("value", "After", kind="number"),
        Column("stderr", "±", "1 σ", kind="number"),
        Column("low", "95 % from", kind="number"),
        Column("high", "95 % to", kind="number"),
        Column("bounds", "Bounds"),
        Column("prior", "Prior or expression"),
        Column("parameter", "Key"),
    )
    rows: list[list[Cell]] = []
    for p in found.parameters:
        low, high = (None, None) if p.ci95 is None else p.ci95
        before = p.expression or ("none" if p.prior is None else f"{p.prior[0]:.4g} ± {p.prior[1]:.3g}")
        bounds, before = (pretty_signs(text) for text in (f"{p.low:g} to {p.high:g}", before))
        unit = unit_of(p.key) if "." in p.key else ""
        words = key_words(p.key, found.fleet)
        rows.append([words, unit, p.initial, p.value, p.stderr, low, high, bounds, before, p.key])
    return Table("calibrated-parameters", "Fitted parameters", columns, rows, origin="calculated")


def levels_table(result: CampaignCalibration) -> Table:
    """Return each datum beside the model before and after, and the prediction of each condition left out."""
    found = result.calibration
    left = {item.condition: item for item in found.left_out}
    columns = (
        Column("condition", "Condition"),
        Column("train_speed_km_h", "Speed", "km/h", 1, "number"),
        Column("what", "Level"),
        Column("receiver", "At"),
        Column("origin", "Standing", kind="origin"),
        Column("measured_db", "Held against", "dB", 1, "number"),
        Column("before_db", "Model before", "dB", 1, "number"),
        Column("predicted_db", "Model after", "dB", 1, "number"),
        Column("error_db", "After less level", "dB", 1, "number"),
        Column("sigma_db", "σ", "dB", 1, "number"),
        Column("left_out_db", "Condition left out", "model less level, dB", 1, "number"),
        Column("left_out_sigma_db", "its σ", "dB", 1, "number"),
    )
    rows: list[list[Cell]] = []
    for level in found.levels:
        datum, others = level.datum, left.get(level.datum.group)
        rows.append(
            [
                datum.condition.name,
                datum.condition.train_speed_km_h,
                datum.what if datum.weighting == "Z" else f"{datum.what}, A-weighted",
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
    return Table("calibration-levels", "Levels and model by condition", columns, rows)


def sources_table(result: CampaignCalibration) -> Table:
    """Return where each datum and its standard deviation come from."""
    columns = (
        Column("condition", "Condition"),
        Column("what", "Level"),
        Column("receiver", "At"),
        Column("sigma_db", "Its own σ", "dB", 2, "number"),
        Column("source", "From"),
    )
    data = [level.datum for level in result.calibration.levels]
    rows: list[list[Cell]] = [[d.condition.name, d.what, d.receiver.name, d.sigma_db, d.source] for d in data]
    return Table("calibration-level-sources", "Where the levels come from", columns, rows)


def contributions_table(found: Calibration) -> Table:
    """Return the level of each path at each receiver, before and after; of the structure where it has one."""
    heard = [path.key for path in heard_paths((*found.before, *found.after))]
    titles = {"motor": "Motor", "mesh": "Meshing", "structure": "Structure", "total": "Total"}
    titles = {path: title for path, title in titles.items() if path != "structure" or path in heard}
    columns = (
        Column("condition", "Condition"),
        Column("receiver", "At"),
        *(
            Column(f"{path}_{side}_db", f"{title} {side}", "dB", 1, "number")
            for path, title in titles.items()
            for side in ("before", "after")
        ),
    )
    rows: list[list[Cell]] = []
    for before, after in zip(found.before, found.after, strict=True):
        for receiver in dict.fromkeys(level.receiver for level in before.levels):
            levels = [sound.level_db(receiver, path) for path in titles for sound in (before, after)]
            rows.append([before.condition, receiver, *levels])
    return Table("calibration-contributions-table", "Contributions", columns, rows, origin="calculated")


def correlation_table(found: Calibration) -> Table | None:
    """Return the correlation of the moved parameters; None of fewer than two, or where it cannot be had."""
    names = [parameter.key for parameter in found.moved]
    if found.correlation is None or len(names) < 2:
        return None
    columns = (
        Column("parameter", "Parameter"),
        *(Column(f"with_{i}", name, digits=3, kind="number") for i, name in enumerate(names, 1)),
    )
    rows: list[list[Cell]] = [[name, *map(float, row)] for name, row in zip(names, found.correlation, strict=True)]
    return Table("calibration-correlation", "Correlation of the parameters", columns, rows, origin="calculated")


def next_measurement_table(found: Calibration) -> Table | None:
    """Return the most telling measurements that could be made; None where none was asked for."""
    held = found.next_measurements[:MOST_ROWS]
    if not held:
        return None
    names = list(held[0].remaining)
    columns = (
        Column("train_speed_km_h", "Speed", "km/h", 1, "number"),
        Column("torque_n_m", "Torque", "N m", 0, "number"),
        Column("receiver", "At"),
        Column("expected_db", "Expected", "dB", 1, "number"),
        *(Column(f"remaining_{i}", name, "interval left, %", 0, "number") for i, name in enumerate(names, 1)),
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
        "next-measurements", "What one more level would do to the intervals", columns, rows, origin="calculated"
    )


def posterior_table(found: Calibration) -> Table | None:
    """Return the sampled posterior with its convergence figures; None where none was sampled."""
    if found.posterior is None:
        return None
    columns = (
        Column("parameter", "Parameter"),
        Column("median", "Median", kind="number"),
        Column("low", "95 % from", kind="number"),
        Column("high", "95 % to", kind="number"),
        Column("autocorrelation", "Autocorrelation", "steps", 1, "number"),
        Column("effective_samples", "Effective samples", digits=0, kind="number"),
        Column("r_hat", "R-hat", digits=3, kind="number"),
    )
    rows: list[list[Cell]] = [
        [p.key, p.median, *p.ci95, p.autocorrelation, p.effective_samples, p.r_hat] for p in found.posterior.parameters
    ]
    caption = (
        f"Posterior: {found.posterior.walkers} walkers, {found.posterior.steps} steps each, "
        f"{100.0 * found.posterior.acceptance:.0f} % of the proposals taken"
    )
    return Table("calibration-posterior", caption, columns, rows, origin="calculated")


def transfer_table(found: Calibration) -> Table | None:
    """Return earlier values beside new ones; None where nothing was carried over."""
    if not found.transferred:
        return None
    columns = (
        Column("parameter", "Parameter"),
        Column("earlier", "Earlier fleet", kind="number"),
        Column("earlier_stderr", "±", "1 σ", kind="number"),
        Column("prior_sigma", "Prior here", "1 σ", kind="number"),
        Column("alone", "These data alone", kind="number"),
        Column("alone_stderr", "±", "1 σ", kind="number"),
        Column("difference", "Apart", "σ", 1, "number"),
        Column("together", "Together", kind="number"),
        Column("origin", "Where from"),
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
    return Table("calibration-transfer", "The earlier fleet and this one", columns, rows, origin="calculated")
