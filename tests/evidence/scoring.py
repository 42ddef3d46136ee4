"""What the analysis says of a random campaign, held against its truth; scores over many."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from random_campaigns import random_campaign, write_campaign

SOURCES = ("motor", "gearbox", "other")
LEAST_MARGIN_DB, LEAST_PROMINENCE_DB = 3.0, 6.0
CLASSES_DB = np.arange(0.0, 22.0, 2.0)
CONFIDENCE_BINS = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0001)


def score_seed(seed: int, folder: Path) -> dict[str, Any]:
    """Make a campaign, analyse it, and compare; the folder keeps its logs and the store."""
    from tdacoustic.workflows.analyze import analyze

    campaign = random_campaign(seed)
    path = write_campaign(campaign, folder / "campaign")
    truth = json.loads((folder / "campaign" / "truth.json").read_text(encoding="utf-8"))
    analysis = analyze(path, store=folder / "store", jobs=1)
    row: dict[str, Any] = {"seed": seed, "tacho": campaign.tacho, "named": campaign.named, "wander": campaign.wander}
    row |= {"lines": [], "found": [], "conditions": []}
    verdicts = {item.condition: item for item in analysis.dominance}
    ablations = ablate(analysis)
    for run in truth["runs"]:
        receivers = [name for name in run["channels"] if name.startswith("mic")]
        for receiver in receivers:
            _fill_prominence(run, receiver, campaign.recipe)
            _compare_lines(row, run, receiver, analysis.sources, campaign.wander)
        shares = true_shares(run, receivers)
        order = sorted(SOURCES, key=lambda source: -shares[source])
        verdict = verdicts[run["condition"]]
        row["conditions"].append(
            {
                "condition": run["condition"],
                "true": order[0],
                "margin_db": 10.0 * math.log10(shares[order[0]] / max(shares[order[1]], 1e-12)),
                "both": _verdict(verdict),
                **{name: _verdict(item[run["condition"]]) for name, item in ablations.items()},
            }
        )
    return row


def _fill_prominence(run: Mapping[str, Any], receiver: str, recipe: Mapping[str, Any]) -> None:
    """Take the recipe's prominence where the truth leaves it out: the line moves by more than 2 % within the run."""
    condition = next(item for item in recipe["condition"] if item["name"] == run["condition"])
    drawn = {placed["line"]: line for placed, line in zip(run["lines"], condition["line"], strict=True)}
    for line in run["channels"][receiver]["lines"]:
        if line["prominence_db"] is None:
            line["prominence_db"] = drawn[line["line"]]["prominence_db"][receiver]


def true_shares(run: Mapping[str, Any], receivers: Sequence[str]) -> dict[str, float]:
    """Part of each source in the power of a run's true lines, averaged over the receivers."""
    shares = dict.fromkeys(SOURCES, 0.0)
    for receiver in receivers:
        lines = run["channels"][receiver]["lines"]
        total = sum(10.0 ** (0.1 * line["level_db"]) for line in lines)
        for line in lines:
            source = line["source"] if line["source"] in SOURCES else "other"
            shares[source] += 10.0 ** (0.1 * line["level_db"]) / total / len(receivers)
    return shares


def _verdict(item: Any) -> dict[str, Any]:
    return {"dominant": item.dominant, "leading": item.leading, "confidence": item.confidence}


