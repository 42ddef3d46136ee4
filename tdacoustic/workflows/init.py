"""A first ``campaign.toml`` from what logs say, with what is missing marked."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from uuid import uuid4

from tdacoustic.campaign import SCHEMA, legal_name
from tdacoustic.campaign.channels import Component
from tdacoustic.errors import CampaignError, OutputError, UnitError
from tdacoustic.formats import scan
from tdacoustic.recording import Log, LogChannel
from tdacoustic.toml_models import path_problem, steering_sign, unique_name
from tdacoustic.units import QUANTITY_SI_SYMBOL, parse_unit, quantity_of_unit
from tdacoustic.workflows.init_calibrators import calibrator_run_lines, is_calibrator_log
from tdacoustic.workflows.toml_text import toml_string

__all__ = ["InitResult", "campaign_text", "make_campaign", "toml_string", "write_campaign"]

_COMPONENTS: Final = " | ".join(Component.__args__)  # type: ignore[attr-defined]
_SENSOR_SIGNALS: Final = ("V", "C")
_SPEED_IN_NAME: Final = re.compile(r"(?:^|(?<=[_\- ]))(\d{1,3}(?:\.\d+)?)[_\- ]?km[_\-]?h(?![^\W_])", re.IGNORECASE)


@dataclass(frozen=True)
class InitResult:
    """A first ``campaign.toml``.

    Parameters
    ----------
    text : str
        The file.
    missing : tuple of str
        What the logs do not say and the engineer has to add, one line each.
    """

    text: str
    missing: tuple[str, ...]


@dataclass(frozen=True)
class _Signal:
    """One channel of the campaign to be: where it is in the logs, and what each of them says of it."""

    name: str
    source: str | int
    said: tuple[LogChannel, ...]


def make_campaign(log_paths: Sequence[str | Path], folder: str | Path) -> InitResult:
    """Scan logs and write the text of a first ``campaign.toml`` for them.

    Parameters
    ----------
    log_paths : sequence of str or Path
        At least one.
    folder : str or Path
        Where the file is to lie; paths in it are relative to that.

    Returns
    -------
    InitResult
        `load_campaign` takes the text as it is. What a sensor sat on is never guessed;
        a speed only where a file name has it as ``40kmh``.

    Raises
    ------
    CampaignError
        No log, or one log twice.
    MissingFileError, FormatError
        From a log.
    """
    return campaign_text([scan(path) for path in log_paths], folder)


def write_campaign(
    log_paths: Sequence[Path], folder: Path | None = None, overwrite: bool = False
) -> tuple[Path, tuple[str, ...]]:
    """Write a first ``campaign.toml`` and return its path and what is missing in it.

    Parameters
    ----------
    log_paths : sequence of Path
    folder : Path, optional
        Default: the working directory.
    overwrite : bool
        Write over a ``campaign.toml`` that is there.

    Raises
    ------
    OutputError
        There is one already, or the folder cannot be written.
    """
    target = (folder or Path()) / "campaign.toml"
    if target.exists() and not overwrite:
        raise OutputError(f"{target}: is there already; give --overwrite or another -o")
    made = make_campaign(log_paths, target.parent)
    # a name nobody can know before: a link of that name, in a folder from outside, would lead the writing elsewhere
    temporary = target.with_name(f".campaign.toml.{uuid4().hex}.partial")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("xb") as stream:
            stream.write(made.text.encode("utf-8"))
        temporary.replace(target)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OutputError(f"{target}: cannot be written ({error.strerror})") from error
    return target, made.missing


def campaign_text(logs: Sequence[Log], folder: str | Path) -> InitResult:
    """Return the text of a first ``campaign.toml`` for scanned logs; see `make_campaign`.

    Parameters
    ----------
    logs : sequence of Log
    folder : str or Path

    Returns
    -------
    InitResult

    Raises
    ------
    CampaignError
        No log, or one log twice.
    """
    if not logs:
        raise CampaignError("a campaign needs at least one log, got none")
    paths = [_relative(log.path, Path(folder)) for log in logs]
    twice = next((path for path, count in Counter(paths).items() if count > 1), None)
    if twice is not None:
        raise CampaignError(f"log {twice!r} is named twice")
    signals = _signals(logs)
    missing: list[str] = []
    lines = [
        f"schema = {toml_string(SCHEMA)}",
        f"name = {toml_string(_name_of(Path(folder)))}",
        'origin = "measured"',
        '# fleet = "fleet.toml"   # the drive; without it sources stay unassigned',
        "",
        "[meta]   # free: weather, rail, train number, ...",
        "",
        "# A key marked MISSING is one that the logs do not say. Take the # away and fill it in.",
    ]
    for signal in signals:
        lines += ["", *_channel_lines(signal, len(logs), missing)]
    lines += _difference_lines(logs, signals, missing)
    of_calibrators = [is_calibrator_log(log.path.stem) for log in logs]
    for log, path, name, held in zip(logs, paths, _run_names(logs), of_calibrators, strict=True):
        if held and not all(of_calibrators):  # a campaign without any test is none
            lines += ["", *calibrator_run_lines(log.path.stem, path, name, missing)]
            lines += _rate_lines(log, name, missing)
        else:
            lines += ["", *_run_lines(log, path, name, _has_speed(log), missing)]
    return InitResult("\n".join(lines) + "\n", tuple(missing))


def _name_of(folder: Path) -> str:
    name = folder.absolute().name
    return name if name.strip() and _can_be_written(name) else "campaign"


def _relative(path: Path, folder: Path) -> str:
    try:
        # a folder behind a symbolic link has the parent of its target
        text = Path(os.path.relpath(path.parent.resolve() / path.name, folder.resolve())).as_posix()
    except ValueError:  # another drive of Windows
        text = path.absolute().as_posix()
    text = f"./{text}" if text.startswith("~") else text
    problem = path_problem(text)
    if problem is not None:
        raise CampaignError(f"log {text!r} {problem}: a campaign cannot name it; rename it")
    return text


def _signals(logs: Sequence[Log]) -> list[_Signal]:
    """Channels of all logs, by name; by number where a log has a name twice or it cannot be written."""
    doubled = {name for log in logs for name, n in Counter(_bare(c.name) for c in log.channels).items() if n > 1}
    by_source: dict[str | int, list[LogChannel]] = {}
    for log in logs:
        for number, channel in enumerate(log.channels, 1):
            source: str | int = channel.name
            if _bare(channel.name) in doubled or not channel.name.strip() or not _can_be_written(channel.name):
                source = number
            by_source.setdefault(source, []).append(channel)
    signals: list[_Signal] = []
    taken: set[str] = set()
    for source, said in by_source.items():
        fallback = f"ch{source}" if isinstance(source, int) else f"ch{len(taken) + 1}"
        name = unique_name(legal_name(said[0].name.removeprefix("/"), fallback), taken)
        taken.add(name)
        signals.append(_Signal(name, source, tuple(said)))
    return signals


def _bare(name: str) -> str:
    return name.removeprefix("/")


def _can_be_written(text: str) -> bool:
    return steering_sign(text) is None and not any(0xD800 <= ord(character) <= 0xDFFF for character in text)


def _agreed_unit(signal: _Signal) -> str | None:
    """Return the unit that all logs state, where it is known and the numbers are in it."""
    units = {channel.unit for channel in signal.said}
    unit = next(iter(units)) if len(units) == 1 else None
    if unit is None or any(channel.full_scale is not None for channel in signal.said):
        return None
    try:
        parse_unit(unit)
    except UnitError:
        return None
    return unit


def _quantity(signal: _Signal) -> str | None:
    quantities = {channel.quantity or quantity_of_unit(channel.unit) for channel in signal.said}
    return next(iter(quantities)) if len(quantities) == 1 else None


def _channel_lines(signal: _Signal, n_logs: int, missing: list[str]) -> Iterator[str]:
    unit, quantity = _agreed_unit(signal), _quantity(signal)
    yield "[[channel]]"
    yield f"name = {toml_string(signal.name)}"
    yield f"source = {signal.source if isinstance(signal.source, int) else toml_string(signal.source)}"
    yield from _scale_lines(signal, unit, quantity, missing)
    if quantity in ("speed", "tacho"):
        yield '# shaft = ""   # MISSING: motor | wheelset'
        missing.append(f"channel {signal.name!r}: shaft (motor or wheelset)")
    elif quantity == "sound_pressure":
        yield '# role = ""   # MISSING: receiver | near_field | reference'
        yield "# distance_m =   # MISSING: from the drive's centre"
        missing.append(f"channel {signal.name!r}: role and distance_m")
    else:
        yield f'# component = ""   # MISSING: {_COMPONENTS}; for a microphone also role and distance_m'
        missing.append(f"channel {signal.name!r}: component")
    if len(signal.said) < n_logs:
        yield f"# in {len(signal.said)} of {n_logs} logs"


def _fits(unit: str, quantity: str | None) -> bool:
    """Whether a quantity can be in a unit."""
    if quantity is None:
        return False
    symbols = {"other": parse_unit(unit).si_symbol, "speed": "m/s"}
    return parse_unit(unit).si_symbol in (QUANTITY_SI_SYMBOL.get(quantity), symbols.get(quantity))


def _scale_lines(signal: _Signal, unit: str | None, quantity: str | None, missing: list[str]) -> Iterator[str]:
    first = signal.said[0]
    if quantity == "tacho":
        yield '# quantity = "tacho"'
        yield "# pulses_per_rev =   # MISSING: and take the # of quantity away"
        missing.append(f"channel {signal.name!r}: pulses_per_rev")
        return
    if unit is not None and parse_unit(unit).si_symbol in _SENSOR_SIGNALS:
        yield f"unit = {toml_string(unit)}   # as the log says"
        if quantity in (None, "voltage", "other"):
            yield '# quantity = ""   # MISSING for a sensor: acceleration | sound_pressure | ...'
        else:
            yield f"quantity = {toml_string(quantity)}   # as the log says"
        yield '# sensitivity = "50 mV/Pa"   # MISSING for a sensor'
        missing.append(f"channel {signal.name!r}: quantity and sensitivity, if it is a sensor")
        return
    if unit is not None:
        if _fits(unit, quantity):
            yield f"quantity = {toml_string(str(quantity))}"
        yield f"unit = {toml_string(unit)}   # as the log says"
        if quantity is not None and not _fits(unit, quantity):
            yield f'# quantity = ""   # the log says {toml_string(quantity)}, which is not in {toml_string(unit)}'
            missing.append(f"channel {signal.name!r}: quantity (the log's, {quantity}, is not in {unit!r})")
        return
    if quantity not in (None, "voltage", "other"):
        yield f"quantity = {toml_string(str(quantity))}"
    else:
        yield '# quantity = ""   # MISSING: acceleration | sound_pressure | speed | tacho | torque | ...'
    if any(channel.full_scale is not None for channel in signal.said):
        yield '# full_scale = "20 Pa"   # MISSING: numbers are fractions of full scale ("10 V" goes with a sensitivity)'
        missing.append(f"channel {signal.name!r}: full_scale")
    elif len({channel.unit for channel in signal.said}) > 1:
        said = ", ".join(toml_string(str(u)) for u in dict.fromkeys(c.unit for c in signal.said))
        yield f'# unit = ""   # the logs differ: {said}; each is read as it says'
        missing.append(f"channel {signal.name!r}: unit (the logs differ: {said})")
    elif first.unit is not None:
        yield f'# unit = ""   # MISSING: the log says {toml_string(first.unit)}, which is not known'
        missing.append(f"channel {signal.name!r}: unit (the log says {toml_string(first.unit)}, which is not known)")
    else:
        yield '# unit = ""   # MISSING: the log does not say; for "V" also sensitivity'
        missing.append(f"channel {signal.name!r}: unit")


def _difference_lines(logs: Sequence[Log], signals: Sequence[_Signal], missing: list[str]) -> list[str]:
    if all(len(signal.said) == len(logs) for signal in signals):
        return []
    missing.append("the logs have different channels: parts of one run go into one [[run]], logs = [..., ...]")
    return ["", "# MISSING: the logs have different channels. Parts of one run go into one [[run]], logs = [..., ...]."]


def _run_names(logs: Sequence[Log]) -> list[str]:
    names: list[str] = []
    for number, log in enumerate(logs, 1):
        names.append(unique_name(legal_name(log.path.stem, f"run {number}"), names))
    return names


def _speed_in_name(stem: str) -> float | None:
    found = _SPEED_IN_NAME.findall(stem)
    return float(found[0]) if len(found) == 1 and float(found[0]) > 0.0 else None


def _has_speed(log: Log) -> bool:
    return any((channel.quantity or quantity_of_unit(channel.unit)) in ("speed", "tacho") for channel in log.channels)


def _run_lines(log: Log, path: str, name: str, has_speed: bool, missing: list[str]) -> Iterator[str]:
    yield "[[run]]"
    yield f"name = {toml_string(name)}"
    yield f"condition = {toml_string(name)}   # runs of one condition are averaged: give repetitions the same one"
    yield '# mode = ""   # traction | brake | coast | hauled'
    speed = _speed_in_name(log.path.stem)
    if speed is not None:
        yield f"train_speed_km_h = {speed:g}   # from the file's name"
    elif has_speed:
        yield "# train_speed_km_h =   # a channel says it"
    else:
        yield "# train_speed_km_h =   # MISSING: or motor_speed_rpm"
        missing.append(f"run {name!r}: train_speed_km_h or motor_speed_rpm")
    yield f"logs = [{toml_string(path)}]"
    yield from _rate_lines(log, name, missing)
    if log.start_time is not None:
        yield f"# began {toml_string(log.start_time)}"


def _rate_lines(log: Log, name: str, missing: list[str]) -> Iterator[str]:
    if any(channel.raster.sample_rate_hz is None for channel in log.channels):
        yield "# sample_rate_hz =   # MISSING: the log does not say"
        missing.append(f"run {name!r}: sample_rate_hz")
