"""Known parameters and scattered levels, calibrated, and what came back held against the truth.

The levels are those of drive_levels.py, which shares no code with the program; their scatter is normal. The program
sees the levels, their standard deviation, and a fleet that starts at the reference drive's values where it is free and
has the truth's where it is not - or, of a *misfit*, has not.
"""

from __future__ import annotations

import hashlib
import math
import re
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from drive_levels import REFERENCE_DRIVE, TrueDrive, levels_at_4_m_db

SEED = 20261124
SEEDS = 200
TRUTHS = 10
"""Sets of true parameters; seeds take turns among them. A misfit has its own ten, five to either side."""

SCATTER_DB = (0.3, 1.0, 3.0)
MISFIT_SCATTER_DB = (0.3, 1.0)
MODEL_SIGMA_DB: tuple[float | None, ...] = (4.0, None)
"""Of a misfit: the default, and fitted with the parameters."""

LINES_DB = (88.0, 85.0)
"""Sound powers of the motor's two lines before its gain: with a constant of -16 dB motor and mesh are equal at 4 m near
condition 3."""

CONSTANT, DAMPING, GAIN = "masuda.constant_db", "gear_dynamics.mesh_damping_ratio", "model.motor_gain_db"
BEARINGS, ERROR = "gear_dynamics.bearing_damping_ratio", "gear_pair.1.transmission_error_um.1"
LINE = "motor.excitation.1.sound_power_level_db"

FREE = {
    "two": (CONSTANT, DAMPING),
    "three": (CONSTANT, DAMPING, GAIN),
    "five": (CONSTANT, DAMPING, GAIN, BEARINGS, LINE),
}
LOGARITHMIC = frozenset({DAMPING, BEARINGS})
"""Errors of these are of their logarithm, on whose scale a fit moves them."""

MISFITS = ("damping", "resonance", "both")
"""Bearing damping and the motor's loss factor half larger or half smaller; bearing stiffness such that the modes on the
bearings lie 5 % higher or lower; both."""

DOUBTS = {
    "rank": "directions among the parameters",
    "not seen": "changes none of the levels",
    "bound": "ended on its bound",
    "open interval": "the data do not determine it",
    "correlated": "are correlated by",
    "prior": "no narrower than its prior",
    "several minima": "more than one minimum",
    "misfit": "does not reach the data",
    "outlying": "is outlying",
}
"""What tells one kind of doubt from another."""

NOT_IDENTIFIABLE = ("rank", "not seen", "bound", "open interval", "correlated", "several minima")
"""Kinds that say that the data do not determine a parameter."""


def is_higher(index: int) -> bool:
    """Whether a misfit's true values lie above what the fleet says, rather than below."""
    return index % 2 == 0


@dataclass(frozen=True)
class Truth:
    """A set of true parameters, as a fleet has them, and in what the true drive differs from any fleet of them."""

    index: int
    constant_db: float
    mesh_damping_ratio: float
    motor_gain_db: float
    bearing_damping_ratio: float
    transmission_error_um: float
    misfit: str | None = None

    @classmethod
    def draw(cls, index: int, misfit: str | None = None) -> Truth:
        rng = np.random.default_rng([SEED, 0 if misfit is None else 1 + MISFITS.index(misfit), index])
        return cls(
            index,
            float(rng.uniform(-20.0, -12.0)),
            float(math.exp(rng.uniform(math.log(0.03), math.log(0.12)))),
            float(rng.uniform(-3.0, 3.0)),
            float(math.exp(rng.uniform(math.log(0.03), math.log(0.09)))),
            float(rng.uniform(4.0, 6.5)),
            misfit,
        )

    def value(self, key: str) -> float:
        """The true value of a fleet's parameter."""
        return {
            CONSTANT: self.constant_db,
            DAMPING: self.mesh_damping_ratio,
            GAIN: self.motor_gain_db,
            BEARINGS: self.bearing_damping_ratio,
            ERROR: self.transmission_error_um,
            LINE: LINES_DB[0],
        }[key]

    def drive(self) -> TrueDrive:
        """The true drive."""
        drive = TrueDrive(
            self.constant_db,
            self.mesh_damping_ratio,
            self.bearing_damping_ratio,
            1.0,
            self.transmission_error_um,
            LINES_DB,
            self.motor_gain_db,
        )
        factor, moved = (1.5, 1.05) if is_higher(self.index) else (0.5, 0.95)
        if self.misfit in ("damping", "both"):
            # The first line is at a resonance of the frame and falls with its loss factor; the other is not.
            first, second = LINES_DB
            lines = (first - 20.0 * math.log10(factor), second)
            drive = replace(drive, bearing_damping_ratio=factor * self.bearing_damping_ratio, motor_lines_db=lines)
        if self.misfit in ("resonance", "both"):
            drive = replace(drive, bearing_stiffness_factor=moved**2)
        return drive

    def fleet_text(self, free: Sequence[str]) -> str:
        """A fleet file: the reference drive with a motor, and with the true values of what is not free."""
        given = {key: self.value(key) for key in (CONSTANT, DAMPING, GAIN, BEARINGS, ERROR)}
        given |= {key: value for key, value in zip((CONSTANT, GAIN), (20.0, 0.0), strict=True) if key in free}
        given |= {key: 0.05 for key in (DAMPING, BEARINGS) if key in free}
        text = REFERENCE_DRIVE.read_text(encoding="utf-8")
        for pattern, line in (
            (r'method = "boundary_elements"', 'method = "point_sources"'),
            (r"constant_db = .*", f"constant_db = {given[CONSTANT]!r}"),
            (r"mesh_damping_ratio = .*", f"mesh_damping_ratio = {given[DAMPING]!r}"),
            (r"bearing_damping_ratio = .*", f"bearing_damping_ratio = {given[BEARINGS]!r}"),
            (r"transmission_error_um = .*", f"transmission_error_um = [{given[ERROR]!r}]"),
            (r"structure_gain_db = .*", f"structure_gain_db = 0\nmotor_gain_db = {given[GAIN]!r}"),
        ):
            text, n = re.subn(rf"^{pattern}$", line, text, flags=re.MULTILINE)
            assert n == 1, pattern
        for name, (hz, level_db) in {"first": (926.0, LINES_DB[0]), "second": (1852.0, LINES_DB[1])}.items():
            text += f'\n[[motor.excitation]]\nname = "{name}"\nfixed_hz = {hz}\nsound_power_level_db = {level_db}\n'
        return text


