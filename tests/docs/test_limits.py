"""The figures of docs/limits.md are those of the recorded studies, and its pages name no study that is not there."""

import csv
import json

from guides import DOCS, ROOT, section

from tdacoustic.reporting.page_limits import PAGE_LIMITS
from tdacoustic.workflows.listening import MOST_CONDITIONS, STEADY_S, SWEEP_S

PAGE = DOCS / "limits.md"


def record(name):
    return json.loads((ROOT / "tests" / "evidence" / name).read_text(encoding="utf-8"))


def words(heading):
    return " ".join(section(PAGE, heading).split())


def test_lines_and_sources():
    held = record("record.json")
    scores = [held[which]["scores"] for which in ("tuning", "holdout")]
    text = words("Finding lines and naming their source")
    for name, said in (("recall", "that are found"), ("precision", "that are true")):
        cells = " | ".join(f"{one[name]['value']:.3f}" for one in scores)
        assert f"{said} | {cells} |" in text
    weak = [next(row for row in one["recall_by_prominence"] if row["from_db"] == 6.0) for one in scores]
    assert " and ".join(f"{row['value']:.2f}" for row in weak) + " are found" in text
    assert f"{sum(one['seeds'] for one in scores)} random synthetic campaigns" in text


def test_decibels_by_source():
    held = record("contributions_record.json")
    rows = held["held_out"]
    known = sum(round(row["ok"] * row["n"]) for row in rows)
    off = sum(row["ok_over_3_db"] for row in rows)
    worst = max(row["ok_worst_db"] for row in rows if row["ok_worst_db"] is not None)
    text = words("Decibels by source")
    assert f"{off} of {known} values are off by more than 3 dB (worst {worst:.1f} dB)" in text
    loud = held["unreferenced"]["0 dB"]
    assert f'{loud["ok_over_3_db"]} of {round(loud["ok"] * loud["n"])} "known" values' in text


def test_orders():
    plain = [row for row in record("orders_record.json")["rows"] if row["case"] == "plain"]
    cut = {round(row["cut"]["level_rms_db"], 1) for row in plain}
    tracked = [row["filter"]["level_rms_db"] for row in sorted(plain, key=lambda row: row["sweep_hz_s"])]
    assert cut == {0.2}
    assert "are 0.2 dB rms by cuts" in words("Orders")
    assert f"{tracked[0]:.2f} dB (slow sweep) to {tracked[-1]:.2f} dB (fast sweep)" in words("Orders")


def test_speed_without_a_tacho():
    held = record("tacholess_record.json")
    unknown, by_mesh = held["unknown"], held["by_first_mesh_db"]
    text = words("Speed without a tacho")
    assert unknown["wrong_harmonic"] == 0
    assert f"Of {unknown['runs']} simulated run-ups {unknown['found']} get a speed" in text
    assert f"the median error is {100 * unknown['rms_median']:.3f} %" in text
    assert f"{held['silent']['runs']} drives without any order" in text and held["silent"]["found"] == 0
    strong, weak = by_mesh["20..60"], by_mesh["-20..5"]
    assert f"{strong['found']} of {strong['runs']} where" in text and f"{weak['found']} of {weak['runs']} below" in text


def test_gears():
    held = record("gear_record.json")["all loads"]
    largest = max(held[kind]["each_other"]["max"] for kind in ("in_contact", "with_separation"))
    assert f"over {held['conditions']} random conditions: they agree within {1e4 * largest:.1f}e-4" in words(
        "The gears"
    )


def test_the_housing():
    held = record("step_record.json")["conditions"]
    off = [row["off_db"]["structure"] for row in held]
    assert f"| {min(off):.2f} to {max(off):.2f} dB, six conditions |" in words("The housing and its sound")
    assert len(held) == 6


def test_the_calibration():
    cases = record("calibration_record.json")["cases"]
    plain = [cases[f"{n} free, {db} dB"]["parameters"] for n in ("two", "three") for db in ("0.3", "1", "3")]
    covered = [one["covered95"]["k"] / one["covered95"]["n"] for case in plain for one in case.values()]
    text = words("The model and its calibration")
    assert f"in {min(covered):.2f} to {max(covered):.3f} of the seeds" in text
    foreign = [case["parameters"] for name, case in cases.items() if name.endswith("model sigma fitted")]
    worst = min(one["covered95"]["k"] / one["covered95"]["n"] for case in foreign for one in case.values())
    assert f"in the worst row {worst:.2f} of the intervals hold" in text


def verdicts(name):
    with (ROOT / "reports" / "example" / name).open(encoding="utf-8", newline="") as stream:
        return [row["verdict"] for row in csv.DictReader(stream)]


def test_beside_the_paper():
    features, numbers = verdicts("features.csv"), verdicts("references.csv")
    kept = features.count("reproduced")
    text = words("Beside the paper")
    assert f"Of {len(features)} features {kept} are reproduced and {len(features) - kept} are not" in text
    assert f"of {len(numbers)} numbers {numbers.count('reproduced')} lie within 1 dB" in text


def test_the_report():
    text = words("The report")
    assert f"at most {PAGE_LIMITS.page_bytes / 1e6:g} MB" in text
    assert f"beyond {PAGE_LIMITS.interactive} figures the zoom" in text
    assert f"{MOST_CONDITIONS} conditions at most: {STEADY_S:g} s of a steady one, {SWEEP_S:g} s of a run-up" in text
