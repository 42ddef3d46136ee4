"""The speed of 200 random run-ups from vibration alone, with and without a known start, and by a plain tracker.

``python tests/evidence/tacholess_study.py --rows FILE --record`` writes ``tacholess_record.json``; about ten minutes on
one idle core (rows are kept, and an interrupted study goes on). The signals are `run_up_signals`, which shares nothing
with the analysis. Thresholds of `speed/ridge*.py` were set on seeds 0 to 39; the record is of seeds 3000 to 3199, and
of 40 more whose drive is silent.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "tacholess_record.json"
sys.path.insert(0, str(HERE))

from run_up_signals import RATE_HZ, RunUp, run_up  # noqa: E402

from tdacoustic.speed.comb import CombOrder  # noqa: E402
from tdacoustic.speed.ridge import RidgeSpeed, refinement_of, ridge_speed  # noqa: E402
from tdacoustic.speed.ridge_search import RidgeSearch, RidgeSettings, refusal  # noqa: E402

SEEDS = range(3000, 3200)
SILENT = range(4000, 4040)
PLAIN = 40
"""Of the seeds that the plain tracker sees too."""
PROMINENCE_DB, SILENT_DB = (6.0, 24.0), (-60.0, -50.0)
WRONG = 0.05
"""A speed this far off, relative, is another harmonic's (or none's)."""
TRAIN_M_S = (2.0, 30.0)
ACCELERATION_M_S2 = 2.5
BLOCK = 2**16


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    names = ("comb", "comb_path", "comb_readings", "comb_spectra", "ridge", "ridge_refinement", "ridge_search")
    return [
        *(PACKAGE / "speed" / f"{name}.py" for name in names),
        HERE / "run_up_signals.py",
        HERE / "tacholess_study.py",
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


def known_of(run: RunUp, seed: int) -> RidgeSettings:
    """Return what a fleet file would say of the drive; the motor's slots in every other seed."""
    orders, turns = [], 1.0
    for number, (driving, driven) in enumerate(run.teeth, start=1):
        for harmonic in range(1, 7):
            presence = 0.8 - 0.1 * harmonic
            orders.append(CombOrder(f"mesh {number} x{harmonic}", driving * turns * harmonic, presence))
        turns *= driving / driven
    orders += [CombOrder(f"motor shaft x{harmonic}", float(harmonic), 0.3) for harmonic in range(1, 5)]
    orders.append(CombOrder("supply x2", 2.0 * run.pole_pairs * 1.015, 0.4, 0.015))
    if seed % 2:
        orders.append(CombOrder("slots", float(run.slots)))
    per_metre = run.ratio / (math.pi * run.wheel_m)
    low, high = (speed * per_metre for speed in TRAIN_M_S)
    return RidgeSettings(tuple(orders), low, high, ACCELERATION_M_S2 * per_metre)


def in_blocks(taker: Any, signals: np.ndarray) -> None:
    """Feed signals as a step does."""
    for start in range(0, signals.shape[1], BLOCK):
        taker.take(signals[:, start : start + BLOCK])


def read_twice(run: RunUp, seed: int) -> dict[str, RidgeSpeed]:
    """Return the speed without and with a start that is known to 2 %."""
    settings = known_of(run, seed)
    count, duration = run.times_s.size, run.times_s.size / RATE_HZ
    search = RidgeSearch(settings, RATE_HZ, count, run.signals.shape[0])
    in_blocks(search, run.signals)
    start = float(run.motor_hz[0]) * (1.0 + 0.02 * math.sin(seed))
    result, last = {}, None
    for name, known in (("unknown", None), ("known", start)):
        found = search.result(known)
        refined = None
        if refusal(found) is None:
            same = last is not None and np.array_equal(last[0].path.speeds_hz, found.path.speeds_hz)
            refined = last[1] if last is not None and same else refinement_of(found, settings, RATE_HZ, count)
            if not same:
                in_blocks(refined, run.signals)
            last = (found, refined)
        result[name] = ridge_speed("vibration", settings, found, refined, 0.0, duration)
    return result


def scored(run: RunUp, got: RidgeSpeed) -> dict[str, Any]:
    """Return what a speed is worth; errors are relative."""
    rough = np.interp(got.times_s, run.times_s, run.motor_hz)
    right = np.abs(got.path_hz / rough - 1.0) <= 0.02
    row: dict[str, Any] = {
        "found": got.profile is not None,
        "confidence": np.round(got.confidence, 3).tolist() if got.profile is not None else [],
        "right": right.astype(int).tolist() if got.profile is not None else [],
    }
    if got.profile is None:
        return {**row, "reason": got.reason}
    profile = got.profile
    assert profile.error is not None
    true = np.interp(profile.times_s, run.times_s, run.motor_hz)
    off = profile.speed / true - 1.0
    good = np.abs(off) <= WRONG
    unknown = sum(last - first for first, last, _ in profile.unknown)
    return {
        **row,
        "wrong": float(np.mean(~good)),
        "harmonic": bool(abs(float(np.median(off))) > WRONG),
        "rms": float(np.sqrt(np.mean(off[good] ** 2))) if good.any() else None,
        "known": 1.0 - unknown / run.times_s[-1],
        "within": float(np.mean(np.abs(off * true)[good] <= 2.0 * profile.error[good])) if good.any() else None,
        "frame_s": got.frame_s,
    }