def _compare_lines(row: dict[str, Any], run: Mapping[str, Any], receiver: str, sources: Any, wander: float) -> None:
    """Assign found lines to true ones of a receiver, the nearest first, one to one."""
    motor_hz = run["motor_speed_rpm"]["mean"] / 60.0
    orders = {line["line"]: abs(line["motor_order"]) for line in run["lines"]}
    true = run["channels"][receiver]["lines"]
    found = [s for s in sources if s.line.condition == run["condition"] and s.line.channel == receiver]
    pairs = []
    for i, line in enumerate(true):
        smear = wander * orders[line["line"]] * motor_hz
        for j, source in enumerate(found):
            allowed = max(2.0, 3.0 * source.line.frequency_error_hz, 2.5 * smear)
            distance = abs(source.line.frequency_hz - line["frequency_hz"])
            if distance <= allowed:
                pairs.append((distance, i, j))
    answer: dict[int, int] = {}
    for _, i, j in sorted(pairs):
        if i not in answer and j not in answer.values():
            answer[i] = j
    for i, line in enumerate(true):
        source = found[answer[i]] if i in answer else None
        row["lines"].append(
            {
                "condition": run["condition"],
                "receiver": receiver,
                "name": line["line"],
                "hz": line["frequency_hz"],
                "source": line["source"],
                "prominence_db": line["prominence_db"],
                "smear_hz": wander * orders[line["line"]] * motor_hz,
                "found": source is not None,
                "judged": None if source is None else source.source,
                "excitation": None if source is None else source.excitation_name,
                "conflict": None if source is None else source.conflict,
                "confidence": None if source is None else source.confidence,
                "evidence": None if source is None else source.evidence,
            }
        )
    for j, source in enumerate(found):
        row["found"].append(
            {
                "condition": run["condition"],
                "receiver": receiver,
                "hz": source.line.frequency_hz,
                "prominence_db": source.line.prominence_db,
                "true": j in answer.values(),
            }
        )


def ablate(analysis: Any) -> dict[str, dict[str, Any]]:
    """Verdicts on the same lines by the sensors alone and by the orders alone."""
    from tdacoustic.attribution import ConditionEvidence, RunEvidence, attribute, dominance_of_condition

    components = tuple(dict.fromkeys(view.component for s in analysis.sources for view in s.line.views()))
    found: dict[str, dict[str, Any]] = {"radiator": {}, "excitation": {}}
    for verdict in analysis.dominance:
        lines = [source.line for source in analysis.sources if source.line.condition == verdict.condition]
        held: dict[str, list[Any]] = {}
        for line in lines:
            for run, evidence in line.members:
                held.setdefault(run, []).append(evidence)
        receivers = tuple(dict.fromkeys(line.channel for line in lines))
        sighted = {run: RunEvidence(tuple(items)) for run, items in held.items()}
        blind = {
            run: RunEvidence(tuple(dataclasses.replace(item, sensors=()) for item in items))
            for run, items in held.items()
        }
        cases = {
            "radiator": ConditionEvidence(verdict.condition, receivers, sighted, {}, components, True),
            "excitation": ConditionEvidence(verdict.condition, receivers, blind, analysis.kinematics, (), True),
        }
        for name, known in cases.items():
            sources, draws = attribute(known, (), (), 1)
            found[name][verdict.condition] = dominance_of_condition(
                verdict.condition, sources, draws, {}, verdict.n_runs, None
            )
    return found


# ---------------------------------------------------------------- scores


