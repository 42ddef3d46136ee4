"""From a recipe to a folder: logs, `campaign.toml`, and the truth, written last."""

from __future__ import annotations

import contextlib
import datetime
import hashlib
import json
import os
import re
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tdacoustic.errors import OutputError
from tdacoustic.synthesis.campaign_file import campaign_toml
from tdacoustic.synthesis.logs import StoredChannel, quantise, write_log
from tdacoustic.synthesis.recipe import ChannelRecipe, Recipe
from tdacoustic.synthesis.recipe_file import load_recipe
from tdacoustic.synthesis.run import RunPlan, SyntheticRun, make_run, plan_runs
from tdacoustic.synthesis.truth import TRUTH_SCHEMA, doubts_of, run_truth

__all__ = ["SynthesisResult", "synthesize"]

_GENERATOR_VERSION = 1
_BITS_OF_TACHO, _BITS_OF_SPEED = 8, 16
_PAUSE_BETWEEN_RUNS_S = 60.0


@dataclass(frozen=True)
class SynthesisResult:
    """What was written.

    Parameters
    ----------
    campaign : Path
        The campaign file.
    files : tuple of Path
        Every file written, `truth.json` last.
    truth : mapping
        Content of `truth.json`.
    doubts : tuple of str
        What a reader of the logs may not see as the recipe says it.
    """

    campaign: Path
    files: tuple[Path, ...]
    truth: Mapping[str, Any]
    doubts: tuple[str, ...]


def synthesize(
    recipe_path: str | Path,
    out_dir: str | Path,
    seed: int | None = None,
    *,
    overwrite: bool = False,
    on_run: Callable[[str], None] | None = None,
) -> SynthesisResult:
    """Make a synthetic campaign: one HDF5 log a run, `campaign.toml`, and `truth.json`.

    Equal recipe, seed and versions of the libraries give equal bytes. Every file is written under a temporary name and
    renamed; `truth.json`, which names the others with their sha256, comes last. A folder whose `truth.json` is of a
    campaign of the same name is refreshed in place, and logs that it lists and that are no longer made are removed.

    Parameters
    ----------
    recipe_path : str or Path
    out_dir : str or Path
        Made if it does not exist. May be the recipe's own folder.
    seed : int, optional
        Instead of the recipe's.
    overwrite : bool
        Replace files of the same names that are in the way.
    on_run : callable, optional
        Called with the name of each run before it is made.

    Returns
    -------
    SynthesisResult

    Raises
    ------
    MissingFileError, RecipeError
        The recipe does not exist or is wrong.
    OutputError
        Something else is in the way, or the folder cannot be written.
    """
    recipe_path, out_dir = Path(recipe_path), Path(out_dir)
    recipe = load_recipe(recipe_path)
    used_seed = recipe.seed if seed is None else seed
    plans = plan_runs(recipe)
    logs = _log_names(plans)
    out_dir_existed = out_dir.exists()
    try:
        out_dir.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"output folder {out_dir} cannot be made: {error.strerror or error}") from None
    old_truth = _old_truth(out_dir)
    names = [*logs, "campaign.toml", "truth.json"]
    if not overwrite and old_truth.get("name") != recipe.name:
        in_the_way = [name for name in names if (out_dir / name).exists()]
        if in_the_way:
            raise OutputError(f"{out_dir} already holds {in_the_way[0]}, which is not of this recipe; use --overwrite")
    for name in names:  # what a killed run left
        for leftover in out_dir.glob(f".{name}.*.part"):
            leftover.unlink(missing_ok=True)
    start, runs, doubts, files = recipe.start_time, [], [], []
    try:
        for plan, log in zip(plans, logs, strict=True):
            if on_run is not None:
                on_run(plan.name)
            run = make_run(recipe, plan, used_seed)
            stored = _quantised(recipe, run)
            title = f"synthetic: {recipe.name}, run {plan.name}"
            files.append(_write(out_dir / log, partial(_log, stored=stored, title=title, start=start)))
            runs.append(run_truth(recipe, run, log, stored))
            doubts += doubts_of(recipe, run, stored)
            if start is not None:
                start += datetime.timedelta(seconds=run.motion.time_s.size / recipe.sample_rate_hz)
                start += datetime.timedelta(seconds=_PAUSE_BETWEEN_RUNS_S)
    except BaseException:
        if not out_dir_existed and not any(out_dir.iterdir()):
            out_dir.rmdir()
        raise
    text = campaign_toml(recipe, list(zip(plans, logs, strict=True)), recipe_path.name, used_seed)
    files.append(_write(out_dir / "campaign.toml", lambda path: path.write_bytes(text.encode())))
    truth = _rounded(
        {
            "schema": TRUTH_SCHEMA,
            "origin": "synthetic",
            "name": recipe.name,
            "seed": used_seed,
            "generator_version": _GENERATOR_VERSION,
            "recipe": {"file": recipe_path.name, "sha256": _sha256(recipe_path)},
            "sample_rate_hz": recipe.sample_rate_hz,
            "level_band_hz": list(recipe.band_hz),
            "prominence_bandwidth_hz": recipe.prominence_bandwidth_hz,
            "kinematics": recipe.kinematics.model_dump(),
            "paths": [path.model_dump(by_alias=True) for path in recipe.path],
            "runs": runs,
            "doubts": doubts,
            "files": {path.name: _sha256(path) for path in files},
        }
    )
    content = json.dumps(truth, ensure_ascii=False, allow_nan=False, indent=1).encode() + b"\n"
    for stale in set(old_truth.get("files", {})) - set(names):
        if re.fullmatch(r"[^/\\]+\.h5", stale):
            (out_dir / stale).unlink(missing_ok=True)
    files.append(_write(out_dir / "truth.json", lambda path: path.write_bytes(content)))
    return SynthesisResult(out_dir / "campaign.toml", tuple(files), truth, tuple(doubts))