def plain_tracker(run: RunUp, seed: int) -> dict[str, float]:
    """librosa's harmonic salience on the first mesh, and its Viterbi over a band of moves."""
    import librosa

    settings = known_of(run, seed)
    base = settings.orders[0].order
    size, hop = 4096, 1024
    power = np.abs(librosa.stft(run.signals[0], n_fft=size, hop_length=hop))
    grid = librosa.fft_frequencies(sr=RATE_HZ, n_fft=size)
    multiples = [item.order / base for item in settings.orders if item.order >= base and item.reach == 0.0]
    salience = librosa.salience(power, freqs=grid, harmonics=multiples, fill_value=0.0)
    inside = (grid >= base * settings.lowest_hz) & (grid <= base * settings.highest_hz)
    chance = salience[inside] + 1e-12
    chance = chance / chance.sum(axis=0)
    width = 2 * int(np.ceil(settings.acceleration_hz_s * base * hop / RATE_HZ / (grid[1] - grid[0]))) + 1
    moves = librosa.sequence.transition_local(int(inside.sum()), width, window="triangle", wrap=False)
    speed = grid[inside][librosa.sequence.viterbi_discriminative(chance, moves)] / base
    times = librosa.frames_to_time(np.arange(speed.size), sr=RATE_HZ, hop_length=hop)
    off = speed / np.interp(times, run.times_s, run.motor_hz) - 1.0
    good = np.abs(off) <= WRONG
    rms = float(np.sqrt(np.mean(off[good] ** 2))) if good.any() else float("nan")
    return {"wrong": float(np.mean(~good)), "harmonic": bool(np.mean(~good) > 0.5), "rms": rms}


def row_of(seed: int) -> dict[str, Any]:
    """Return the scores of a seed."""
    run = run_up(seed, SILENT_DB if seed in SILENT else PROMINENCE_DB)
    row: dict[str, Any] = {"seed": seed, "about": run.about}
    row.update({name: scored(run, got) for name, got in read_twice(run, seed).items()})
    if seed in SEEDS[:PLAIN]:
        row["plain"] = plain_tracker(run, seed)
    return row


def summary(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    """Return the figures of one way of reading over all seeds."""
    every = [row[name] for row in rows]
    found = [item for item in every if item["found"]]
    right = [item for item in found if not item["harmonic"]]
    rms = np.array([item["rms"] for item in right])
    confidence = np.concatenate([item["confidence"] for item in found])
    hits = np.concatenate([item["right"] for item in found])
    edges = [0.0, 0.5, 0.8, 0.95, 0.99, 1.0 + 1e-9]
    bins = [
        [low, min(high, 1.0), int(inside.sum()), round(float(hits[inside].mean()), 4) if inside.any() else None]
        for low, high in itertools.pairwise(edges)
        for inside in [(confidence >= low) & (confidence < high)]
    ]
    return {
        "runs": len(every),
        "found": len(found),
        "wrong_harmonic": sum(item["harmonic"] for item in found),
        "wrong_values": round(float(np.mean([item["wrong"] for item in right])), 5),
        "rms_all": float(np.sqrt(np.mean(rms**2))),
        "rms_median": float(np.median(rms)),
        "rms_90": float(np.percentile(rms, 90.0)),
        "known_share": round(float(np.mean([item["known"] for item in right])), 4),
        "within_two_errors": round(float(np.mean([item["within"] for item in right])), 4),
        "confidence": bins,
    }


def made(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the record of rows."""
    heard = [row for row in rows if row["seed"] in SEEDS]
    silent = [row for row in rows if row["seed"] in SILENT]
    plain = [row["plain"] for row in heard if "plain" in row]
    classes = {}
    for low, high in ((-20, 5), (5, 10), (10, 15), (15, 20), (20, 60)):
        part = [row for row in heard if low <= row["about"]["first_mesh_db"] < high]
        got = [row["unknown"] for row in part]
        right = [item["rms"] for item in got if item["found"] and not item["harmonic"]]
        classes[f"{low}..{high}"] = {
            "runs": len(part),
            "found": sum(item["found"] for item in got),
            "wrong_harmonic": sum(item["found"] and item["harmonic"] for item in got),
            "rms_median": float(np.median(right)) if right else None,
        }
    return {
        "sources_sha256": sources(),
        "versions": {"numpy": np.__version__},
        "unknown": summary(heard, "unknown"),
        "known": summary(heard, "known"),
        "by_first_mesh_db": classes,
        "silent": {
            "runs": len(silent),
            "found": sum(row["unknown"]["found"] or row["known"]["found"] for row in silent),
        },
        "plain": {
            "runs": len(plain),
            "wrong_harmonic": sum(item["harmonic"] for item in plain),
            "wrong_values": float(np.mean([item["wrong"] for item in plain])),
            "rms_median": float(np.nanmedian([item["rms"] for item in plain])),
            "same_runs_found": sum(row["unknown"]["found"] for row in heard[:PLAIN]),
            "same_runs_wrong_harmonic": sum(row["unknown"].get("harmonic", False) for row in heard[:PLAIN]),
        },
    }


def main() -> None:
    """Run what is missing, then write the record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=Path, required=True, help="one JSON line a seed; goes on where it ended")
    parser.add_argument("--record", action="store_true")
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    if arguments.rows.exists():
        rows = [json.loads(line) for line in arguments.rows.read_text(encoding="utf-8").splitlines()]
        rows = [row for row in rows if row["sources"] == sources()]
    done = {row["seed"] for row in rows}
    with arguments.rows.open("a", encoding="utf-8") as file:
        for seed in (*SEEDS, *SILENT):
            if seed not in done:
                rows.append({**row_of(seed), "sources": sources()})
                file.write(json.dumps(rows[-1]) + "\n")
                file.flush()
    rows.sort(key=lambda row: row["seed"])
    if arguments.record:
        RECORD.write_text(json.dumps(made(rows), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
