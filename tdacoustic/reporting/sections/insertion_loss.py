"""What the housing takes from a source inside it, over frequency and at the conditions' mesh frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from tdacoustic.drive.insertion_loss import ASIDE_M, InsertionLoss, MeshLoss
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import hertz, named_conditions, sentence
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["insertion_loss_section"]

METHOD: Final = mark(
    "The insertion loss is the sound power level of a source in free field less the one that the housing radiates with "
    "the source inside; the latter from the mean over the surface at {surface}. The source is a point whose volume "
    "flow is held."
)
ELEMENTS: Final = mark(
    "The air inside and the walls act on each other: modes of the air between rigid walls and the housing's modes "
    "(finite elements); boundary elements give the sound outside."
)
LEFT_OUT: Final = mark(
    "The housing is closed: bearings, seals and vents let no sound through. Seats, gears, shafts and oil take no room, "
    "shafts and gears hang no mass on the seats, which matters at low frequencies (12 dB at 175 Hz for the reference "
    "drive, below 1 dB from 260 Hz on), and the air outside does not load the walls."
)
MASS_LAW: Final = mark(
    "The mass law is a reference, not a prediction: the transmission loss of limp walls for sound from all directions "
    "up to 78°. Stiff walls of a small box let less through at low frequencies; where the air inside or the walls "
    "resonate, and towards the coincidence of bending and sound waves, more goes through."
)

CAPTION: Final = mark(
    "Insertion loss at the mesh frequencies; with half and twice the loss factor η of the air inside; least and most "
    "with the source there and {aside:g} mm off along x, y and z"
)
_SENSITIVE_DB: Final = 5.0
"""Change of the insertion loss from which the report names what changes it [assumed]."""


def insertion_loss_section(result: FleetPrediction) -> Section | None:
    """Return the section on the housing's insertion loss; None where no housing is computed."""
    held = result.prediction.insertion_loss
    if held is None or not held.frequency_hz.size:
        return None
    fleet = result.fleet
    method = (say(METHOD, surface=result.prediction.surface), _place_words(fleet, held), say(ELEMENTS))
    blocks: list[Block] = [
        Paragraph(" ".join(method)),
        Sentences([text for text in (_range_words(held), _of_air_words(held), _aside_words(held)) if text]),
        FigureBlock(_figure(held), "calculated"),
        _at_mesh(held),
        Details(say("Third octaves"), [_third_octaves(held)]),
        Sentences([_placement_words(fleet, held), _air_words(held), say(MASS_LAW), say(LEFT_OUT)]),
    ]
    return Section("insertion-loss", say("Insertion loss of the housing"), blocks)


def _place_words(fleet: Fleet, held: InsertionLoss) -> str:
    x, y, z = (pretty_signs(f"{place:.3g}") for place in held.source_m)
    if fleet.masuda.placement.value == "inside" and fleet.masuda.position_m is not None:
        return say(
            "It stands at x = {x}, y = {y}, z = {z} m in the drive's frame ([masuda] position_m).", x=x, y=y, z=z
        )
    return say(
        "It stands at the pitch point between the shafts [assumed], at x = {x}, y = {y}, z = {z} m in the drive's "
        "frame.",
        x=x,
        y=y,
        z=z,
    )


def _known(held: InsertionLoss) -> list[MeshLoss]:
    return [mesh for mesh in held.at_mesh if mesh.loss_db is not None]


def _range_words(held: InsertionLoss) -> str:
    clauses = []
    if held.band_db.size:
        low, high = int(np.argmin(held.band_db)), int(np.argmax(held.band_db))
        clauses.append(
            say(
                "in third octaves the housing takes {least:.0f} dB (at {least_at} Hz) to {most:.0f} dB (at "
                "{most_at} Hz)",
                least=held.band_db[low],
                least_at=_nominal(held.band_hz[low]),
                most=held.band_db[high],
                most_at=_nominal(held.band_hz[high]),
            )
        )
    losses = [
        say("{loss:.0f} dB in condition {condition}", loss=mesh.loss_db, condition=mesh.condition)
        for mesh in _known(held)
    ]
    if losses:
        clauses.append(say("at the mesh frequencies {losses}", losses=joined(losses)))
    beyond = [mesh.condition for mesh in held.at_mesh if mesh.loss_db is None]
    if beyond:
        clauses.append(say("of {conditions} it is not computed", conditions=named_conditions(beyond)))
    return sentence("; ".join(clauses)) if clauses else ""


def _of_air_words(held: InsertionLoss) -> str:
    pairs = [(mesh, mesh.of_air_db) for mesh in _known(held) if mesh.of_air_db is not None]
    strong = [(mesh, pair) for mesh, pair in pairs if pair[1] - pair[0] > _SENSITIVE_DB]
    if not pairs:
        return ""
    if not strong:
        return say(
            "From half to twice the loss factor of the air inside it changes by less than 5 dB at the mesh frequencies."
        )
    parts = joined(
        [
            say(
                "from {low:.0f} to {high:.0f} dB in condition {condition}",
                low=pair[0],
                high=pair[1],
                condition=mesh.condition,
            )
            for mesh, pair in strong
        ]
    )
    return say(
        "Where the air inside resonates its loss factor decides: from half to twice its value "
        "the insertion loss goes {changes}.",
        changes=parts,
    )