def _log(path: Path, stored: dict[str, StoredChannel], title: str, start: datetime.datetime | None) -> None:
    write_log(path, list(stored.values()), title=title, start_time=start)


def _quantised(recipe: Recipe, run: SyntheticRun) -> dict[str, StoredChannel]:
    stored = {}
    for channel in recipe.channel:
        rate = recipe.sample_rate_hz / channel.decimation
        stored[channel.name] = quantise(channel, run.samples(recipe, channel), _bits(recipe, channel), rate)
    return stored


def _bits(recipe: Recipe, channel: ChannelRecipe) -> int:
    if channel.bits is not None:
        return channel.bits
    return {"tacho": _BITS_OF_TACHO, "speed": _BITS_OF_SPEED}.get(channel.quantity, recipe.bits)


def _log_names(plans: tuple[RunPlan, ...]) -> list[str]:
    names: list[str] = []
    for plan in plans:
        stem = re.sub(r"[^\w.]+", "-", plan.name).strip("-.")
        stem = stem if plan.kind == "background" else f"condition-{stem}"
        name, count = f"{stem}.h5", 2
        while name.casefold() in [other.casefold() for other in names]:
            name, count = f"{stem}-{count}.h5", count + 1
        names.append(name)
    return names


def _old_truth(out_dir: Path) -> dict[str, Any]:
    try:
        content = json.loads((out_dir / "truth.json").read_bytes())
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) and content.get("schema") == TRUTH_SCHEMA else {}


def _write(path: Path, write: Callable[[Path], object]) -> Path:
    """Write under a temporary name beside the target, then rename."""
    temporary = None
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
        os.close(handle)
        temporary = Path(name)
        write(temporary)
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}") from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
    return path


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _rounded(value: Any) -> Any:
    """Nine significant digits are enough for the truth, and free it from the last bit of a library's sine."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.9g}")
    return value
