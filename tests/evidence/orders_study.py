"""Orders of run-ups made from formulas: errors in dB and degrees over the sweep rate, by cut and by Vold-Kalman.

``python tests/evidence/orders_study.py`` writes ``orders_record.json`` and prints the tables; a minute on one core,
with rota-order for the comparison (GPL: run here, never imported by the package).

Protocol. A shaft runs from 10 to 40 turns/s in 240, 60, 15 and 5 s, at 8192 Hz. Each case has its own orders:

- *plain*: orders 6 and 13.37, white noise 40 dB below order 6 in a bandwidth of 1 Hz;
- *two shafts*: with order 11 of a shaft of ratio 0.618...;
- *modulated*: order 6 with 50 % amplitude modulation at 0.2 Hz;
- *crossing*: order 8 against order 8 of a shaft that runs down; 1 s or a tenth of the record around the crossing;
- *weak*: order 8 alone, 10 dB below the floor in 0.4 orders at 25 turns/s.

Errors are of order 6 (of order 8 in the last two), over instants of which the method states no doubt (*crossing*:
whatever it states): rms and largest of level and phase. Cuts have a resolution of 0.2 orders; filters 2 poles and the
advised bandwidth (loss factor 0.05), all orders jointly.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

if __name__ == "__main__":  # not where a test imports it: numba allows no other number once its threads run
    for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(_variable, "1")

import hashlib
import json
import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from made_up_run_ups import RunUp

from tdacoustic.orders import (
    AngleResampler,
    CutMeter,
    EachFrame,
    Frames,
    TrackedOrder,
    VoldKalman,
    advise_bandwidth,
    plan_line_frames,
)
from tdacoustic.speed import ShaftAngle

PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "orders_record.json"
DURATIONS_S = (240.0, 60.0, 15.0, 5.0)
RATIO = 0.6180339887
CASES = ("plain", "two shafts", "modulated", "crossing", "weak")


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    speed = [PACKAGE / "speed" / f"{name}.py" for name in ("angle", "edge_smoothing")]
    return [
        *sorted((PACKAGE / "orders").glob("*.py")),
        *speed,
        HERE.parent / "made_up_run_ups.py",
        HERE / "orders_study.py",
    ]


def sources() -> str:
    """Return their stamp."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what is recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


@dataclass(frozen=True)
class Case:
    """A signal, the orders in it (run, order, ratio), and the truth of the first."""

    samples: np.ndarray
    orders: tuple[tuple[RunUp, float, float], ...]
    rms: Any
    phase: float
    window: tuple[float, float]


def case(name: str, run: RunUp) -> Case:
    """Make one case."""
    everywhere = (0.0, run.duration_s)
    if name == "weak":
        rms = float(np.sqrt(0.1 * 1e-3 * 25.0 * 0.4))
        return Case(run.order(8.0, rms, 0.7) + run.noise(1e-3), ((run, 8.0, 1.0),), rms, 0.7, everywhere)
    if name == "crossing":
        down = RunUp(run.last_hz, run.first_hz, run.duration_s, run.rate_hz)
        half = min(1.0, 0.1 * run.duration_s)
        middle = 0.5 * run.duration_s
        samples = run.order(8.0, 1.0, 0.5) + down.order(8.0, 0.5, -1.0) + run.noise(1e-4)
        return Case(samples, ((run, 8.0, 1.0), (down, 8.0, 1.0)), 1.0, 0.5, (middle - half, middle + half))
    rms = (lambda t: 1.0 + 0.5 * np.sin(0.4 * np.pi * t)) if name == "modulated" else 1.0
    samples = run.order(6.0, rms, 0.5) + run.order(13.37, 0.3, -1.0) + run.noise(1e-4)
    orders: tuple[tuple[RunUp, float, float], ...] = ((run, 6.0, 1.0), (run, 13.37, 1.0))
    if name == "two shafts":
        samples += run.order(11.0, 0.5, 2.0, RATIO)
        orders = (*orders, (run, 11.0, RATIO))
    return Case(samples, orders, rms, 0.5, everywhere)


def errors(made: Case, times: np.ndarray, amplitude: np.ndarray, good: np.ndarray, name: str) -> dict[str, Any]:
    """Rms and largest errors of level and phase."""
    inside = (times >= made.window[0]) & (times <= made.window[1]) & np.isfinite(amplitude)
    stated = float(np.mean(good[inside])) if inside.any() else 0.0
    if name != "crossing":
        inside &= good
    if name == "weak":  # one value: the mean over all that is stated
        inside &= True
        times, amplitude = np.array([0.0]), np.array([np.mean(amplitude[inside])]) if inside.any() else np.zeros(0)
        inside = np.ones(amplitude.size, dtype=bool)
    if not inside.any():
        return {"instants": 0, "without_doubt": stated}
    rms = made.rms(times[inside]) if callable(made.rms) else made.rms
    ratio = amplitude[inside] / (rms * np.exp(1j * made.phase))
    level, phase = 20.0 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio))
    return {
        "instants": int(inside.sum()),
        "without_doubt": stated,
        "level_rms_db": float(np.sqrt(np.mean(level**2))),
        "level_largest_db": float(np.max(np.abs(level))),
        "phase_rms_degree": float(np.sqrt(np.mean(phase**2))),
    }


