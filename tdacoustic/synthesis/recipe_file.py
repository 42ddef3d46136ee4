"""Reading a recipe from its file, with messages that name the key, the file and what was probably meant."""

from __future__ import annotations

import difflib
import tomllib
import typing
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from tdacoustic.errors import MissingFileError, RecipeError
from tdacoustic.synthesis.recipe import SCHEMA, LineRecipe, Recipe

__all__ = ["load_recipe", "parse_recipe"]


def load_recipe(path: str | Path) -> Recipe:
    """Read and check a recipe.

    Parameters
    ----------
    path : str or Path
        A TOML file with ``schema = "tdacoustic-synthesis/1"``.

    Returns
    -------
    Recipe

    Raises
    ------
    MissingFileError
        There is no such file.
    RecipeError
        No TOML, an unknown key (the nearest known one is named), a value out of its range, or a contradiction.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        raise MissingFileError(f"recipe {path} does not exist") from None
    except IsADirectoryError:
        raise RecipeError(f"{path} is a folder, not a recipe") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise RecipeError(f"{path} is not valid TOML: {error}") from None
    return parse_recipe(content, where=str(path))


def parse_recipe(content: dict[str, Any], where: str = "recipe") -> Recipe:
    """Check the content of a recipe that is already in memory.

    Parameters
    ----------
    content : dict
        As `tomllib` gives it.
    where : str
        How messages call it.

    Raises
    ------
    RecipeError
        See `load_recipe`.
    """
    if content.get("schema") != SCHEMA:
        raise RecipeError(f'{where}: schema must be "{SCHEMA}", got {content.get("schema")!r}')
    try:
        recipe = Recipe.model_validate(content)
    except ValidationError as error:
        raise RecipeError("; ".join(_messages(error, content, where))) from None
    problems = list(_contradictions(recipe))
    if problems:
        raise RecipeError(f"{where}: " + "; ".join(problems))
    return recipe


def _messages(error: ValidationError, content: dict[str, Any], where: str) -> Iterable[str]:
    seen = set()
    for detail in error.errors(include_url=False):
        # pydantic names the alternative of a union too: ("level_db", "dict[str,float]", "mic")
        loc = [part for part in detail["loc"] if part != "float" and not str(part).startswith("dict[")]
        place = _place(loc, content)
        if detail["type"] == "extra_forbidden":
            known = _known_keys(loc[:-1])
            close = difflib.get_close_matches(str(loc[-1]), known, n=1, cutoff=0.0)
            text = f"{where}: unknown key '{place}'; the nearest known key is '{close[0]}'"
        elif detail["type"] == "missing":
            text = f"{where}: key '{place}' is missing"
        else:
            message = detail["msg"].removeprefix("Value error, ")
            value = detail.get("input")
            got = f", got {value!r}" if isinstance(value, (str, int, float)) and "got" not in message else ""
            text = f"{where}: '{place}': {message}{got}"
        if text not in seen:
            seen.add(text)
            yield text


def _place(loc: Sequence[int | str], content: Any) -> str:
    """Write a location as ``condition[3].line[0].order``, a table that has a name as ``channel[motor_z]``."""
    text = ""
    for part in loc:
        try:
            content = content[part]
        except (KeyError, IndexError, TypeError):
            content = None
        if isinstance(part, int):
            name = content.get("name") if isinstance(content, dict) else None
            text += f"[{name if name is not None else part + 1}]"
        else:
            text += f".{part}" if text else part
    return text


def _known_keys(loc: Sequence[int | str]) -> list[str]:
    model: type[BaseModel] = Recipe
    for part in loc:
        if isinstance(part, str):
            fields = {field.alias or name: field for name, field in model.model_fields.items()}
            if part not in fields:
                break
            model = _model_in(fields[part].annotation) or model
    return [field.alias or name for name, field in model.model_fields.items()]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for part in typing.get_args(annotation) if (found := _model_in(part))), None)


def _contradictions(recipe: Recipe) -> Iterable[str]:
    for kind, names in (
        ("channels", [channel.name for channel in recipe.channel]),
        ("conditions", [condition.name for condition in recipe.condition]),
        ("gear pairs", [pair.name for pair in recipe.kinematics.gear_pair]),
    ):
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield f"two {kind} are called {name!r}"
    known = {channel.name for channel in recipe.signal_channels}
    known |= {channel.component for channel in recipe.signal_channels}
    known |= {channel.role for channel in recipe.signal_channels if channel.role}
    background = recipe.background
    tables = [("path.to", [path.to]) for path in recipe.path]
    for condition in recipe.condition:
        for key in ("floor_gain_db", "level_db", "line_fraction"):
            tables.append((f"condition[{condition.name}].{key}", list(getattr(condition, key))))
        for key in set(recipe.per_channel(condition.line_fraction)) - set(recipe.per_channel(condition.level_db)):
            yield f"condition[{condition.name}].line_fraction names {key!r}, whose level_db is not prescribed"
        yield from _speed_contradictions(recipe, condition.name)
    if background is not None and isinstance(background.floor_gain_db, dict):
        tables.append(("background.floor_gain_db", list(background.floor_gain_db)))
    for place, line, carrier in _lines(recipe):
        for key in ("level_db", "prominence_db"):
            if isinstance(getattr(line, key), dict):
                tables.append((f"{place}.{key}", list(getattr(line, key))))
        if line.gear_pair is not None and line.gear_pair not in [pair.name for pair in recipe.kinematics.gear_pair]:
            yield f"{place}: gear_pair {line.gear_pair!r} does not exist"
        if line.carrier is not None and not carrier:
            yield f"{place} follows the carrier, but its condition has no carrier_hz"
        if not recipe.channel_levels(line):
            yield f"{place}: no channel shows a line of source {line.source!r}; name the channels in level_db"
    for place, keys in tables:
        for key in keys:
            if key not in known:
                close = difflib.get_close_matches(key, sorted(known), n=1, cutoff=0.0)
                yield f"{place} names {key!r}, no channel, role or component here; the nearest is {close[0]!r}"
    for path in recipe.path:
        if not recipe.targets(path.source):
            yield f"path.from names {path.source!r}, but no channel of vibration or sound is on it"


def _speed_contradictions(recipe: Recipe, name: str) -> Iterable[str]:
    condition = next(condition for condition in recipe.condition if condition.name == name)
    if condition.is_run_up and not any(channel.quantity in ("tacho", "speed") for channel in recipe.channel):
        yield f"condition[{name}] changes its speed, but no tacho or speed channel would show it"


def _lines(recipe: Recipe) -> Iterable[tuple[str, LineRecipe, bool]]:
    every = all(condition.carrier_hz for condition in recipe.condition)
    for index, line in enumerate(recipe.line, start=1):
        yield f"line[{line.name or index}]", line, every
    for condition in recipe.condition:
        for index, line in enumerate(condition.line, start=1):
            yield f"condition[{condition.name}].line[{line.name or index}]", line, condition.carrier_hz is not None
    if recipe.background is not None:
        for index, line in enumerate(recipe.background.line, start=1):
            yield f"background.line[{line.name or index}]", line, False
