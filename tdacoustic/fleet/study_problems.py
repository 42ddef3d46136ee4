"""What is wrong with the studies that a fleet asks for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tdacoustic.errors import FleetError
from tdacoustic.fleet.entries import split_entry
from tdacoustic.fleet.messages import key_problem
from tdacoustic.toml_models import nearest

if TYPE_CHECKING:
    from tdacoustic.fleet.fleet import Fleet

__all__ = ["study_problems"]


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
        for key, _ in sweep.parameters:
            problem = _key_problem(fleet, key)
            if problem is not None:
                yield f"{where}: {problem}"
        yield from (f"{where}: {problem}" for problem in _foreign(fleet, sweep.conditions))
    for number, reference in enumerate(fleet.reference, 1):
        where = f"[[reference]] {number}"
        yield from (f"{where}: {problem}" for problem in _foreign(fleet, reference.condition or ()))
        if reference.helix_angle_deg is not None:
            yield from (f"{where}: {p}" for p in _foreign_angles(fleet, (f"{reference.helix_angle_deg:g}",)))
    for feature in fleet.feature:
        of = _foreign if feature.over == "conditions" else _foreign_angles
        yield from (f"[[feature]] {feature.label!r}: {problem}" for problem in of(fleet, feature.at))


def _key_problem(fleet: Fleet, key: str) -> str | None:
    whole, place = split_entry(key)
    problem = key_problem(whole)
    if problem is None and place:
        try:
            fleet.value_of(key)
        except FleetError as error:
            return str(error).removeprefix(f"{fleet.path}: ")
    return problem


def _foreign(fleet: Fleet, names: Sequence[str]) -> Iterator[str]:
    known = fleet.operation.names
    for name in names if known else ():
        if name not in known:
            yield f"there is no condition {name!r}; the nearest is {nearest(name, known) or known[0]!r}"


def _foreign_angles(fleet: Fleet, angles: Sequence[str]) -> Iterator[str]:
    stated = fleet.operation.helix_angle_deg
    known = () if stated is None else tuple(f"{angle:g}" for angle in stated.value)
    for angle in angles:
        if angle not in known:
            has = f"has {', '.join(known)}" if known else "has none"
            yield f"there is no helix angle {angle}°: [operation] helix_angle_deg {has}"
