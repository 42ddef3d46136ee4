"""What is wrong with the studies that a fleet asks for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.errors import FleetError
from tdacoustic.fleet.design_sweep import Range, Swept
from tdacoustic.fleet.entries import split_entry
from tdacoustic.fleet.messages import key_problem
from tdacoustic.toml_models import nearest, shown

if TYPE_CHECKING:
    from tdacoustic.fleet.fleet import Fleet
    from tdacoustic.fleet.studies import Feature

__all__ = ["check_studies", "study_problems"]

_KINDS: Final = {"numbers": "numbers", "words": "words", "truth": "true or false", "mixed": "values of one kind"}


def study_problems(fleet: Fleet) -> Iterator[str]:
    """Yield what contradicts in ``[[sweep]]``, ``[[reference]]`` and ``[[feature]]``, one line each.

    Names of conditions are looked at where ``[operation]`` has some: else the campaign names them.

    Parameters
    ----------
    fleet : Fleet
    """
    for kind, labels in (
        ("sweep", [one.name for one in fleet.sweep]),
        ("feature", [one.label for one in fleet.feature]),
    ):
        twice = next((label for number, label in enumerate(labels) if label in labels[:number]), None)
        if twice is not None:
            yield f"[[{kind}]]: the name {twice!r} stands twice"
    for sweep in fleet.sweep:
        where = f"[[sweep]] {sweep.name!r}"
        for key, held in sweep.parameters:
            problem = _key_problem(fleet, key)
            wrong = [*_swept_problems(fleet, key, held)] if problem is None else [problem]
            yield from (f"{where}: {one}" for one in wrong)
        yield from (f"{where}: {problem}" for problem in _foreign(fleet, sweep.conditions))
    for number, reference in enumerate(fleet.reference, 1):
        where = f"[[reference]] {number}"
        if reference in fleet.reference[: number - 1]:
            yield f"{where}: says the same as [[reference]] {fleet.reference.index(reference) + 1}"
        yield from (f"{where}: {problem}" for problem in _foreign(fleet, reference.condition or ()))
        if reference.helix_angle_deg is not None:
            yield from (f"{where}: {p}" for p in _foreign_angles(fleet, (f"{reference.helix_angle_deg:g}",)))
    for feature in fleet.feature:
        of = _foreign if feature.over == "conditions" else _foreign_angles
        problems = [*of(fleet, feature.at), *_all_named(fleet, feature)]
        yield from (f"[[feature]] {feature.label!r}: {problem}" for problem in problems)


def check_studies(fleet: Fleet, conditions: Iterable[str]) -> None:
    """Raise for conditions of ``[[sweep]]``, ``[[reference]]`` and ``[[feature]]`` that there are not.

    For a fleet whose ``[operation]`` has none, so that a campaign names them; others are checked when they are read.

    Parameters
    ----------
    fleet : Fleet
    conditions : iterable of str
        Names of those that are computed.

    Raises
    ------
    FleetError
    """
    if fleet.operation.names:
        return
    known = tuple(conditions)
    asked = [(f"[[sweep]] {one.name!r}", one.conditions) for one in fleet.sweep]
    asked += [(f"[[reference]] {number}", one.condition or ()) for number, one in enumerate(fleet.reference, 1)]
    asked += [(f"[[feature]] {one.label!r}", one.at) for one in fleet.feature if one.over == "conditions"]
    for where, names in asked:
        for problem in _foreign_names(names, known):
            raise FleetError(f"{fleet.path}: {where}: {problem}")


def _key_problem(fleet: Fleet, key: str) -> str | None:
    whole, place = split_entry(key)
    problem = key_problem(whole)
    if problem is None and place:
        try:
            fleet.value_of(key)
        except FleetError as error:
            return str(error).removeprefix(f"{fleet.path}: ")
    return problem


def _swept_problems(fleet: Fleet, key: str, held: Swept) -> Iterator[str]:
    yield from _range_problems(fleet, key, held) if isinstance(held, Range) else _value_problems(fleet, key, held)


def _value_problems(fleet: Fleet, key: str, values: Sequence[Any]) -> Iterator[str]:
    """Values of a sweep that are of another kind than the parameter's; numbers out of range are points without a row.

    Of a parameter that the file leaves out nothing is known here.
    """
    try:
        own = fleet.value_of(key)
    except FleetError:
        return
    kind = _kind(own)
    wrong = [value for value in values if _kind(value) != kind]
    if wrong:
        yield f"parameters must have {_KINDS[kind]} for {key!r}, got {', '.join(shown(value) for value in wrong)}"
    elif kind == "words":
        yield from (problem for value in values if (problem := _refused(fleet, key, value)) is not None)


def _range_problems(fleet: Fleet, key: str, held: Range) -> Iterator[str]:
    """A range of what is no single number, or one that reaches beyond what a file may have.

    Of a parameter that the file leaves out nothing is known here.
    """
    try:
        own = fleet.value_of(key)
    except FleetError:
        return
    if isinstance(own, tuple):
        yield f"parameters has a range for {key!r}, which is a list: name one of its entries, as '{key}.1'"
    elif _kind(own) != "numbers":
        yield f"parameters has a range for {key!r}, which is no number: it is {shown(own)}"
    elif isinstance(own, int) and not (isinstance(held.low, int) and isinstance(held.high, int)):
        yield f"parameters must have whole numbers as from and to in the range of {key!r}"
    else:
        refused = (_refused(fleet, key, end) for end in (held.low, held.high))
        yield from (f"the range of {key!r} reaches too far: {problem}" for problem in refused if problem is not None)


def _refused(fleet: Fleet, key: str, value: Any) -> str | None:
    """Why a file could not have a value, in one line; None where it could."""
    try:
        fleet.replaced({key: value})
    except FleetError as error:
        return str(error).removeprefix(f"{fleet.path}: ").splitlines()[0]
    return None


def _kind(value: Any) -> str:
    """What a value is; a number and a list or table of them may stand for each other."""
    if isinstance(value, tuple):
        kinds = {_kind(entry) for entry in value}
        return kinds.pop() if len(kinds) == 1 else "mixed"
    return "truth" if isinstance(value, bool) else "words" if isinstance(value, str) else "numbers"


def _all_named(fleet: Fleet, feature: Feature) -> Iterator[str]:
    """A place of the extreme that could be anywhere."""
    known = fleet.operation.names if feature.over == "conditions" else _angles(fleet)
    if feature.at and set(known) <= set(feature.at):
        what = "conditions" if feature.over == "conditions" else "helix angles"
        yield f"at names all {what}, so that nothing is said: leave out where the {feature.shape[:-3]} value is not"


def _foreign(fleet: Fleet, names: Sequence[str]) -> Iterator[str]:
    if fleet.operation.names:
        yield from _foreign_names(names, fleet.operation.names)


def _foreign_names(names: Sequence[str], known: Sequence[str]) -> Iterator[str]:
    foreign = [name for name in names if name not in known]
    if foreign:
        near = "" if len(foreign) > 1 or not known else f"; the nearest is {nearest(foreign[0], known) or known[0]!r}"
        named = ", ".join(repr(name) for name in foreign)
        yield f"there is no condition {named}{near}; there are {', '.join(known) or 'none'}"


def _foreign_angles(fleet: Fleet, angles: Sequence[str]) -> Iterator[str]:
    known = _angles(fleet)
    foreign = [angle for angle in angles if angle not in known]
    if foreign:
        has = f"has {', '.join(known)}" if known else "has none"
        yield f"there is no helix angle {', '.join(f'{a}°' for a in foreign)}: [operation] helix_angle_deg {has}"


def _angles(fleet: Fleet) -> tuple[str, ...]:
    stated = fleet.operation.helix_angle_deg
    return () if stated is None else tuple(f"{angle:g}" for angle in stated.value)