@dataclass(frozen=True)
class Case:
    """What is the same for all seeds of a row of the table."""

    free: str
    scatter_db: float
    misfit: str | None = None
    model_sigma_db: float | None = 0.0

    @property
    def name(self) -> str:
        told = f"{self.free} free, {self.scatter_db:g} dB"
        if self.misfit is None:
            return told
        sigma = "fitted" if self.model_sigma_db is None else f"{self.model_sigma_db:g} dB"
        return f"{told}, {self.misfit} not the model's, model sigma {sigma}"

    def scatter(self, seed: int, size: int) -> np.ndarray:
        """Scatter of a seed's levels in dB."""
        rng = np.random.default_rng([SEED, zlib.crc32(self.name.encode()), seed])
        return self.scatter_db * rng.standard_normal(size)


def cases() -> Iterator[Case]:
    """All rows of the table."""
    for free in FREE:
        for scatter_db in SCATTER_DB:
            yield Case(free, scatter_db)
    for misfit in MISFITS:
        for scatter_db in MISFIT_SCATTER_DB:
            for sigma in MODEL_SIGMA_DB:
                yield Case("two", scatter_db, misfit, sigma)


def truths() -> Iterator[Truth]:
    """All sets of true parameters."""
    for misfit in (None, *MISFITS):
        for index in range(TRUTHS):
            yield Truth.draw(index, misfit)


def levels_of(truth: Truth) -> list[float]:
    """Levels of the true drive at the six speeds: some five seconds."""
    return levels_at_4_m_db(truth.drive())


def rows_of(case: Case, index: int, seeds: Sequence[int], levels_db: Sequence[float]) -> list[dict[str, Any]]:
    """Calibrate with the levels of one truth, scattered by each seed."""
    truth = Truth.draw(index, case.misfit)
    fleet, model = _model(truth, FREE[case.free])
    found = []
    for seed in seeds:
        scattered = np.asarray(levels_db) + case.scatter(seed, len(levels_db))
        found.append({"seed": seed, "truth": index, **_row(case, truth, fleet, model, scattered)})
    return found


@cache
def _model(truth: Truth, free: tuple[str, ...]) -> tuple[Any, Any]:
    """The fleet that the program is given, and its model; what that computed is kept from seed to seed."""
    from tdacoustic import DriveModel, load_fleet
    from tdacoustic.drive import Receiver
    from tdacoustic.fitting.levels import LevelModel
    from tdacoustic.fitting.measured_level import MeasuredLevel

    with TemporaryDirectory() as folder:
        path = Path(folder) / "fleet.toml"
        path.write_text(truth.fleet_text(free), encoding="utf-8")
        fleet = load_fleet(path)
    place = Receiver("4 m", 4.0)
    data = [
        MeasuredLevel(condition, place, 0.0, 1.0, "Z", "synthetic", "evidence")
        for condition in DriveModel(fleet).conditions
    ]
    return fleet, LevelModel(fleet, data)


def _row(case: Case, truth: Truth, fleet: Any, model: Any, levels_db: np.ndarray) -> dict[str, Any]:
    from tdacoustic.fitting.calibration import calibrate_fleet
    from tdacoustic.fitting.free import free_parameter
    from tdacoustic.fitting.settings import FitSettings

    data = [
        replace(datum, level_db=float(level), sigma_db=case.scatter_db)
        for datum, level in zip(model.data, levels_db, strict=True)
    ]
    free = [free_parameter(fleet, key) for key in FREE[case.free]]
    settings = FitSettings(model_sigma_db=case.model_sigma_db)
    found = calibrate_fleet(fleet, data, free, settings, model=model.with_data(data))
    kinds = [kind for kind, words in DOUBTS.items() if any(words in doubt for doubt in found.doubts)]
    unknown = [doubt for doubt in found.doubts if not any(words in doubt for words in DOUBTS.values())]
    return {
        "parameters": {fitted.key: _of_parameter(fitted, truth.value(fitted.key)) for fitted in found.parameters},
        "doubts": kinds,
        "other_doubts": unknown,
    }


