"""What the paper prints of its gears' meshing noise: facts to hold a prediction against, in one place."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tdacoustic.drive import GearState
from tdacoustic.fleet import Fleet

__all__ = [
    "DTE_PP_UM",
    "FIGURE_11_CONDITION",
    "LARGEST_ERROR_DB",
    "LEVEL_OF_TEXT_DB",
    "MEASURED_4M",
    "MODEL_4M",
    "PAPER",
    "TABLE_5",
    "Printed",
    "PrintedLevel",
    "is_of_the_paper",
    "printed_of",
]

PAPER: Final = "Appl. Sci. 2025, 15, 10597"


class Printed(NamedTuple):
    """One row of Table 5.

    Parameters
    ----------
    condition : str
    mesh_hz : float
    level_db : float
        At 1 m; the weighting is not stated.
    """

    condition: str
    mesh_hz: float
    level_db: float


TABLE_5: Final = (
    Printed("1", 174.97, 70.7811),
    Printed("2", 262.45, 85.5865),
    Printed("3", 349.94, 84.9987),
    Printed("4", 437.42, 92.8384),
    Printed("5", 524.9, 93.6556),
    Printed("6", 1001.0, 88.5417),
)
"""Masuda's level of the paper's six conditions (its Table 5)."""

FIGURE_11_CONDITION: Final = "5"
DTE_PP_UM: Final = 14.8491
"""Peak to peak of the dynamic transmission error in `FIGURE_11_CONDITION` (section 4.3)."""

LEVEL_OF_TEXT_DB: Final = 86.517
"""Masuda's level of the same condition as section 4.3 has it; Table 5 has another."""


class PrintedLevel(NamedTuple):
    """A level at 4 m in section 5.1 of the paper.

    Parameters
    ----------
    conditions : tuple of str
        The one it is of; two where the text leaves it open.
    level_db : float
    """

    conditions: tuple[str, ...]
    level_db: float


MODEL_4M: Final = (
    PrintedLevel(("1",), 81.3),
    PrintedLevel(("3",), 84.2),
    PrintedLevel(("4", "5"), 88.0),
    PrintedLevel(("6",), 77.3),
)
MEASURED_4M: Final = (PrintedLevel(("3",), 88.3),)
LARGEST_ERROR_DB: Final = 4.1
"""Levels of the paper's model and its measurement (Fig. 16); the largest difference of the two, in condition 3."""

_SAME_MESH: Final = 0.01
"""Relative difference of mesh frequencies within which a condition is one of Table 5."""

_SAYS_WHOSE: Final = ("train.", "gear_pair.", "operation.")


def is_of_the_paper(fleet: Fleet) -> bool:
    """Whether train, gears or operation of a fleet are taken from the paper, as their origins say."""
    return any(
        parameter.key.startswith(_SAYS_WHOSE) and re.search(r"\bpaper\b", parameter.origin, re.IGNORECASE)
        for parameter in fleet.parameters()
    )


def printed_of(state: GearState) -> Printed | None:
    """Return the row of Table 5 with a condition's mesh frequency, within 1 %."""
    near = (row for row in TABLE_5 if abs(state.mesh_hz - row.mesh_hz) <= _SAME_MESH * row.mesh_hz)
    return next(near, None)
