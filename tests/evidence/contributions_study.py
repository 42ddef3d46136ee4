"""Contributions of a simulated drive whose truth is known, over the coherence between its references.

``python tests/evidence/contributions_study.py`` writes ``contributions_record.json``; a few minutes. The drive
(``tests/contributions/simulated_drive.py``) imports nothing of the package: motor and gearbox, each with a sensor,
cross-talk one way, both ways with delays, or both ways in phase, scaled until the sensors' mean coherence is the one
asked for; three operating states whose sources' levels differ by up to ±6 dB; a microphone with noise of its own.
Errors are of third octaves and of narrow bands, in decibels against each source's true power at the microphone.

Further rows: one operating state; states within ±1 dB; a third source without a reference, heard in both sensors; a rig
with one source; sensors' noise 12 dB down with each rule for cutting components.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "contributions_record.json"
sys.path.insert(0, str(HERE.parent / "contributions"))

from drive_states import BANDS, states_of  # noqa: E402
from simulated_drive import KINDS, Drive, random_drive, true_coherence  # noqa: E402

from tdacoustic.contributions import PathSettings, Span, path_contributions  # noqa: E402

COHERENCES = (0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99)
FEW_COHERENCES = (0.1, 0.5, 0.9)
SEEDS = 10
HELD_OUT = 1000
"""First seed of drives that no threshold was chosen on; those of the other tables were looked at."""
GROUPS = {"motor": ["motor_z"], "gearbox": ["gearbox_z"]}
FREQUENCIES = np.arange(100.0, 800.0, 2.0)
SPANS = (*BANDS, *(Span(f"line {c:g} Hz", c - 8.0, c + 8.0) for c in (144.0, 232.0, 336.0, 464.0, 584.0)))
LIMIT_DB = 3.0
RULES = ("none", "significance", "noise_floor", "ridge")


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    names = ("coherence_statistics", "cross_spectra", "matrices", "parts", "paths", "separation", "states", "transfer")
    tests = [HERE.parent / "contributions" / f"{name}.py" for name in ("simulated_drive", "drive_states")]
    return [*(PACKAGE / "contributions" / f"{name}.py" for name in names), *tests, HERE / "contributions_study.py"]


def sources() -> str:
    """Return their stamp."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what is recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


Row = tuple[float, float, str, bool]
"""Error of what is given and of plain paths in dB, verdict, whether the interval holds the truth."""


def rows_of(
    drive: Drive, powers: np.ndarray, rng: np.random.Generator, settings: PathSettings, **options: Any
) -> list[Row]:
    """Contributions of one drive against the truth."""
    states, made = states_of(drive, powers, rng)
    rows = []
    for one in path_contributions(states, GROUPS, SPANS, settings, **options):
        for number, name in enumerate(GROUPS):
            part = one.groups[name]
            true = made[one.state].true_power(number, *one.band_hz) if number < len(drive.path_gains) else 0.0
            error = 10.0 * np.log10(part.mean_square / true) if part.mean_square and true else np.nan
            plain = 10.0 * np.log10(max(part.path_mean_square, 1e-30) / true) if true else np.nan
            rows.append((float(error), float(plain), part.verdict, bool(part.low <= true <= part.high)))
    return rows


def scored(rows: list[Row]) -> dict[str, float]:
    """Return the figures of a row of the table."""
    error, plain = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    verdict, inside = np.array([row[2] for row in rows]), np.array([row[3] for row in rows])
    known, size = verdict == "ok", np.abs(error)
    sizes = size[known]
    return {
        "n": len(rows),
        "plain_median_db": float(np.nanmedian(np.abs(plain))) if np.isfinite(plain).any() else np.nan,
        "plain_95_db": float(np.nanpercentile(np.abs(plain), 95)) if np.isfinite(plain).any() else np.nan,
        "plain_over_3_db": float(np.nanmean(np.abs(plain) > LIMIT_DB)),
        "ok": float(known.mean()),
        "flagged": float((verdict == "flagged").mean()),
        "refused": float((verdict == "refused").mean()),
        "below": float((verdict == "below").mean()),
        "ok_median_db": float(np.median(sizes)) if sizes.size else np.nan,
        "ok_95_db": float(np.percentile(sizes, 95)) if sizes.size else np.nan,
        "ok_worst_db": float(sizes.max()) if sizes.size else np.nan,
        "ok_over_3_db": int((sizes > LIMIT_DB).sum()),
        "ok_inside": float(inside[known].mean()) if sizes.size else np.nan,
    }


def powers_of(rng: np.random.Generator, states: int, spread_db: float, count: int = 2) -> np.ndarray:
    """Source powers of the states."""
    return np.asarray(10.0 ** (rng.uniform(-spread_db, spread_db, (states, count)) / 10.0))


def over_coherence(
    states: int = 3,
    spread_db: float = 6.0,
    draws: int = 60,
    coherences: tuple[float, ...] = COHERENCES,
    first_seed: int = 0,
) -> list[dict[str, Any]]:
    """The table: error and verdicts over coherence."""
    table = []
    for kind in KINDS:
        for coherence in coherences:
            rows, reached = [], []
            for seed in range(first_seed, first_seed + SEEDS):
                rng = np.random.default_rng([seed, int(1000 * coherence), KINDS.index(kind)])
                drive = random_drive(kind, coherence, rng, FREQUENCIES)
                reached.append(true_coherence(drive, np.ones(2), FREQUENCIES))
                rows += rows_of(drive, powers_of(rng, states, spread_db), rng, PathSettings(draws=draws))
            table.append({"kind": kind, "asked": coherence, "coherence": float(np.mean(reached)), **scored(rows)})
            print(json.dumps(table[-1]), flush=True)
    return table