def _of_parameter(fitted: Any, true: float) -> dict[str, Any]:
    scaled = math.log if fitted.key in LOGARITHMIC else float
    stderr = None
    if fitted.stderr is not None:
        stderr = fitted.stderr / fitted.value if fitted.key in LOGARITHMIC else fitted.stderr
    row: dict[str, Any] = {"error": scaled(fitted.value) - scaled(true), "stderr": stderr}
    for name, interval in (("68", fitted.ci68), ("95", fitted.ci95)):
        row[f"open{name}"] = interval is None or None in interval
        low, high = (None, None) if interval is None else interval
        low, high = fitted.low if low is None else low, fitted.high if high is None else high
        row[f"in{name}"] = None if interval is None else bool(low <= true <= high)
    return row


def scores(case: Case, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """What came back of one case; of a misfit, either side of it apart too."""
    found = _scores(rows)
    if case.misfit is not None:
        for side, held in (("higher", True), ("lower", False)):
            of_side = _scores([row for row in rows if is_higher(row["truth"]) == held])
            found[side] = {
                "missed_by_95_and_not_flagged": of_side["missed_by_95_and_not_flagged"],
                **{key: score["covered95"] for key, score in of_side["parameters"].items()},
            }
    return found


def _scores(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    kinds = Counter(kind for row in rows for kind in row["doubts"])
    flagged = [any(kind in NOT_IDENTIFIABLE for kind in row["doubts"]) for row in rows]
    missed = [any(p["in95"] is False for p in row["parameters"].values()) for row in rows]
    return {
        "seeds": len(rows),
        "parameters": {
            key: _score([row["parameters"][key] for row in rows]) for key in (rows[0]["parameters"] if rows else ())
        },
        "flagged_as_not_identifiable": sum(flagged),
        "missed_by_95_and_not_flagged": sum(m and not f for m, f in zip(missed, flagged, strict=True)),
        "without_a_doubt": sum(not row["doubts"] and not row["other_doubts"] for row in rows),
        "doubts": dict(sorted(kinds.items())),
        "other_doubts": sorted({doubt for row in rows for doubt in row["other_doubts"]})[:5],
    }


def _score(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Bias is the mean error, in its own unit and over its standard error; coverage counts an open end as reaching to
    the bound.
    """
    errors = np.array([row["error"] for row in rows])
    scatter = float(errors.std(ddof=1)) if errors.size > 1 else 0.0
    told = [row for row in rows if row["stderr"] is not None]
    found: dict[str, Any] = {
        "bias": float(errors.mean()),
        "bias_over_its_standard_error": float(errors.mean()) / (scatter / math.sqrt(errors.size)) if scatter else None,
        "median_error": float(np.median(errors)),
        "scatter": scatter,
        "median_stderr": float(np.median([row["stderr"] for row in told])) if told else None,
    }
    for name in ("68", "95"):
        held = [row[f"in{name}"] for row in rows if row[f"in{name}"] is not None]
        found[f"covered{name}"] = {"k": sum(held), "n": len(held)}
        found[f"open{name}"] = sum(row[f"open{name}"] for row in rows)
    return found


def table(results: dict[str, dict[str, Any]]) -> str:
    """The scores as text."""
    lines = [
        "| case | parameter | bias | over its standard error | in 68 % | in 95 % | open at 68, 95 | not identifiable |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, result in results.items():
        told = f"{result['flagged_as_not_identifiable']}/{result['seeds']}"
        for key, score in result["parameters"].items():
            covered = [
                f"{held['k'] / held['n']:.3f}" if (held := score[f"covered{level}"])["n"] else "-"
                for level in ("68", "95")
            ]
            over = score["bias_over_its_standard_error"]
            cells = (name, key, f"{score['bias']:+.3f}", "-" if over is None else f"{over:+.1f}", *covered)
            lines.append("| " + " | ".join((*cells, f"{score['open68']}, {score['open95']}", told)) + " |")
            name = told = ""
    return "\n".join(lines)


def source_files() -> list[Path]:
    """The modules that the study rests on."""
    import tdacoustic

    folder = Path(tdacoustic.__file__).parent
    others = ("drive/levels.py", "drive/model.py", "drive/sources.py", "gears/masuda.py")
    return [*sorted((folder / "fitting").glob("*.py")), *(folder / name for name in others)]


def sources() -> str:
    """Return the SHA-256 of these modules; the ends of lines do not count."""
    held = hashlib.sha256()
    for path in source_files():
        text = path.read_text(encoding="utf-8")  # universal newlines: CRLF is read as LF
        held.update(f"{path.parent.name}/{path.name}\n{text}\n".encode())
    return held.hexdigest()
