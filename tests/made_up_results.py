"""Makers of result folders from the contracts as they are written down: no code of the package makes them."""

import hashlib
import json
import math
import random
from pathlib import Path

LEVELS = (
    "run,condition,train_speed_km_h,channel,component,quantity,rms,level_db,reference,laeq_db,background_db,correction,"
    "si_unit,level_band_db,level_band_from_hz,level_band_to_hz,calibration,distance_m,role"
)
DOMINANCE = (
    "condition,train_speed_km_h,weighting,dominant,motor_share,gearbox_share,ambiguous_share,unassigned_share,"
    "line_fraction,dominant_excitation,confidence,leading"
)
QUALITY = "run,channel,check,verdict,detail"
LINES = "run,condition,channel,component,frequency_hz,frequency_error_hz,level_db,prominence_db,order,family,rms"
SOURCES = "condition,channel,frequency_hz,level_db,radiator,excitation,source,conflict,confidence,evidence"
BANDS = "run,condition,channel,band_hz,level_db,filter_dependent"
CONDITIONS = (
    "condition,train_speed_km_h,motor_speed_rpm,mesh_frequency_hz,torque_n_m,dte_pp_um,floquet_max,masuda_spl_1m_db,"
    "motor_sound_power_level_db,structure_spl_4m_db,mesh_spl_4m_db,motor_spl_4m_db,spl_4m_db,mode"
)
PREDICTIONS = "condition,receiver,path,weighting,level_db"


def csv(header, rows=()):
    """A table as text; a text with a comma is quoted, None is empty."""

    def cell(value):
        if value is None:
            return ""
        if isinstance(value, bool):
            return "true" if value else "false"
        text = f"{value:.9g}" if isinstance(value, float) else str(value)
        return '"' + text.replace('"', '""') + '"' if set(text) & set(',"') else text

    return "".join(line + "\n" for line in (header, *(",".join(map(cell, row)) for row in rows)))


def level(condition, speed, level_db, *, run=None, channel="mic", distance_m=4.0, role="receiver", correction="none"):
    """A row of levels.csv: a microphone that recorded."""
    rms = 20e-6 * 10 ** (level_db / 20)
    head = (run or condition, condition, speed, channel, "air", "sound_pressure", rms, float(level_db), "20 uPa")
    return (*head, level_db - 3.0, None, correction, "Pa", level_db, 20.0, 5000.0, None, distance_m, role)


def stated(number, condition, level_db, distance_m=4.0):
    """A row of levels.csv: a level that the campaign states."""
    head = (f"level {number}", condition, None, f"{distance_m:g} m", "air", "sound_pressure", 0.5, float(level_db))
    return (*head, "20 uPa", None, None, "none", "Pa", None, None, None, None, distance_m, "receiver")


def verdict(condition, speed, dominant="motor", confidence=0.97, leading=None):
    """A row of dominance.csv."""
    shares = {"motor": (0.9, 0.1), "gearbox": (0.1, 0.9)}.get(dominant, (0.5, 0.5))
    rest = (0.0, 0.0, 0.3, "mesh", confidence, leading or ("motor" if dominant == "undecided" else dominant))
    return (condition, speed, "Z", dominant, *shares, *rest)


def quality(run, channel="mic", check="clipping", word="ok", detail="no sample at full scale"):
    return (run, channel, check, word, detail)


def model(condition, speed, spl_4m_db=85.0, mode="traction"):
    """A row of conditions.csv."""
    return (condition, speed, 500.0, 262.0, 5000.0, 8.5, 0.8, 80.0, 104.0, 70.0, 68.0, 81.0, spl_4m_db, mode)


def fitted(value, low=None, high=None, bounds=(-60.0, 60.0), **keys):
    """A parameter of calibration.json; without ends its interval is open."""
    stderr = None if low is None or high is None else (high - low) / 4
    held = {"value": value, "initial": 0.0, "min": bounds[0], "max": bounds[1], "stderr": stderr, "ci95": [low, high]}
    return {**held, "expression": None, **keys}


def calibration(parameters, doubts=(), residuals=None):
    return json.dumps(
        {
            "schema": "tdacoustic-calibration/1",
            "parameters": parameters,
            "residuals": residuals
            or [{"condition": "1", "measured_db": 85.0, "predicted_db": 84.5, "sigma_db": 1.0, "receiver": "4 m"}],
            "left_out": [],
            "doubts": list(doubts),
        }
    )


