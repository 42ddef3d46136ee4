"""The sweep of speed, up and down: where motions grow, where teeth separate, where two motions coexist."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import GearState, SpeedSweep
from tdacoustic.gears import Branch, coexisting
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers, Rule
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.gear_words import by_speed, hertz, law_words, micrometres, sentence, significant
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction

__all__ = ["speed_sweep", "sweep_words"]

METHOD = mark(
    "The train gets slowly faster, then slowly slower, at the torque of the fleet's law: each speed starts from the "
    "motion of the speed before. Where the two ways end in different motions, both are stable, and the history decides "
    "which one the gears take. The largest Floquet multiplier is of the motion that repeats with each mesh period, "
    "where one was found: below 1 it is stable; above 1 it is not what the gears do, and the motion shown is another "
    "one, found by integration in time. Torque ripple, acceleration and scatter between teeth are not part of it."
)

Mask = NDArray[np.bool_]


def speed_sweep(result: FleetPrediction) -> Section | None:
    """Return the section on the speed sweep, or None where none was computed."""
    sweep = result.prediction.sweep
    if sweep is None:
        return None
    blocks: list[Block] = [
        Paragraph(f"{say(METHOD)} {_range_words(result, sweep)}"),
        Sentences([sentence(words) for words in _findings(sweep)]),
    ]
    if not _is_at_rest(sweep):
        blocks.append(FigureBlock(_displacements(result, sweep), "calculated"))
        blocks.append(FigureBlock(_multipliers(sweep), "calculated"))
        if _separate(sweep.up).any() or _separate(sweep.down).any():
            blocks.append(FigureBlock(_contact(sweep), "calculated"))
    stretches = list(_stretches(sweep))
    if stretches:
        blocks.append(_table(stretches))
    return Section("speed-sweep", say("Speed sweep"), blocks)


def sweep_words(result: FleetPrediction) -> str:
    """Return what the sweep found in a sentence, empty without one."""
    sweep = result.prediction.sweep
    if sweep is None:
        return ""
    slowest, fastest = (significant(sweep.train_speed_km_h[end]) for end in (0, -1))
    return say(
        "speed sweep from {slowest} to {fastest} km/h: {findings}",
        slowest=slowest,
        fastest=fastest,
        findings="; ".join(_findings(sweep)),
    )


def _is_at_rest(sweep: SpeedSweep) -> bool:
    return set(sweep.up.method) | set(sweep.down.method) == {"at_rest"}


def _separate(branch: Branch) -> Mask:
    """Where teeth under torque leave each other."""
    return np.asarray((branch.contact_part < 1.0) & (branch.torque_n_m != 0.0))


def _repeats(branch: Branch) -> NDArray[np.int64]:
    return np.array(branch.repeats_after, dtype=np.int64)


def _differ(sweep: SpeedSweep) -> tuple[Mask, Mask]:
    """Where the two branches end in different motions that repeat, and where a motion that does not is on either."""
    open_ended = (_repeats(sweep.up) == 0) | (_repeats(sweep.down)[::-1] == 0)
    return coexisting(sweep.up, sweep.down), np.asarray(open_ended)


def _range_words(result: FleetPrediction, sweep: SpeedSweep) -> str:
    speeds, mesh = sweep.train_speed_km_h, sweep.up.mesh_hz
    return say(
        "{count} speeds from {slowest} to {fastest} km/h each way (mesh {lowest} to {highest}), torque {law}.",
        count=len(speeds),
        slowest=significant(speeds[0]),
        fastest=significant(speeds[-1]),
        lowest=hertz(float(mesh[0])),
        highest=hertz(float(mesh[-1])),
        law=law_words(result.fleet),
    )


def _findings(sweep: SpeedSweep) -> list[str]:
    if _is_at_rest(sweep):
        return [say("without torque nothing moves at any speed")]
    up, down = sweep.up, sweep.down
    twice, open_ended = _differ(sweep)
    found = [_ends_words(sweep, twice, judged=bool(open_ended.any()))]
    if open_ended.any():
        found.append(_open_words(sweep, open_ended))
    apart = _separate(up) | _separate(down)[::-1]
    found.append(
        say("teeth separate {places}", places=_places(sweep, apart))
        if apart.any()
        else say("teeth stay in contact at every speed")
    )
    several = (_repeats(up) != 1) | (_repeats(down)[::-1] != 1)
    if several.any():
        found.append(say("the motion does not repeat with each mesh period {places}", places=_places(sweep, several)))
    return [*found, _largest_words(sweep, one_motion=not (twice | open_ended).any())]


def _ends_words(sweep: SpeedSweep, twice: Mask, judged: bool) -> str:
    """Whether the two ways end in one motion; judged: only where both repeat."""
    if not twice.any():
        if judged:
            return say("the two ways end in one motion, judged where both ways repeat")
        return say("the two ways end in one motion")
    places = _places(sweep, twice)
    if judged:
        return say("two motions are stable {places}, judged where both ways repeat", places=places)
    return say("two motions are stable {places}", places=places)


def _largest_words(sweep: SpeedSweep, one_motion: bool) -> str:
    best = max((sweep.up, sweep.down), key=lambda branch: float(branch.dte_pp_m.max()))
    peak = int(best.dte_pp_m.argmax())
    length, frequency = micrometres(float(best.dte_pp_m[peak])), hertz(float(best.mesh_hz[peak]))
    if one_motion:
        return say("the largest DTE is {length} at {frequency}", length=length, frequency=frequency)
    if best is sweep.up:
        return say("the largest DTE is {length} at {frequency} on the way up", length=length, frequency=frequency)
    return say("the largest DTE is {length} at {frequency} on the way down", length=length, frequency=frequency)


def _open_words(sweep: SpeedSweep, open_ended: Mask) -> str:
    one_way = (_repeats(sweep.up) == 0) != (_repeats(sweep.down)[::-1] == 0)
    speeds = _counted(open_ended)
    if not one_way.any():
        return say("at {speeds} a motion does not repeat", speeds=speeds)
    return say(
        "at {speeds} a motion does not repeat, at {others} on one way only, where two motions may be stable too",
        speeds=speeds,
        others=_counted(one_way),
    )


def _counted(mask: Mask) -> str:
    return say_count("{count} speed", "{count} speeds", int(mask.sum()))


def _runs(mask: Mask) -> list[tuple[int, int]]:
    """First and last place of each stretch in which a mask holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(start), int(stop) - 1) for start, stop in zip(edges[::2], edges[1::2], strict=True)]


