"""What the levels would be if a source were quieter, or a parameter of the drive another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.conditions import Condition, followed
from tdacoustic.drive.housing_field import HousingSound
from tdacoustic.drive.levels import WEIGHTINGS, Path, Receiver, Weighting, paths_of_total
from tdacoustic.drive.model import DriveModel
from tdacoustic.drive.prediction import DriveSound
from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet, WhatIf

__all__ = [
    "STEPS_DB",
    "IntervalBasis",
    "WhatIfAnswer",
    "WhatIfLevel",
    "cases_of",
    "changed_fleet",
    "changed_model",
    "changed_total_db",
    "check_cases",
    "most_off_db",
    "off_name",
    "step_name",
    "what_if_answer",
]

Real = NDArray[np.float64]

STEPS_DB: Final = (-10.0, -3.0)
"""Changes of each source that are computed where a fleet asks for none [assumed]; and each source left out."""


@dataclass(frozen=True)
class WhatIfLevel:
    """The level of one case at one receiver in one condition, and its change against the drive as it is.

    Parameters
    ----------
    condition : str
    train_speed_km_h : float
    receiver : str
    weighting : {"Z", "A"}
    case : str
        Name of the `WhatIf`.
    before_db : float or None
        Level of the drive as it is; None where it is silent.
    level_db : float or None
        None where nothing is left that sounds.
    change_95_db, fit_95_db, level_95_db : (float, float) or None
        Intervals of 95 %: of the change, of the change with what the fitted parameters leave open alone, and of the
        level. See `IntervalBasis`; None without a calibration.
    """

    condition: str
    train_speed_km_h: float
    receiver: str
    weighting: Weighting
    case: str
    before_db: float | None
    level_db: float | None
    change_95_db: tuple[float, float] | None = None
    fit_95_db: tuple[float, float] | None = None
    level_95_db: tuple[float, float] | None = None

    @property
    def change_db(self) -> float | None:
        """`level_db` less `before_db`; None without one of them."""
        return None if self.level_db is None or self.before_db is None else self.level_db - self.before_db


@dataclass(frozen=True)
class IntervalBasis:
    """What the intervals of an answer were made of.

    Parameters
    ----------
    method : {"profile", "posterior"}
        Range over all values of the fitted parameters that the data allow (profile likelihood), or quantiles over the
        samples of a posterior.
    sets : int
        Sets of values that the levels were computed for.
    parameters : tuple of str
        Keys of the fitted parameters.
    model_sigma_db : float
        Scatter of the model, which the change holds as an error of each path by itself in each condition, and the
        level as an error of its own.
    open_parameters : tuple of str
        Those of `parameters` that the data do not determine: there the bounds hold the interval, not the data.
    """

    method: str
    sets: int
    parameters: tuple[str, ...]
    model_sigma_db: float
    open_parameters: tuple[str, ...] = ()


@dataclass(frozen=True)
class WhatIfAnswer:
    """What changes of the drive do to its levels.

    Parameters
    ----------
    surface : str
        Name of the 4 m surface among the receivers.
    paths : tuple of str
        Paths of the total that sound somewhere.
    cases : tuple of WhatIf
    assumed : bool
        Whether the cases are the usual ones, as the fleet asks for none.
    levels : tuple of WhatIfLevel
        By condition, receiver, weighting and case.
    basis : IntervalBasis or None
        None without intervals.
    doubts : tuple of str
    line_fractions : tuple of (str, float)
        Conditions with recordings, and the part of the recorded sound energy that lines carry: the model has lines
        alone.
    """

    surface: str
    paths: tuple[Path, ...]
    cases: tuple[WhatIf, ...]
    assumed: bool
    levels: tuple[WhatIfLevel, ...]
    basis: IntervalBasis | None = None
    doubts: tuple[str, ...] = ()
    line_fractions: tuple[tuple[str, float], ...] = ()

    def level(self, condition: str, case: str, receiver: str, weighting: str = "Z") -> WhatIfLevel | None:
        """Return one of the levels; None of a case that is not for this condition."""
        for held in self.levels:
            if (held.condition, held.case, held.receiver, held.weighting) == (condition, case, receiver, weighting):
                return held
        return None


def step_name(path: str, step_db: float) -> str:
    """Return the name of a usual case.

    Examples
    --------
    >>> step_name("motor", -10.0)
    'motor 10 dB less'
    """
    return f"{path} {abs(step_db):g} dB {'less' if step_db < 0.0 else 'more'}"


def off_name(path: str) -> str:
    """Return the name of the case without a path."""
    return f"{path} off"


def most_off_db(line_fraction: float) -> float:
    """Return what a recorded level loses at most by quieter lines, all else staying as it is, in dB.

    Parameters
    ----------
    line_fraction : float
        Part of the sound energy that lines carry, 0 to 1.

    Examples
    --------
    >>> round(most_off_db(0.16), 2)
    0.76
    """
    return math.inf if line_fraction >= 1.0 else -10.0 * math.log10(1.0 - max(line_fraction, 0.0))


def cases_of(fleet: Fleet, sounds: Iterable[DriveSound]) -> tuple[tuple[WhatIf, ...], tuple[Path, ...]]:
    """Return the cases that a fleet asks for, else the usual ones, and the paths of the total that sound at all.

    Parameters
    ----------
    fleet : Fleet
    sounds : iterable of DriveSound
        As the drive is.
    """
    heard = {level.path for sound in sounds for level in sound.levels if level.level_db is not None}
    paths = tuple(path for path in paths_of_total(fleet) if path in heard)
    if fleet.what_if:
        return fleet.what_if, paths
    usual: list[WhatIf] = []
    for path in paths:
        usual += [WhatIf.model_validate({"name": step_name(path, s), f"{path}_db": s}) for s in STEPS_DB]
        usual.append(WhatIf.model_validate({"name": off_name(path), f"{path}_db": "off"}))
    return tuple(usual), paths


def changed_fleet(fleet: Fleet, case: WhatIf) -> Fleet:
    """Return the fleet with the parameters of a case.

    Raises
    ------
    FleetError
        A value that a file could not have either.
    """
    try:
        return fleet.replaced(dict(case.parameters), origin=f"what if: {case.name}") if case.parameters else fleet
    except FleetError as error:
        raise _of_case(fleet, case, error) from error


def changed_model(fleet: Fleet, case: WhatIf, housing: HousingSound | None = None) -> DriveModel:
    """Return the model of the drive with the parameters of a case.

    Parameters
    ----------
    fleet : Fleet
        As it is.
    case : WhatIf
    housing : HousingSound, optional
        Of the changed fleet.

    Raises
    ------
    FleetError
        As of `changed_fleet`; or its gears cannot be.
    """
    try:
        return DriveModel(changed_fleet(fleet, case), housing=housing)
    except FleetError as error:
        raise _of_case(fleet, case, error) from error


def changed_total_db(paths_db: Mapping[Path, Real], case: WhatIf) -> Real:
    """Return the level of the total with a case's changes of its paths, minus infinity where nothing is left.

    Energies are added: the paths are incoherent.

    Parameters
    ----------
    paths_db : mapping of str to ndarray
        Levels of the paths that the total adds; minus infinity of a silent one.
    case : WhatIf

    Examples
    --------
    >>> two = {"motor": np.array([80.0]), "mesh": np.array([80.0])}
    >>> quieter, same = (changed_total_db(two, WhatIf(name="case", motor_db=change)) for change in (-10, 0))
    >>> round(float((quieter - same)[0]), 2)
    -2.6
    """
    with np.errstate(divide="ignore"):
        energy = sum(10.0 ** (0.1 * (level + case.gain_db(path))) for path, level in paths_db.items())
        return np.asarray(10.0 * np.log10(np.asarray(energy, dtype=np.float64)))


def what_if_answer(
    model: DriveModel,
    conditions: Sequence[Condition],
    sounds: Sequence[DriveSound],
    receivers: Sequence[Receiver] = (),
    changed: Mapping[str, DriveModel] | None = None,
) -> WhatIfAnswer:
    """Return what the cases of a model's fleet do to its levels; without intervals.

    Parameters
    ----------
    model : DriveModel
        The drive as it is.
    conditions : sequence of Condition
    sounds : sequence of DriveSound
        Of each of them, at the surface and the receivers.
    receivers : sequence of Receiver
        Besides the surface.
    changed : mapping of str to DriveModel, optional
        Models of cases with other parameters, by the case's name; those of the fleets of `changed_fleet`. Default:
        made here, which a housing with other transfer vectors does not allow.

    Raises
    ------
    FleetError
        A case is for a condition that there is not, or its drive cannot be computed.
    """
    fleet = model.fleet
    cases, paths = cases_of(fleet, sounds)
    check_cases(fleet, [condition.name for condition in conditions])
    models = {
        case.name: (changed or {}).get(case.name) or changed_model(fleet, case) for case in cases if case.parameters
    }
    places = (model.field.surface, *receivers)
    found: list[WhatIfLevel] = []
    for condition, sound in zip(conditions, sounds, strict=True):
        held = [case for case in cases if case.conditions is None or condition.name in case.conditions]
        after = {case.name: _sound(models.get(case.name), model, case, condition, sound, places[1:]) for case in held}
        for receiver in places:
            for weighting in WEIGHTINGS:
                before_db = _total_db(fleet, sound, receiver, weighting)
                for case in held:
                    of = models[case.name].fleet if case.parameters else fleet
                    level_db = _total_db(of, after[case.name], receiver, weighting, case)
                    where = condition.name, condition.train_speed_km_h, receiver.name, weighting
                    found.append(WhatIfLevel(*where, case.name, before_db, level_db))
    doubts = tuple(_without_effect(fleet, cases, paths)) if fleet.what_if else ()
    return WhatIfAnswer(model.field.surface.name, paths, cases, not fleet.what_if, tuple(found), None, doubts)


def _sound(
    changed: DriveModel | None,
    model: DriveModel,
    case: WhatIf,
    condition: Condition,
    sound: DriveSound,
    receivers: Sequence[Receiver],
) -> DriveSound:
    if changed is None:
        return sound
    try:
        return changed.sound_of(changed.gears(followed(condition, model.fleet, changed.fleet)), receivers)
    except FleetError as error:
        raise _of_case(model.fleet, case, error) from error


def _total_db(
    fleet: Fleet, sound: DriveSound, receiver: Receiver, weighting: Weighting, case: WhatIf | None = None
) -> float | None:
    levels = {path: sound.level_db(receiver.name, path, weighting) for path in paths_of_total(fleet)}
    if case is None or all(level is None or case.gain_db(path) == 0.0 for path, level in levels.items()):
        return sound.level_db(receiver.name, "total", weighting)
    known = {path: np.array(-math.inf if level is None else level) for path, level in levels.items()}
    total = float(changed_total_db(known, case))
    return total if math.isfinite(total) else None


def check_cases(fleet: Fleet, conditions: Iterable[str]) -> None:
    """Raise for names in ``[[what_if]] conditions`` that are no conditions.

    Parameters
    ----------
    fleet : Fleet
    conditions : iterable of str
        Names of those that are computed. A condition of ``[operation]`` that is not among them is no fault.

    Raises
    ------
    FleetError
    """
    names = tuple(dict.fromkeys((*conditions, *fleet.operation.names)))
    for case in fleet.what_if:
        foreign = [name for name in case.conditions or () if name not in names]
        if foreign:
            named = ", ".join(repr(name) for name in foreign)
            verb = "which is no condition" if len(foreign) == 1 else "which are no conditions"
            raise FleetError(
                f"{fleet.path}: [[what_if]] {case.name!r}: conditions names {named}, {verb}; there are "
                f"{', '.join(names) or 'none'}"
            )


def _without_effect(fleet: Fleet, cases: Sequence[WhatIf], paths: Sequence[Path]) -> Iterator[str]:
    """Say which stated changes are of paths that the total does not add, or that have no sound."""
    added = paths_of_total(fleet)
    for case in cases:
        for path in case.stated_paths:
            if path not in paths:
                why = "the total does not add it" if path not in added else "it has no sound"
                yield f"[[what_if]] {case.name!r} changes the path {path}, which does nothing here: {why}"


def _of_case(fleet: Fleet, case: WhatIf, error: FleetError) -> FleetError:
    """An error with the case's name in it, once."""
    if f"[[what_if]] {case.name!r}" in str(error):
        return error
    return FleetError(f"{fleet.path}: [[what_if]] {case.name!r}: {str(error).removeprefix(f'{fleet.path}: ')}")