def made_result(folder, name="Campaign", origin="measured", fleet="Fleet A", command="run", **keys):
    """Write a result folder and return it.

    ``meta`` and ``started`` go to the campaign, ``inputs`` are sha256 of logs, ``files`` are further or other files;
    every other key is the rows of the table of that name.
    """
    headers = {"levels": LEVELS, "dominance": DOMINANCE, "quality": QUALITY, "lines": LINES, "sources": SOURCES}
    headers |= {"bands": BANDS}
    if "conditions" in keys or "predictions" in keys:
        headers |= {"conditions": CONDITIONS, "predictions": PREDICTIONS}
    files = {f"{table}.csv": csv(header, keys.get(table, ())) for table, header in headers.items()}
    files |= {"report.html": f"<!doctype html><title>{hashlib.sha256(name.encode()).hexdigest()}</title>"}
    files |= keys.get("files", {})
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    campaign = {"name": name, "origin": origin}
    campaign |= {key: keys[key] for key in ("meta", "started") if key in keys}
    inputs = [{"file": "campaign.toml", "sha256": sha(f"{name}{folder.name}"), "bytes": 500, "format": "campaign"}]
    logs = keys.get("inputs", [sha(str(folder))])
    inputs += [{"file": f"{i}.h5", "sha256": log, "bytes": 1000, "format": "hdf5"} for i, log in enumerate(logs)]
    manifest = {
        "schema": "tdacoustic-manifest/1",
        "subject": "../campaign.toml",
        "complete": True,
        "command": command,
        "campaign": campaign,
        **({"fleet": {"name": fleet}} if fleet else {}),
        "inputs": inputs,
        "versions": {"tdacoustic": "0.1.0"},
        "problems": list(keys.get("problems", ())),
        "files": {file: hashlib.sha256((folder / file).read_bytes()).hexdigest() for file in files},
    }
    write_manifest(folder, manifest)
    return folder


def sha(text):
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))


def write_manifest(folder, manifest):
    (folder / "manifest.json").write_text(json.dumps(manifest, ensure_ascii=False), encoding="utf-8")


def hashed_again(folder):
    """Make the manifest true to the files as they are now: what somebody does who means harm."""
    held = manifest_of(folder)
    held["files"] = {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in held["files"]}
    write_manifest(folder, held)


SPEEDS = (20.0, 30.0, 40.0, 50.0, 60.0)


def many_results(root, count, seed=1, lines=20, trains=60, origins=("measured", "measured", "measured", "synthetic")):
    """Write results of made-up type tests: trains of several fleets over years, some of them odd."""
    chance = random.Random(seed)
    for number in range(count):
        fleet = f"Fleet {'ABC'[number % 3]}"
        train = f"{fleet[-1]} {100 + number // 2 % trains}"
        year = 2016 + number * 10 // count
        origin = origins[number % len(origins)]
        offset = chance.gauss(0.0, 1.0) + {"A": 0.0, "B": 1.5, "C": -2.0}[fleet[-1]] + 0.1 * (year - 2016)
        if number % 97 == 11:
            offset += 14.0
        levels, verdicts, checks, found, models = [], [], [], [], []
        for speed in SPEEDS:
            name, actual = f"{speed:g}", speed + chance.gauss(0.0, 0.3)
            level_db = 60.0 + 30.0 * math.log10(speed / 2.0) - 5.0 + offset + chance.gauss(0.0, 0.4)
            levels += [
                level(name, actual, level_db, run=f"{name}a"),
                level(name, actual, level_db + 0.3, run=f"{name}b"),
            ]
            share = 1.0 / (1.0 + math.exp((speed - 42.0) / 5.0 + chance.gauss(0.0, 0.6)))
            word = "motor" if share > 0.75 else "gearbox" if share < 0.25 else "undecided"
            verdicts.append(verdict(name, actual, word, max(share, 1 - share), "motor" if share > 0.5 else "gearbox"))
            for run in (f"{name}a", f"{name}b"):
                bad = chance.random() < 0.03
                words = ("clipping", "bad", "412 samples at full scale") if bad else ("clipping", "ok", "none")
                checks += [quality(run, "mic", *words), quality(run, "motor_z", "dropouts", "ok", "none")]
                if chance.random() < 0.08:
                    checks.append(quality(run, "mic", "level", "warning", "12 dB below the other runs"))
                found += [
                    (run, name, "mic", "air", 100.0 * k, 0.1, 60.0 - k, 10.0, float(k), "", 0.01) for k in range(lines)
                ]
            models.append(model(name, speed, level_db + chance.gauss(0.0, 2.0)))
        stuck = number % 13 == 5
        values = {
            "masuda.constant_db": fitted(20.0 + offset, 19.0 + offset, 21.4 + offset),
            "gear_dynamics.mesh_damping_ratio": fitted(0.5, bounds=(0.005, 0.5))
            if stuck
            else fitted(0.07 + 0.004 * chance.gauss(0.0, 1.0), 0.06, None if number % 17 == 3 else 0.09, (0.005, 0.5)),
        }
        doubts = (
            ["gear_dynamics.mesh_damping_ratio ended on its bound 0.5: the optimum may lie beyond it"] if stuck else []
        )
        made_result(
            Path(root) / f"{year}" / f"campaign-{number:04d}",
            name=f"Type test {number}",
            origin=origin,
            fleet=fleet,
            meta={"train": train, "date": f"{year}-{1 + number % 12:02d}-15"} if number % 19 else {"note": "none"},
            levels=levels,
            dominance=verdicts,
            quality=checks,
            lines=found,
            conditions=models,
            files={"calibration.json": calibration(values, doubts)},
        )
