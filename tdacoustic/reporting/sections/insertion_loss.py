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
from tdacoustic.reporting.sections.gear_words import hertz
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["insertion_loss_section"]

METHOD: Final = mark(
    "The insertion loss is the sound power level of a source in free field less the one that the housing radiates with "
    "the source inside; the latter from the mean over the surface at {surface}. The source is a point whose volume "
    "flow is held. It stands {place}. The air inside and the walls act on each other: modes of the air between rigid "
    "walls and the housing's modes (finite elements); boundary elements give the sound outside."
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

CAPTION: Final = (
    "Insertion loss at the mesh frequencies; with half and twice the loss factor η of the air inside; least and most "
    f"with the source there and {1e3 * ASIDE_M:g} mm off along x, y and z"
)
_SENSITIVE_DB: Final = 5.0
"""Change of the insertion loss from which the report names what changes it [assumed]."""


def insertion_loss_section(result: FleetPrediction) -> Section | None:
    """Return the section on the housing's insertion loss; None where no housing is computed."""
    held = result.prediction.insertion_loss
    if held is None or not held.frequency_hz.size:
        return None
    fleet = result.fleet
    blocks: list[Block] = [
        Paragraph(say(METHOD).format(surface=result.prediction.surface, place=_place_words(fleet, held))),
        Sentences([text for text in (_range_words(held), _of_air_words(held), _aside_words(held)) if text]),
        FigureBlock(_figure(held), "calculated"),
        _at_mesh(held),
        Details(say("Third octaves"), [_third_octaves(held)]),
        Sentences([_placement_words(fleet, held), _air_words(held), say(MASS_LAW), say(LEFT_OUT)]),
    ]
    return Section("insertion-loss", say("Insertion loss of the housing"), blocks)


def _place_words(fleet: Fleet, held: InsertionLoss) -> str:
    x, y, z = (pretty_signs(f"{place:.3g}") for place in held.source_m)
    where = say("at x = {x}, y = {y}, z = {z} m in the drive's frame", x=x, y=y, z=z)
    stated = fleet.masuda.placement.value == "inside" and fleet.masuda.position_m is not None
    return (
        say("{where} ([masuda] position_m)", where=where)
        if stated
        else say("at the pitch point between the shafts [assumed], {where}", where=where)
    )


def _known(held: InsertionLoss) -> list[MeshLoss]:
    return [mesh for mesh in held.at_mesh if mesh.loss_db is not None]


def _range_words(held: InsertionLoss) -> str:
    text = ""
    if held.band_db.size:
        low, high = int(np.argmin(held.band_db)), int(np.argmax(held.band_db))
        text = say(
            "In third octaves the housing takes {band_db:.0f} dB (at {nominal} Hz) to "
            "{band_db_2:.0f} dB (at {nominal_2} Hz)",
            band_db=held.band_db[low],
            nominal=_nominal(held.band_hz[low]),
            band_db_2=held.band_db[high],
            nominal_2=_nominal(held.band_hz[high]),
        )
    known = _known(held)
    if known:
        parts = joined(
            [
                say("{loss_db:.0f} dB in condition {condition}", loss_db=mesh.loss_db, condition=mesh.condition)
                for mesh in known
            ]
        )
        text += say("{value} the mesh frequencies {parts}", value=say("; at") if text else say("At"), parts=parts)
    beyond = [mesh.condition for mesh in held.at_mesh if mesh.loss_db is None]
    if beyond:
        text += say(
            "{value} condition{value_2} {beyond} it is not computed",
            value=say("; of") if text else say("Of"),
            value_2="s" if len(beyond) > 1 else "",
            beyond=joined(beyond),
        )
    return f"{text}."


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
                "from {pair:.0f} to {pair_2:.0f} dB in condition {condition}",
                pair=pair[0],
                pair_2=pair[1],
                condition=mesh.condition,
            )
            for mesh, pair in strong
        ]
    )
    return say(
        "Where the air inside resonates its loss factor decides: from half to twice its value "
        "the insertion loss goes {parts}.",
        parts=parts,
    )


def _aside_words(held: InsertionLoss) -> str:
    pairs = [(mesh, mesh.beside_db) for mesh in _known(held) if mesh.beside_db is not None]
    strong = [(mesh, pair) for mesh, pair in pairs if pair[1] - pair[0] > _SENSITIVE_DB]
    if not strong:
        return ""
    parts = joined(
        [
            say(
                "{pair:.0f} to {pair_2:.0f} dB in condition {condition}",
                pair=pair[0],
                pair_2=pair[1],
                condition=mesh.condition,
            )
            for mesh, pair in strong
        ]
    )
    return say(
        "The place of the source matters too: there and {aside_m:g} mm off along x, y or z it is "
        "{parts}. A symmetric box with the source in its planes of symmetry answers with a part "
        "of its modes only.",
        aside_m=1000.0 * ASIDE_M,
        parts=parts,
    )


def _placement_words(fleet: Fleet, held: InsertionLoss) -> str:
    losses = [mesh.loss_db for mesh in _known(held) if mesh.loss_db is not None]
    span = (
        say("{losses:.0f} to {losses_2:.0f} dB", losses=min(losses), losses_2=max(losses))
        if losses
        else say("its insertion loss")
    )
    level = say("Masuda's level is that of gear units measured with their housings")
    placement = fleet.masuda.placement.value
    if placement == "inside":
        return say(
            '[masuda] placement = "inside", as the paper has it: {level}, and here the housing '
            'takes {span} from it a second time. With placement = "free" it would take nothing.',
            level=level,
            span=span,
        )
    if placement == "off":
        return say('[masuda] placement = "off": the meshing noise is no part of the total. {level}.', level=level)
    return say(
        '[masuda] placement = "free": {level}, so the source stands outside and keeps its power; '
        'none of this is taken from it. With placement = "inside", as the paper has it, the '
        "meshing noise would be lower by {span}.",
        level=level,
        span=span,
    )


def _air_words(held: InsertionLoss) -> str:
    air = held.air
    return say(
        "The air inside has a loss factor of {loss_factor:g}, an absorption coefficient of "
        "{absorption:.2g} at {hertz}; viscosity and heat conduction at bare walls alone would "
        "give a loss factor of {bare_walls:.1g}. Gears, shafts, oil mist and leaks make the rest "
        "[assumed].",
        loss_factor=air.loss_factor,
        absorption=air.absorption,
        hertz=hertz(air.frequency_hz),
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
            "loss of "
            "limp walls."
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
        Column("beside_high_db", "most", "dB", 1, "number"),
    ]
    rows: list[Sequence[Cell]] = []
    for mesh in held.at_mesh:
        cells: list[Cell] = [mesh.condition, mesh.frequency_hz, mesh.loss_db, mesh.mass_law_db]
        rows.append([*cells, *(mesh.of_air_db or (None, None)), *(mesh.beside_db or (None, None))])
    return Table("insertion-loss-at-mesh", CAPTION, columns, rows, origin="calculated")


def _third_octaves(held: InsertionLoss) -> Table:
    columns = (
        Column("band_hz", say("Third octave"), "Hz", None, "number"),
        Column("insertion_loss_db", say("Insertion loss"), "dB", 1, "number"),
    )
    rows = [(float(_nominal(band)), mean) for band, mean in zip(held.band_hz, held.band_db, strict=True)]
    return Table("insertion-loss-bands", say("Insertion loss in third octaves"), columns, rows, origin="calculated")