def _places(sweep: SpeedSweep, mask: Mask) -> str:
    """Say where a mask over ascending speeds holds, in km/h; many stretches only by their number."""
    speeds, runs = sweep.train_speed_km_h, _runs(mask)
    if len(runs) > 3:
        first, last = speeds[runs[0][0]], speeds[runs[-1][1]]
        return say(
            "at {count} speeds between {first:.4g} and {last:.4g} km/h", count=int(mask.sum()), first=first, last=last
        )
    words = [
        say("at {speed:.4g} km/h", speed=speeds[start])
        if start == end
        else say("from {first:.4g} to {last:.4g} km/h", first=speeds[start], last=speeds[end])
        for start, end in runs
    ]
    return joined(words)


def _displacements(result: FleetPrediction, sweep: SpeedSweep) -> Figure:
    elements: list[Element] = [
        Line(sweep.up.mesh_hz, 1e6 * sweep.up.dte_pp_m, say("up"), color=0),
        Line(sweep.down.mesh_hz, 1e6 * sweep.down.dte_pp_m, say("down"), style="dashed", color=1),
    ]
    twice, _ = _differ(sweep)
    if twice.any():
        y = np.concatenate([sweep.up.dte_pp_m[twice], sweep.down.dte_pp_m[::-1][twice]])
        elements.append(
            Markers(np.tile(sweep.up.mesh_hz[twice], 2), 1e6 * y, say("two motions"), symbol="square", color=6)
        )
    for name, symbol, several in (
        (say("repeats after several mesh periods"), "cross", True),
        (say("does not repeat"), "x", False),
    ):
        held = [(b, np.asarray(_repeats(b) > 1 if several else _repeats(b) == 0)) for b in (sweep.up, sweep.down)]
        if any(mask.any() for _, mask in held):
            x = np.concatenate([branch.mesh_hz[mask] for branch, mask in held])
            y = np.concatenate([branch.dte_pp_m[mask] for branch, mask in held])
            elements.append(Markers(x, 1e6 * y, name, symbol=symbol, color=2 if several else 3))  # type: ignore[arg-type]
    elements.append(_conditions(by_speed(result.prediction.conditions)))
    low, high = float(sweep.up.mesh_hz[0]), float(sweep.up.mesh_hz[-1])
    natural = result.prediction.unit.system.natural_frequencies_hz()
    elements += [Rule(float(value), f"{value:.0f} Hz") for value in natural if low < value < high]
    return Figure(
        "sweep-dte",
        say("Dynamic transmission error over the speed sweep"),
        say(
            "Peak to peak, of a motion that does not repeat that of its record. Broken vertical lines are natural "
            "frequencies of the linear system on seats that do not move; the nth harmonic of the mesh meets one "
            "already at an nth of it. Diamonds are the conditions, each computed by itself from teeth in contact."
        ),
        Axis(say("Mesh frequency"), "Hz", limits=(low, high)),
        Axis(say("DTE"), "µm", note=say("peak to peak")),
        elements,
        height=440,
    )


