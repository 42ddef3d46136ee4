"""What is wrong with the changes that a fleet asks for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import FleetError
from tdacoustic.fleet.entries import split_entry
from tdacoustic.fleet.messages import key_problem

if TYPE_CHECKING:
    from tdacoustic.fleet.fleet import Fleet
    from tdacoustic.fleet.what_if import WhatIf

__all__ = ["what_if_problems"]

NOT_OF_THE_DRIVE: Final = ("radiation.", "operation.train_speed_km_h", "operation.helix_angle_deg")
"""Parameters that say where and at which speeds levels are wanted, not what the drive is."""


def what_if_problems(fleet: Fleet) -> Iterator[str]:
    """Yield what contradicts in ``[[what_if]]``, one line each.

    Names of conditions are not looked at: a campaign may name them.

    Parameters
    ----------
    fleet : Fleet
    """
    names = [case.name for case in fleet.what_if]
    twice = next((name for number, name in enumerate(names) if name in names[:number]), None)
    if twice is not None:
        yield f"[[what_if]]: the name {twice!r} stands twice"
    for case in fleet.what_if:
        where = f"[[what_if]] {case.name!r}"
        problems = [problem for key, _ in case.parameters if (problem := _key_problem(key)) is not None]
        if not problems:
            problems = list(_value_problems(fleet, case))
        yield from (f"{where}: {problem}" for problem in problems)


def _key_problem(key: str) -> str | None:
    problem = key_problem(split_entry(key)[0])
    if problem is None and key.startswith(NOT_OF_THE_DRIVE):
        return f"{key} says where and at which speeds levels are wanted, not what the drive is"
    return problem


def _value_problems(fleet: Fleet, case: WhatIf) -> Iterator[str]:
    """What a file with these values would be refused for."""
    try:
        fleet.replaced(dict(case.parameters))
    except FleetError as error:
        yield str(error).removeprefix(f"{fleet.path}: ").splitlines()[0]
