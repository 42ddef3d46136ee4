"""``sensors.csv`` as a view of what sensor database and calibrators say of the channels' scales."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tdacoustic.measured.run_sensors import CampaignSensors, DatabaseUse
from tdacoustic.sensors.calibrator_check import CalibratorCheck
from tdacoustic.sensors.channel_calibration import ChannelCalibration
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.units import QUANTITY_SI_SYMBOL

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["sensor_table"]


def sensor_table(found: CampaignSensors) -> dict[str, pd.DataFrame]:
    """Return ``sensors`` as a frame; none of a campaign without calibrator runs and without sensors of a database.

    First what the database gives each channel, of kind ``database``; then what each calibrator run shows of each
    channel; then, of kind ``calibration`` and without a run, what follows for the channel.

    Parameters
    ----------
    found : CampaignSensors
    """
    if not found.any:
        return {}
    sensors = {use.channel: use.sensor for use in found.database}
    rows: list[Row] = [_of_database(use) for use in found.database]
    for item in found.calibrations:
        rows += [{**_of_check(item, check), "sensor": sensors.get(item.channel)} for check in item.checks]
        rows.append({**_of_channel(item), "sensor": sensors.get(item.channel)})
    return {"sensors": frame_of("sensors", rows)}


def _of_database(use: DatabaseUse) -> Row:
    entry = use.chosen.entry
    return {
        "channel": use.channel,
        "sensor": use.sensor,
        "run": ", ".join(use.runs),
        "kind": "database",
        "sensitivity_stated": entry.sensitivity,
        "scale_from": "sensor database" if use.used else "campaign or log",
        "calibrated_on": None if entry.date is None else str(entry.date),
        "due_on": None if entry.due is None else str(entry.due),
        "verdict": "warning" if use.doubts else "ok",
        "reason": "; ".join(use.doubts) or None,
    }


def _of_check(item: ChannelCalibration, check: CalibratorCheck) -> Row:
    calibrator, plateau = check.run.calibrator, check.plateau
    in_si = check.read_si is not None
    row: Row = {
        "channel": item.channel,
        "run": check.run.name,
        "kind": f"calibration_{check.run.kind}",
        "series": float(item.series),
        "calibrator": None if calibrator is None else calibrator.words,
        "wanted_hz": check.run.frequency_hz,
        "read": check.read_si if in_si else check.rms,
        "expected": None if calibrator is None else calibrator.rms,
        "unit": _unit(check) if in_si else check.scale.unit,
        "deviation_db": check.deviation_db,
        "sensitivity_stated": check.scale.words or None,
        "sigma_db": check.sigma_db,
        "verdict": check.verdict,
        "reason": check.reason,
    }
    if plateau is not None:
        row |= {
            "frequency_hz": plateau.frequency_hz,
            "steadiness_db": plateau.steadiness_db,
            "distortion_percent": 100.0 * plateau.distortion,
            "from_s": plateau.start_s,
            "to_s": plateau.end_s,
        }
    return row


def _unit(check: CalibratorCheck) -> str:
    calibrator = check.run.calibrator
    return "" if calibrator is None else QUANTITY_SI_SYMBOL[calibrator.quantity]


def _of_channel(item: ChannelCalibration) -> Row:
    stated = item.checks[0].scale.words
    return {
        "channel": item.channel,
        "run": "",
        "kind": "calibration",
        "series": float(item.series),
        "deviation_db": item.deviation_db,
        "sensitivity_stated": stated or None,
        "sensitivity_set": item.scale.words if item.action == "set" else None,
        "drift_db": item.drift_db,
        "sigma_db": item.sigma_db,
        "scale_from": "calibrator" if item.action == "set" else None,
        "verdict": item.verdict,
        "reason": item.reason,
    }