def scores(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the scores of the protocol over many seeds."""
    lines = [line for row in rows for line in row["lines"]]
    found = [line for row in rows for line in row["found"]]
    conditions = [condition for row in rows for condition in row["conditions"]]
    ours = [line for line in lines if line["source"] in ("motor", "gearbox")]
    strong = [line for line in ours if line["prominence_db"] >= LEAST_PROMINENCE_DB]
    told = [line for line in ours if line["found"]]
    right = [line for line in told if line["judged"] == line["source"]]
    open_ = [line for line in told if line["judged"] not in ("motor", "gearbox")]
    return {
        "seeds": len(rows),
        "conditions": len(conditions),
        "lines": len(lines),
        "recall": _part(strong, lambda line: line["found"]),
        "recall_sharp": _part([x for x in strong if x["smear_hz"] < 0.5], lambda line: line["found"]),
        "recall_smeared": _part([x for x in strong if x["smear_hz"] >= 0.5], lambda line: line["found"]),
        "recall_with_tacho": _part(
            [line for row in rows if row["tacho"] for line in row["lines"] if line in strong], lambda x: x["found"]
        ),
        "precision": _part(found, lambda line: line["true"]),
        "recall_by_prominence": _curve(ours, "found"),
        "precision_by_prominence": _curve(found, "true"),
        "line_source": {
            "n": len(told),
            "right": round(len(right) / max(1, len(told)), 4),
            "open": round(len(open_) / max(1, len(told)), 4),
            "wrong": round(1.0 - (len(right) + len(open_)) / max(1, len(told)), 4),
        },
        "dominance": dominance_scores(conditions, "both"),
        "calibration": _calibration(conditions),
        "ablation": {name: dominance_scores(conditions, name) for name in ("radiator", "excitation", "both")},
    }


def dominance_scores(conditions: Sequence[Mapping[str, Any]], case: str) -> dict[str, Any]:
    """Decided, right and Brier of one case."""
    clear = [c for c in conditions if c["margin_db"] >= LEAST_MARGIN_DB]
    ours = [c for c in clear if c["true"] != "other"]
    decided = [c for c in clear if c[case]["dominant"] != "undecided"]
    told = [c for c in conditions if c[case]["confidence"] is not None]
    brier = [(c[case]["confidence"] - is_right(c, case)) ** 2 for c in told]
    return {
        "decided": _part(ours, lambda c: c[case]["dominant"] != "undecided"),
        "right_of_decided": _part(decided, lambda c: c[case]["dominant"] == c["true"]),
        "decided_and_right": _part(ours, lambda c: c[case]["dominant"] == c["true"]),
        "decided_where_decoys_lead": _part(
            [c for c in clear if c["true"] == "other"], lambda c: c[case]["dominant"] != "undecided"
        ),
        "brier": {"value": round(float(np.mean(brier)), 4) if brier else None, "n": len(brier)},
    }


def is_right(condition: Mapping[str, Any], case: str) -> bool:
    """Whether the leading source is the true one; decoys are called `unassigned`."""
    leading = condition[case]["leading"]
    return bool({"unassigned": "other"}.get(leading, leading) == condition["true"])


def _part(items: Sequence[Any], holds: Any) -> dict[str, Any]:
    n, k = len(items), sum(1 for item in items if holds(item))
    return {"value": round(k / n, 4) if n else None, "k": k, "n": n}


def _curve(lines: Sequence[Mapping[str, Any]], key: str) -> list[dict[str, Any]]:
    curve = []
    for low, high in zip(CLASSES_DB, [*CLASSES_DB[1:], math.inf], strict=True):
        held = [line for line in lines if low <= line["prominence_db"] < high]
        curve.append({"from_db": float(low), **_part(held, lambda line: line[key])})
    return curve


def _calibration(conditions: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    bins = []
    for low, high in itertools.pairwise(CONFIDENCE_BINS):
        held = [c for c in conditions if c["both"]["confidence"] is not None and low <= c["both"]["confidence"] < high]
        mean = float(np.mean([c["both"]["confidence"] for c in held])) if held else None
        bins.append({"from": low, "mean_confidence": mean, **_part(held, lambda c: is_right(c, "both"))})
    return bins


def table(result: Mapping[str, Any]) -> str:
    """Return the scores as text."""
    rows = [f"{result['seeds']} seeds, {result['conditions']} conditions, {result['lines']} lines in microphones"]
    for key in ("recall", "recall_sharp", "recall_smeared", "recall_with_tacho", "precision"):
        rows.append(f"{key:28s} {_text(result[key])}")
    for key in ("recall_by_prominence", "precision_by_prominence"):
        rows.append(f"{key}: " + "  ".join(f"{c['from_db']:.0f}: {c['value']} ({c['n']})" for c in result[key]))
    rows.append(f"line source {result['line_source']}")
    rows.append(
        "confidence: " + "  ".join(f">={b['from']:g}: {b['value']} ({b['n']})" for b in result["calibration"] if b["n"])
    )
    for name, case in result["ablation"].items():
        rows.append(f"{name}:")
        rows += [f"  {key:26s} {_text(value)}" for key, value in case.items()]
    return "\n".join(rows)


def _text(value: Mapping[str, Any]) -> str:
    return f"{value['value']}  ({value.get('k', '')}/{value['n']})"