def _aside_words(held: InsertionLoss) -> str:
    pairs = [(mesh, mesh.beside_db) for mesh in _known(held) if mesh.beside_db is not None]
    strong = [(mesh, pair) for mesh, pair in pairs if pair[1] - pair[0] > _SENSITIVE_DB]
    if not strong:
        return ""
    parts = joined(
        [
            say(
                "{low:.0f} to {high:.0f} dB in condition {condition}",
                low=pair[0],
                high=pair[1],
                condition=mesh.condition,
            )
            for mesh, pair in strong
        ]
    )
    return say(
        "The place of the source matters too: there and {aside:g} mm off along x, y or z it is "
        "{losses}. A symmetric box with the source in its planes of symmetry answers with a part "
        "of its modes only.",
        aside=1000.0 * ASIDE_M,
        losses=parts,
    )


def _placement_words(fleet: Fleet, held: InsertionLoss) -> str:
    losses = [mesh.loss_db for mesh in _known(held) if mesh.loss_db is not None]
    loss = say("{low:.0f} to {high:.0f} dB", low=min(losses), high=max(losses)) if losses else say("its insertion loss")
    placement = fleet.masuda.placement.value
    if placement == "inside":
        return say(
            '[masuda] placement = "inside", as the paper has it: Masuda\'s level is that of gear units measured with '
            'their housings, and here the housing takes {loss} from it a second time. With placement = "free" it would '
            "take nothing.",
            loss=loss,
        )
    if placement == "off":
        return say(
            '[masuda] placement = "off": the meshing noise is no part of the total. Masuda\'s level is that of gear '
            "units measured with their housings."
        )
    return say(
        '[masuda] placement = "free": Masuda\'s level is that of gear units measured with their housings, so the '
        'source stands outside and keeps its power; none of this is taken from it. With placement = "inside", as the '
        "paper has it, the meshing noise would be lower by {loss}.",
        loss=loss,
    )


def _air_words(held: InsertionLoss) -> str:
    air = held.air
    return say(
        "The air inside has a loss factor of {loss_factor:g}, an absorption coefficient of "
        "{absorption:.2g} at {frequency}; viscosity and heat conduction at bare walls alone would "
        "give a loss factor of {bare_walls:.1g}. Gears, shafts, oil mist and leaks make the rest "
        "[assumed].",
        loss_factor=air.loss_factor,
        absorption=air.absorption,
        frequency=hertz(air.frequency_hz),
        bare_walls=air.bare_walls,
    )


def _nominal(frequency_hz: float) -> str:
    """A third octave's name: the middle to the two or three digits of the standard's series."""
    series = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
    number = round(10.0 * np.log10(frequency_hz))
    return f"{series[number % 10] * 10.0 ** (number // 10):g}"


def _figure(held: InsertionLoss) -> Figure:
    known = _known(held)
    elements: list[Element] = [Line(held.frequency_hz, held.loss_db, say("insertion loss"), color=0)]
    if held.band_hz.size:
        elements.append(Line(*_steps(held), say("its third octaves"), color=0, width=2.5, opacity=0.55))
    elements.append(
        Line(held.frequency_hz, held.mass_law_db, say("mass law, field incidence"), style="dashed", color=7)
    )
    if known:
        elements.append(
            Markers(
                np.array([mesh.frequency_hz for mesh in known]),
                np.array([mesh.loss_db for mesh in known]),
                say("at mesh frequencies"),
                labels=[mesh.condition for mesh in known],
                texts=[say("condition {condition}", condition=mesh.condition) for mesh in known],
                symbol="diamond",
                color=1,
            )
        )
    return Figure(
        "insertion-loss",
        say("Insertion loss of the housing over frequency"),
        say(
            "Lines 1/48 octave apart; third octaves are means of the radiated energy of equally strong lines. Diamonds "
            "with the names of the conditions stand at their mesh frequencies. The mass law is the transmission "
            "loss of limp walls."
        ),
        Axis(say("Frequency"), "Hz", "log"),
        Axis(say("Insertion loss"), "dB"),
        elements,
    )


def _steps(held: InsertionLoss) -> tuple[np.ndarray, np.ndarray]:
    """The third octaves as a line level from edge to edge of each."""
    edges = np.outer(held.band_hz, [10.0**-0.05, 10.0**0.05])
    return edges.ravel(), np.repeat(held.band_db, 2)


def _at_mesh(held: InsertionLoss) -> Table:
    columns = [
        Column("condition", say("Condition")),
        Column("frequency_hz", say("Mesh frequency"), "Hz", 1, "number"),
        Column("insertion_loss_db", say("Insertion loss"), "dB", 1, "number"),
        Column("mass_law_db", say("Mass law"), "dB", 1, "number"),
        Column("half_air_loss_db", say("Air η/2"), "dB", 1, "number"),
        Column("double_air_loss_db", say("Air 2η"), "dB", 1, "number"),
        Column("beside_low_db", say("Moved: least"), "dB", 1, "number"),
        Column("beside_high_db", say("most"), "dB", 1, "number"),
    ]
    rows: list[Sequence[Cell]] = []
    for mesh in held.at_mesh:
        cells: list[Cell] = [mesh.condition, mesh.frequency_hz, mesh.loss_db, mesh.mass_law_db]
        rows.append([*cells, *(mesh.of_air_db or (None, None)), *(mesh.beside_db or (None, None))])
    caption = say(CAPTION, aside=1e3 * ASIDE_M)
    return Table("insertion-loss-at-mesh", caption, columns, rows, origin="calculated")


def _third_octaves(held: InsertionLoss) -> Table:
    columns = (
        Column("band_hz", say("Third octave"), "Hz", None, "number"),
        Column("insertion_loss_db", say("Insertion loss"), "dB", 1, "number"),
    )
    rows = [(float(_nominal(band)), mean) for band, mean in zip(held.band_hz, held.band_db, strict=True)]
    return Table("insertion-loss-bands", say("Insertion loss in third octaves"), columns, rows, origin="calculated")
