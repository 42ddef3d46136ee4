"""Which calibrator runs belong to which runs of a campaign."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["series_of"]


def series_of(kinds: Sequence[str]) -> tuple[int, ...]:
    """Return the series of each run, from 1, by the order in which the runs stand in the campaign.

    A run with a calibrator before the others begins a new series where others, or a calibrator after them, went before.
    Where some series would then lack either calibrators or other runs, all runs are one series.

    Parameters
    ----------
    kinds : sequence of str
        ``"test"``, ``"background"``, ``"calibration_before"`` or ``"calibration_after"``.

    Examples
    --------
    >>> day = ["calibration_before", "test", "calibration_after"]
    >>> series_of(day + day)
    (1, 1, 1, 2, 2, 2)
    >>> series_of(["test", "calibration_before", "calibration_after"])
    (1, 1, 1)
    """
    numbers: list[int] = []
    current, fresh = 1, True
    for kind in kinds:
        if kind == "calibration_before":
            current, fresh = current + (not fresh), True
        else:
            fresh = False
        numbers.append(current)
    for number in range(1, current + 1):
        held = [kind for kind, series in zip(kinds, numbers, strict=True) if series == number]
        calibrated = [kind.startswith("calibration") for kind in held]
        if not any(calibrated) or all(calibrated):
            return (1,) * len(numbers)
    return tuple(numbers)