def by_cut(made: Case, run: RunUp, name: str) -> dict[str, Any]:
    resampler = AngleResampler(ShaftAngle(*run.nodes()), run.rate_hz, 20.0)
    plan = plan_line_frames(resampler.samples_per_turn, 0.2)
    meter = CutMeter(plan, [made.orders[0][1]], EachFrame(50000), 1, run.rate_hz)
    Frames(plan, [meter]).take(resampler.take(made.samples[None]))
    (cut,) = meter.result()
    amplitude = np.sqrt(cut.mean_square) * np.exp(1j * np.angle(cut.amplitude))
    good = np.array([reason == "" for reason in cut.reasons])
    if name == "weak":
        amplitude, good = cut.amplitude, np.ones(good.size, dtype=bool)
    return errors(made, cut.times_s, amplitude, good, name)


def tracked(made: Case) -> list[TrackedOrder]:
    shafts = [(ShaftAngle(*run.nodes()).at_ratio(ratio), order) for run, order, ratio in made.orders]
    advice = [
        advise_bandwidth(angle, order, [other for other in shafts if other[0] is not angle], loss_factor=0.05)
        for angle, order in shafts
    ]
    bandwidth = max(0.1, min(item.bandwidth_hz for item in advice))
    return [TrackedOrder(angle, order, bandwidth) for angle, order in shafts]


def by_filter(made: Case, run: RunUp, name: str) -> dict[str, Any]:
    found = VoldKalman(tracked(made), run.rate_hz).whole(made.samples[None])[0]
    return errors(made, found.times_s, found.amplitude[0], found.reason[0] == 0, name) | {
        "bandwidth_hz": found.order.bandwidth_hz
    }


def by_rota(made: Case, run: RunUp, name: str) -> dict[str, Any]:
    """The same bandwidth, by rota-order; its own program states no doubts, so ours are taken."""
    from rota.extract import order_waveform

    orders = tracked(made)
    ours = VoldKalman(orders, run.rate_hz).whole(made.samples[None])[0]
    rpm = np.column_stack([60.0 * own.speed(run.times) * ratio for own, _, ratio in made.orders])
    waves = order_waveform(
        made.samples, run.rate_hz, rpm, [order for _, order, _ in made.orders],
        bandwidth=orders[0].bandwidth_hz, shafts=list(range(len(made.orders))),
    )  # fmt: skip
    there = np.rint(ours.times_s * run.rate_hz).astype(int)
    return errors(made, ours.times_s, waves.envelopes[there, 0] / np.sqrt(2.0), ours.reason[0] == 0, name)


def study() -> list[dict[str, Any]]:
    rows = []
    for name in CASES:
        for duration_s in DURATIONS_S:
            run = RunUp(10.0, 40.0, duration_s)
            made = case(name, run)
            row: dict[str, Any] = {"case": name, "sweep_hz_s": run.sweep}
            row |= {"cut": by_cut(made, run, name), "filter": by_filter(made, run, name)}
            if duration_s <= 60.0 and name != "weak":
                row["rota"] = by_rota(made, run, name)
            rows.append(row)
    return rows


def tables(found: dict[str, Any]) -> str:
    """Return the figures as a table."""
    head = "| case | sweep, turns/s² | bandwidth, Hz | cut: dB rms, worst, degrees | Vold-Kalman | rota-order |"
    lines = [head, "|---" * 6 + "|"]
    for row in found["rows"]:
        texts = []
        for method in ("cut", "filter", "rota"):
            item = row.get(method)
            if item is None:
                texts.append("")
            elif not item["instants"]:
                texts.append("none without doubt")
            else:
                texts.append(
                    f"{item['level_rms_db']:.3f}, {item['level_largest_db']:.3f}, {item['phase_rms_degree']:.2f}"
                )
        bandwidth = row["filter"].get("bandwidth_hz", float("nan"))
        lines.append(f"| {row['case']} | {row['sweep_hz_s']:g} | {bandwidth:.2f} | {' | '.join(texts)} |")
    return "\n".join(lines)


def main() -> None:
    """Compute and write the record."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    found = {
        "schema": "tdacoustic-orders-study/1",
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", *map(str, source_files()))),
        "versions": {"python": platform.python_version()}
        | {name: version(name) for name in ("numpy", "scipy", "numba", "rota-order")},
        "sources_sha256": sources(),
        "rows": study(),
    }
    RECORD.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(tables(found))


if __name__ == "__main__":
    main()
