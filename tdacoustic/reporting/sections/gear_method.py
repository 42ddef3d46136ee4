"""How the numbers of the modelled side came about: method, assumptions, input, steps, versions."""

from __future__ import annotations

from tdacoustic.gears import SteadyState
from tdacoustic.gears.harmonic_balance import FEWEST_HARMONICS, RESIDUAL, TAIL
from tdacoustic.gears.integration import LONGEST_REPEAT, MOST_PERIODS, RECORD_PERIODS, SETTLED
from tdacoustic.gears.sweep import SWEEP_PERIODS
from tdacoustic.reporting.document import Paragraph, Section, Sentences
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.printed import PAPER
from tdacoustic.reporting.sections.provenance import inputs_of, steps_of, versions_of
from tdacoustic.results import FleetPrediction

__all__ = ["gear_method", "method_sections"]

EQUATIONS = (
    "The gears are two rigid bodies on linear springs and dampers, coupled by one mesh with a gap (equations (1) to "
    f"(6) of {PAPER}). All but the mesh force is linear, so a periodic motion is one scalar balance of harmonics in δ."
)


def gear_method(result: FleetPrediction) -> Section:
    """Return the section on method and provenance."""
    blocks = [
        *method_sections(result),
        Section("gear-input", say("Input"), inputs_of(result.inputs)),
        *steps_of(result),
        versions_of(result.versions),
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
    text = say(
        "{equations} It is solved for {fewest_harmonics} harmonics or as many more as bring the "
        "estimated error of δ by those left out below {small} of its peak to peak, to a residual "
        "of {small_2}; where teeth separate by Newton's method, with the force taken from "
        "samples over the period. The largest Floquet multiplier of each solution says whether "
        "it is stable; the rigid rotation is taken out before. Where no stable one is found the "
        "equations are integrated in time, with the contact lines as the printed trapezoid, "
        "until the motion repeats after at most {longest_repeat} mesh periods within {small_3} "
        "of its peak to peak; after {most_periods} mesh periods ({sweep_periods} in the sweep) a "
        "motion counts as not repeating, and its lines are those of a record of up to "
        "{record_periods} mesh periods. Bearing forces follow line by line from the mesh force.",
        equations=EQUATIONS,
        fewest_harmonics=FEWEST_HARMONICS,
        small=_small(TAIL),
        small_2=_small(RESIDUAL),
        longest_repeat=LONGEST_REPEAT,
        small_3=_small(SETTLED),
        most_periods=MOST_PERIODS,
        sweep_periods=SWEEP_PERIODS,
        record_periods=RECORD_PERIODS,
    )
    return f"{text} {_harmonics_words(states)}".strip()


def _small(value: float) -> str:
    return f"{value:g}".replace("e-0", "e-").replace("-", "\N{MINUS SIGN}")


def _split_words(result: FleetPrediction) -> str:
    if result.prediction.housing is None:
        return say("nothing is split between the two bearings of a shaft")
    return say("their forces are split between the two bearings of a shaft for the housing alone, by the lever rule")


def _harmonics_words(states: list[SteadyState]) -> str:
    found = sorted({s.lines.harmonic.size for s in states if s.method == "harmonic_balance"})
    if not found:
        return ""
    most = say("{found} to {found_2}", found=found[0], found_2=found[-1]) if len(found) > 1 else f"{found[0]}"
    return say("In these conditions the balanced solutions have lines at {most} mesh harmonics.", most=most)


def _assumptions(result: FleetPrediction) -> list[str]:
    unit, fleet = result.prediction.unit, result.fleet
    amplitudes = unit.system.transmission_error_m
    error = ", ".join(f"{1e6 * amplitude:g}" for amplitude in amplitudes)
    waves = say("a sine at the mesh frequency") if len(amplitudes) == 1 else say("sines at the first mesh harmonics")
    where = "amplitude" if len(amplitudes) == 1 else "amplitudes"
    damping = (
        say("The damping of the mesh acts always, also while the teeth are apart, as the paper prints it.")
        if unit.system.mesh_damping == "always"
        else say("The damping of the mesh acts only while teeth touch.")
    )
    found = [
        say(
            "The centres lie along x (ψ = 0), so that y is tangential; with the angle of the paper's text taken "
            "otherwise "
            "the force along x would vanish."
        ),
        say("The working transverse pressure angle stands for the pressure angle in the direction of the mesh force."),
        say(
            "The transmission error of the unloaded gears is {waves}, {where} {error} µm, phase 0, "
            "at any speed and load.",
            waves=waves,
            where=where,
            error=error,
        ),
        say(
            "The backlash is {half_backlash_m:g} µm, the same at every tooth.",
            half_backlash_m=2000000.0 * unit.system.half_backlash_m,
        ),
        say("Springs and dampers are the total of a gear's bearings; {split}.", split=_split_words(result)),
        damping,
        say("Gears are of steel, with solid discs; the mean stiffness of the mesh does not change with the load."),
        say(
            "No friction between the teeth, no bending or torsion of the shafts, no tilt of the gears, no tip "
            "relief or "
            "other flank correction, no scatter between teeth."
        ),
        say(
            "The torque is constant over a turn, and that of the wheel balances it; motor and wheelset add no inertia "
            "beyond what the two gears are given."
        ),
    ]
    if len(fleet.gear_pair) > 1:
        found.append(say("Losses and dynamics of the other gear pairs are left out."))
    return found