def _conditions(states: list[GearState]) -> Markers:
    x = np.array([state.mesh_hz for state in states])
    y = np.array([1e6 * state.steady.dte_pp_m for state in states])
    names = [state.condition.name for state in states]
    return Markers(x, y, say("conditions"), labels=names, symbol="diamond", color=7)


def _multipliers(sweep: SpeedSweep) -> Figure:
    low, high = float(sweep.up.mesh_hz[0]), float(sweep.up.mesh_hz[-1])
    elements: list[Element] = [
        Line(sweep.up.mesh_hz, sweep.up.floquet_max, say("up"), color=0),
        Line(sweep.down.mesh_hz, sweep.down.floquet_max, say("down"), style="dashed", color=1),
        Line(np.array([low, high]), np.array([1.0, 1.0]), say("limit of stability"), style="dotted", color=7),
    ]
    gaps = ((sweep.up, say("up, between gaps"), 0), (sweep.down, say("down, between gaps"), 1))
    for branch, name, color in gaps:
        held = _alone(branch.floquet_max)
        if held.any():
            elements.append(Markers(branch.mesh_hz[held], branch.floquet_max[held], name, color=color))
    return Figure(
        "sweep-floquet",
        say("Largest Floquet multiplier over the speed sweep"),
        say(
            "Of the motion that repeats with each mesh period, where one was found, else of the one that repeats after "
            "several; above 1 it is unstable, and the motion of the figure above is another. In a gap neither was "
            "found."
        ),
        Axis(say("Mesh frequency"), "Hz", limits=(low, high)),
        Axis(say("Largest multiplier")),
        elements,
        height=300,
    )


def _alone(values: NDArray[np.float64]) -> Mask:
    """Where a value stands between two gaps, so that no line can show it."""
    gap = np.concatenate([[True], np.isnan(values), [True]])
    return np.asarray(~gap[1:-1] & gap[:-2] & gap[2:])


def _contact(sweep: SpeedSweep) -> Figure:
    return Figure(
        "sweep-contact",
        say("Part of the time in which teeth touch, over the speed sweep"),
        "",
        Axis(say("Mesh frequency"), "Hz", limits=(float(sweep.up.mesh_hz[0]), float(sweep.up.mesh_hz[-1]))),
        Axis(say("Teeth touch"), say("% of time")),
        [
            Line(sweep.up.mesh_hz, 100.0 * sweep.up.contact_part, say("up"), color=0),
            Line(sweep.down.mesh_hz, 100.0 * sweep.down.contact_part, say("down"), style="dashed", color=1),
        ],
        height=300,
    )


def _stretches(sweep: SpeedSweep) -> Iterator[list[Cell]]:
    """Rows of the table: what happens from which speed to which."""
    mesh, speeds = sweep.up.mesh_hz, sweep.train_speed_km_h
    found: list[tuple[str, str, Mask]] = [(say("both"), say("two motions are stable"), _differ(sweep)[0])]
    for name, branch, order in ((say("up"), sweep.up, 1), (say("down"), sweep.down, -1)):
        repeats = _repeats(branch)[::order]
        found.append((name, say("teeth separate"), _separate(branch)[::order]))
        for periods in sorted(set(repeats[repeats > 1].tolist())):
            found.append((name, say("repeats after {count} mesh periods", count=periods), repeats == periods))
        found.append((name, say("does not repeat"), repeats == 0))
    for way, what, mask in found:
        for start, end in _runs(mask):
            yield [way, what, speeds[start], speeds[end], float(mesh[start]), float(mesh[end]), end - start + 1]


def _table(rows: list[list[Cell]]) -> Table:
    columns = (
        Column("direction", say("Way")),
        Column("what", say("What")),
        Column("from_km_h", say("From"), "km/h", 1, "number"),
        Column("to_km_h", say("To"), "km/h", 1, "number"),
        Column("from_mesh_hz", say("From"), say("mesh, Hz"), 1, "number"),
        Column("to_mesh_hz", say("To"), say("mesh, Hz"), 1, "number"),
        Column("speeds", say("Speeds"), "", 0, "number"),
    )
    return Table("sweep-stretches", say("What happens at which speeds"), columns, rows, origin="calculated")
