"""How the numbers of the modelled side came about: method, assumptions, input, steps, versions."""

from __future__ import annotations

from collections.abc import Sequence

from tdacoustic.gears import SteadyState
from tdacoustic.gears.harmonic_balance import FEWEST_HARMONICS, RESIDUAL, TAIL
from tdacoustic.gears.integration import LONGEST_REPEAT, MOST_PERIODS, RECORD_PERIODS, SETTLED
from tdacoustic.gears.sweep import SWEEP_PERIODS
from tdacoustic.reporting.document import Paragraph, Section, Sentences
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import range_words
from tdacoustic.reporting.sections.printed import PAPER
from tdacoustic.reporting.sections.provenance import inputs_of, steps_of, versions_of
from tdacoustic.results import FleetPrediction

__all__ = ["gear_method", "method_sections"]

EQUATIONS = mark(
    "The gears are two rigid bodies on linear springs and dampers, coupled by one mesh with a gap (equations (1) to "
    "(6) of {paper}). All but the mesh force is linear, so a periodic motion is one scalar balance of harmonics in δ."
)
BALANCE = mark(
    "It is solved for {fewest} harmonics or as many more as bring the estimated error of δ by those left out below "
    "{tail} of its peak to peak, to a residual of {residual}; where teeth separate by Newton's method, with the force "
    "taken from samples over the period. The largest Floquet multiplier of each solution says whether it is stable; "
    "the rigid rotation is taken out before."
)
INTEGRATION = mark(
    "Where no stable one is found the equations are integrated in time, with the contact lines as the printed "
    "trapezoid, until the motion repeats after at most {longest_repeat} mesh periods within {settled} of its peak to "
    "peak; after {most_periods} mesh periods ({sweep_periods} in the sweep) a motion counts as not repeating, and its "
    "lines are those of a record of up to {record_periods} mesh periods."
)


def gear_method(result: FleetPrediction) -> Section:
    """Return the section on method and provenance."""
    blocks = [
        *method_sections(result),
        Section("gear-input", say("Input"), inputs_of(result.inputs)),
        *steps_of(result),
        versions_of(result.versions, result.records),
    ]
    return Section("provenance", say("How the numbers came about"), blocks)


def method_sections(result: FleetPrediction) -> list[Section]:
    """Return the sections on method and assumptions of the gear model."""
    return [
        Section("gear-method", say("Method of the model"), [Paragraph(_method(result))]),
        Section("gear-assumptions", say("Assumptions of the model"), [Sentences(_assumptions(result))]),
    ]


def _method(result: FleetPrediction) -> str:
    states = [state.steady for state in result.prediction.conditions]
    said = [
        say(EQUATIONS, paper=say(PAPER)),
        say(BALANCE, fewest=FEWEST_HARMONICS, tail=_small(TAIL), residual=_small(RESIDUAL)),
        say(
            INTEGRATION,
            longest_repeat=LONGEST_REPEAT,
            settled=_small(SETTLED),
            most_periods=MOST_PERIODS,
            sweep_periods=SWEEP_PERIODS,
            record_periods=RECORD_PERIODS,
        ),
        say("Bearing forces follow line by line from the mesh force."),
    ]
    return f"{' '.join(said)} {_harmonics_words(states)}".strip()


def _small(value: float) -> str:
    return f"{value:g}".replace("e-0", "e-").replace("-", "\N{MINUS SIGN}")


def _split_words(result: FleetPrediction) -> str:
    if result.prediction.housing is None:
        return say(
            "Springs and dampers are the total of a gear's bearings; nothing is split between the two bearings of a "
            "shaft."
        )
    return say(
        "Springs and dampers are the total of a gear's bearings; their forces are split between the two bearings of a "
        "shaft for the housing alone, by the lever rule."
    )


def _harmonics_words(states: list[SteadyState]) -> str:
    found = sorted({s.lines.harmonic.size for s in states if s.method == "harmonic_balance"})
    if not found:
        return ""
    count = range_words(f"{found[0]}", f"{found[-1]}")
    return say("In these conditions the balanced solutions have lines at {count} mesh harmonics.", count=count)


def _error_words(amplitudes_m: Sequence[float]) -> str:
    """What the transmission error of the unloaded gears is."""
    listed = ", ".join(f"{1e6 * amplitude:g}" for amplitude in amplitudes_m)
    if len(amplitudes_m) == 1:
        return say(
            "The transmission error of the unloaded gears is a sine at the mesh frequency, amplitude {amplitude} µm, "
            "phase 0, at any speed and load.",
            amplitude=listed,
        )
    return say(
        "The transmission error of the unloaded gears is sines at the first mesh harmonics, amplitudes {amplitudes} "
        "µm, phase 0, at any speed and load.",
        amplitudes=listed,
    )


def _assumptions(result: FleetPrediction) -> list[str]:
    unit, fleet = result.prediction.unit, result.fleet
    damping = (
        say("The damping of the mesh acts always, also while the teeth are apart, as the paper prints it.")
        if unit.system.mesh_damping == "always"
        else say("The damping of the mesh acts only while teeth touch.")
    )
    found = [
        say(
            "The centres lie along x (ψ = 0), so that y is tangential; with the angle of the paper's text taken "
            "otherwise the force along x would vanish."
        ),
        say("The working transverse pressure angle stands for the pressure angle in the direction of the mesh force."),
        _error_words(unit.system.transmission_error_m),
        say("The backlash is {backlash:g} µm, the same at every tooth.", backlash=2e6 * unit.system.half_backlash_m),
        _split_words(result),
        damping,
        say("Gears are of steel, with solid discs; the mean stiffness of the mesh does not change with the load."),
        say(
            "No friction between the teeth, no bending or torsion of the shafts, no tilt of the gears, no tip relief "
            "or other flank correction, no scatter between teeth."
        ),
        say(
            "The torque is constant over a turn, and that of the wheel balances it; motor and wheelset add no inertia "
            "beyond what the two gears are given."
        ),
    ]
    if len(fleet.gear_pair) > 1:
        found.append(say("Losses and dynamics of the other gear pairs are left out."))
    return found