def with_an_unreferenced_source(share_db: float) -> dict[str, float]:
    """A third source, such as wheel and rail, in both sensors and the microphone."""
    rows: list[Row] = []
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, 77])
        two = random_drive("both ways", 0.1, rng, FREQUENCIES)
        seen = 10.0 ** (share_db / 20.0)
        drive = replace(
            two,
            gains=np.column_stack((two.gains, rng.uniform(0.5, 1.0, 2) * seen)),
            delays_s=np.column_stack((two.delays_s, rng.uniform(0.0, 0.003, 2))),
            path_gains=np.append(two.path_gains, 1.0),
            path_delays_s=np.append(two.path_delays_s, 0.002),
        )
        rows += rows_of(drive, powers_of(rng, 4, 6.0, 3), rng, PathSettings(draws=60))
    return scored(rows)


def with_one_source(states: int) -> dict[str, float]:
    """A rig: one source seen by both sensors, at different noise."""
    rows: list[Row] = []
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, 55])
        noise = 10.0 ** (-rng.uniform(20.0, 40.0, 2) / 10.0)
        gains = np.array([[1.0], [rng.uniform(0.3, 1.0)]])
        drive = Drive(gains, np.array([[0.0], [rng.uniform(0.0, 0.003)]]), np.ones(1), np.array([0.003]), noise, 0.05)
        rows += rows_of(drive, powers_of(rng, states, 6.0, 1), rng, PathSettings(draws=60))
    return scored(rows)


def by_rule(coherence: float, noise_db: float) -> dict[str, dict[str, float]]:
    """Noisy sensors: each rule on the same drives."""
    found: dict[str, list[Row]] = {rule: [] for rule in RULES}
    for rule in RULES:
        for seed in range(SEEDS):
            rng = np.random.default_rng([seed, 33])
            drive = random_drive("both ways, in phase", coherence, rng, FREQUENCIES)
            drive = replace(drive, sensor_noise=np.full(2, 10.0 ** (noise_db / 10.0)))
            floor = dict.fromkeys(("motor_z", "gearbox_z"), drive.sensor_noise[0] / 1024.0)
            settings = PathSettings(rule=rule, draws=20)  # type: ignore[arg-type]
            rows = rows_of(drive, powers_of(rng, 3, 6.0), rng, settings, noise_density=floor)
            found[rule] += rows
    return {rule: scored(rows) for rule, rows in found.items()}


def study() -> dict[str, Any]:
    """Return what is recorded."""
    return {
        "sources_sha256": sources(),
        "seeds": SEEDS,
        "three_states": over_coherence(),
        "held_out": over_coherence(first_seed=HELD_OUT),
        "one_state": over_coherence(1, 0.0, 20, FEW_COHERENCES),
        "alike_states": over_coherence(3, 1.0, 20, FEW_COHERENCES),
        "unreferenced": {f"{share:g} dB": with_an_unreferenced_source(share) for share in (-20.0, -10.0, 0.0)},
        "one_source": {f"{states} states": with_one_source(states) for states in (1, 3)},
        "rules": {f"{coherence:g}": by_rule(coherence, -12.0) for coherence in (0.5, 0.95)},
    }


def plain(value: Any) -> Any:
    """JSON without NaN."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [plain(entry) for entry in value]
    if isinstance(value, float):
        return None if not np.isfinite(value) else round(value, 4)
    return value


def draw(held: dict[str, Any], path: Path) -> None:
    """Draw error and verdict over coherence."""
    import matplotlib.pyplot as plt

    figure, (upper, lower) = plt.subplots(2, 1, figsize=(7.0, 7.0), sharex=True)
    for number, kind in enumerate(KINDS):
        rows = [row for row in held["three_states"] if row["kind"] == kind]
        rows = [
            row
            for place, row in enumerate(rows)
            if place == 0 or row["coherence"] > rows[place - 1]["coherence"] + 0.01
        ]
        at = [row["coherence"] for row in rows]
        upper.plot(at, [row["plain_95_db"] for row in rows], f"C{number}--", label=f"{kind}: plain paths, 95 %")
        upper.plot(at, [row["ok_95_db"] for row in rows], f"C{number}o-", label=f"{kind}: stated as known, 95 %")
        lower.plot(at, [row["ok"] for row in rows], f"C{number}o-", label=kind)
    upper.axhline(LIMIT_DB, color="0.5", lw=1)
    upper.set(ylabel="Error / dB", ylim=(0.01, 40.0), yscale="log")
    lower.set(xlabel="Coherence of the references", ylabel="Part stated as known", ylim=(0.0, 1.0))
    for axes in (upper, lower):
        axes.legend(fontsize=7, loc="lower left")
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--draw-only", action="store_true")
    given = parser.parse_args()
    if not given.draw_only:
        RECORD.write_text(json.dumps(plain(study()), indent=1) + "\n", encoding="utf-8")
    if given.figure is not None:
        draw(record(), given.figure)


if __name__ == "__main__":
    main()
