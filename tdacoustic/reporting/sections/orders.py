"""Orders: which lead over the speed, what is fixed in Hz, what repeats every turn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tdacoustic.measured.order_results import Average, ChannelOrders, RunOrders
from tdacoustic.measured.runs import MeasuredRun, receivers
from tdacoustic.recording import Channel
from tdacoustic.reporting.document import Block, Column, Details, FigureBlock, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.figure import Figure
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.folding import chosen, in_sight, rows_words
from tdacoustic.reporting.sections.order_figures import average_figure, cut_figure, shaft_words
from tdacoustic.reporting.sections.order_maps import frequency_figure, order_figure
from tdacoustic.reporting.sections.order_sentences import fixed_sentences, leader_sentences
from tdacoustic.reporting.sections.words import joined, pretty_signs, slug, speed_words
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["orders"]

SHOWN: Final = 2
"""Receivers whose maps are open; those of other channels are folded away."""
MOST_MAPS: Final = 24
"""Channels of all run-ups together that have maps, receivers first: a map is up to half a megabyte of the report."""

MOST_FAMILIES: Final = 4
"""Families of sidebands that a sentence names."""
FAINT_DB: Final = -20.0
"""Sidebands below this against their carrier add less than 0.05 dB to it."""


def orders(analysis: Analysis) -> Section | None:
    """Return the section on orders, or None where no run has any."""
    held = [(run, analysis.orders[run.name]) for run in analysis.runs if run.name in analysis.orders]
    if not held:
        return None
    microphones = receivers(analysis.runs)
    blocks: list[Block] = []
    run_ups = [(run, found) for run, found in held if not found.steady]
    for run, found in run_ups:
        blocks.append(_run_up(analysis, run, found, microphones, max(SHOWN, MOST_MAPS // len(run_ups))))
    steady = [(run, found) for run, found in held if found.steady]
    if steady:
        blocks.append(_steady(analysis, steady, microphones))
    blocks += _sidebands(analysis)
    return Section("orders", say("Orders"), [*blocks, Paragraph(_method(held))])


def _method(held: Sequence[tuple[MeasuredRun, RunOrders]]) -> str:
    shafts = joined(list(dict.fromkeys(shaft_words(found) for _, found in held)))
    asked = held[0][1].requested_bandwidth
    resampled = (
        say(
            "Signals are resampled to even steps of the angle of the {shafts}; orders are per turn of it, and named by "
            "the fleet.",
            shafts=shafts,
        )
        if any(_named(found) for _, found in held)
        else say(
            "Signals are resampled to even steps of the angle of the {shafts}; orders are per turn of it, and nobody "
            "names their owners.",
            shafts=shafts,
        )
    )
    cuts = say(
        "Cuts are {bandwidth:.3g} orders wide; each level has its floor and standard error, and orders.csv says why "
        "one is missing or doubtful.",
        bandwidth=asked,
    )
    return f"{resampled} {cuts}"


def _named(found: RunOrders) -> bool:
    return any(order.kind not in ("asked", "found") for order in found.orders)


def _channels(run: MeasuredRun, found: RunOrders) -> Iterator[tuple[Channel, ChannelOrders]]:
    assert run.recording is not None
    for held in found.channels:
        yield run.recording[held.channel], held


# ------------------------------------------------------------ run-ups


def _run_up(analysis: Analysis, run: MeasuredRun, found: RunOrders, microphones: Sequence[str], most: int) -> Section:
    """A run-up: its sentences, the maps and cuts of `most` channels, and what stays in Hz."""
    channels = sorted(_channels(run, found), key=lambda item: item[0].name not in microphones)
    sentences = [
        sentence
        for channel, held in channels
        if channel.name in microphones or not any(c.name in microphones for c, _ in channels)
        for sentence in leader_sentences(channel, held)
    ]
    sentences += [*fixed_sentences(found, [held for _, held in channels])]
    sentences += [
        say("The angle of the {shaft}: {note}.", shaft=shaft_words(found), note=note)
        for note in found.notes
        if note not in _told(run)
    ]
    sentences += list(dict.fromkeys(note[:1].upper() + note[1:] + "." for _, held in channels for note in held.notes))
    blocks: list[Block] = [Sentences([pretty_signs(sentence) for sentence in sentences])] if sentences else []
    open_ones = [name for name in microphones if any(c.name == name for c, _ in channels)][:SHOWN]
    if not open_ones and channels:
        open_ones = [channels[0][0].name]
    origin = analysis.campaign.origin
    drawn = [item for item in channels if item[0].name in open_ones]
    drawn += [item for item in channels if item[0].name not in open_ones][: max(0, most - len(drawn))]
    views: list[tuple[str, list[Block]]] = []
    for channel, held in drawn:
        figures = [frequency_figure(run.name, found, channel, held), cut_figure(run.name, found, channel, held)]
        if channel.name in open_ones:
            figures.insert(1, order_figure(run.name, found, channel, held))
        views.append((channel.name, [FigureBlock(figure, origin) for figure in figures if isinstance(figure, Figure)]))
    blocks += chosen(say("Channel"), [(name, shown) for name, shown in views if shown])
    left = len(channels) - len(drawn)
    if left > 0:
        words = say_count(
            "Maps and orders of {count} more channel are in result.h5 and orders.csv.",
            "Maps and orders of {count} more channels are in result.h5 and orders.csv.",
            left,
        )
        blocks.append(Paragraph(words))
    blocks += _fixed_table(analysis, run)
    return Section(slug("orders-of", run.name), say("Run {run}: {speed}", run=run.name, speed=speed_words(run)), blocks)


def _told(run: MeasuredRun) -> set[str]:
    """What other sections say of the run's speed."""
    assert run.measurement is not None
    return {note for profile in run.measurement.speed.profiles for note in profile.notes}


def _fixed_table(analysis: Analysis, run: MeasuredRun) -> list[Block]:
    table = analysis.tables["resonances"]
    held = table[table["run"] == run.name]
    if not len(held):
        return []
    columns = (
        Column("channel", say("Channel")),
        Column("kind", say("What")),
        Column("frequency_hz", say("Frequency"), "Hz", 1, "number"),
        Column("width_hz", say("Width"), "Hz", 1, "number"),
        Column("rise_db", say("Over its surroundings"), "dB", 1, "number"),
        Column("confidence", say("Confidence"), "", 2, "number"),
        Column("orders", say("Orders that pass")),
        Column("detail", say("By what")),
    )
    name = slug("resonances", run.name)
    caption = say(
        "What stays at its frequency while the speed changes, run {run}. A resonance raises orders that pass it; a "
        "line is there by itself at each class of speed. The width is an upper bound: the sweep broadens it.",
        run=run.name,
    )
    found = Table(name, caption, columns, _cells(held, columns), origin=analysis.campaign.origin)
    return [in_sight(found, say("What stays at its frequency"))]


# ------------------------------------------------------------ steady runs


def _steady(analysis: Analysis, held: Sequence[tuple[MeasuredRun, RunOrders]], microphones: Sequence[str]) -> Section:
    rows: list[tuple[str | float | None, ...]] = []
    best: tuple[float, MeasuredRun, Channel, Average] | None = None
    shares: list[tuple[float, str, str]] = []
    for run, found in held:
        for channel, orders_of in _channels(run, found):
            for average in orders_of.averages:
                lines = np.abs(average.amplitudes[1:]) ** 2
                share = float(lines.sum()) / (float(lines.sum()) + average.residual_mean_square)
                rows.append(
                    (
                        run.name,
                        channel.name,
                        average.shaft,
                        average.periods,
                        level_db(math.sqrt(float(lines.sum())), channel.quantity),
                        level_db(math.sqrt(average.residual_mean_square), channel.quantity),
                        100.0 * share,
                    )
                )
                if average.ratio == 1.0:
                    if channel.name in microphones:
                        shares.append((share, channel.name, run.name))
                    elif best is None or share > best[0]:
                        best = (share, run, channel, average)
    blocks: list[Block] = []
    if shares:
        blocks.append(Paragraph(_share_words(shares, shaft_words(held[0][1]))))
    columns = (
        Column("run", say("Run")),
        Column("channel", say("Channel")),
        Column("shaft", say("Shaft")),
        Column("turns", say("Turns"), "", 0, "number"),
        Column("synchronous_db", say("Repeats every turn"), "dB", 1, "number"),
        Column("residual_db", say("The rest"), "dB", 1, "number"),
        Column("share", say("Share that repeats"), "%", 0, "number"),
    )
    caption = say(
        "Time-synchronous averages of the runs of constant speed. The average of N turns keeps 1/N of the energy of "
        "what does not repeat."
    )
    if rows:
        table = Table("synchronous", caption, columns, rows, origin=analysis.campaign.origin)
        shown = [FigureBlock(average_figure(best[1].name, *best[2:]), analysis.campaign.origin)] if best else []
        words = say_count("{count} synchronous average", "{count} synchronous averages", len(rows))
        blocks.append(Details(words, [table, *shown]))
    return Section("synchronous-averages", say("What repeats with every turn, at constant speed"), blocks)


def _share_words(shares: Sequence[tuple[float, str, str]], shaft: str) -> str:
    """Which part of the sound repeats with every turn, at which channel in which run."""
    low, high = min(shares), max(shares)
    repeats = (
        say(
            "Of the sound energy {least:.0f} % ({channel}, run {run}) to {most:.0f} % ({other_channel}, run "
            "{other_run}) repeats with every turn of the {shaft}: gears and what turns.",
            least=100.0 * low[0],
            channel=low[1],
            run=low[2],
            most=100.0 * high[0],
            other_channel=high[1],
            other_run=high[2],
            shaft=shaft,
        )
        if len(shares) > 1
        else say(
            "Of the sound energy at {channel} {share:.0f} % repeats with every turn of the {shaft}: gears and what "
            "turns.",
            channel=low[1],
            share=100.0 * low[0],
            shaft=shaft,
        )
    )
    rest = say("The rest is what does not follow the shaft.")
    return f"{repeats} {rest}"


# ------------------------------------------------------------ sidebands


def _sidebands(analysis: Analysis) -> list[Block]:
    table = analysis.tables["sidebands"]
    if not len(table):
        return []
    held = table[table["pairs"] > 0]
    carriers = joined(list(dict.fromkeys(table["carrier"]))[:6])
    if not len(held):
        return [
            Paragraph(
                say("No pair of sidebands of {carriers} stands 6 dB over the floor on both sides.", carriers=carriers)
            )
        ]
    columns = (
        Column("run", say("Run")),
        Column("channel", say("Channel")),
        Column("carrier", say("Carrier")),
        Column("spacing", say("Spaced by")),
        Column("speed_rpm", say("Speed"), "rpm", 0, "number"),
        Column("pairs", say("Pairs"), "", 0, "number"),
        Column("sidebands_db", say("Sidebands over carrier"), "dB", 1, "number"),
        Column("amplitude_depth", say("Amplitude modulation"), "", 3, "number"),
        Column("phase_depth_rad", say("Phase modulation"), "rad", 3, "number"),
        Column("reason", say("Remark")),
    )
    rows = _cells(held, columns)
    name = say("Pairs of sidebands that stand 6 dB over the floor on both sides")
    found = Table("sidebands", name, columns, rows, origin=analysis.campaign.origin)
    folded = Details(rows_words(say("Sidebands over speed"), len(rows)), [found])
    return [Paragraph(_sideband_words(held)), folded]


def _sideband_words(held: pd.DataFrame) -> str:
    """Which sidebands stand out, how strong they are where, and how often their phases say which modulation it is."""
    said = []
    for (carrier, spacing), family in list(held.groupby(["carrier", "spacing"], sort=False))[:MOST_FAMILIES]:
        strongest = family.loc[family["sidebands_db"].idxmax()]
        steady = int((~family["reason"].fillna("").str.contains("unsteady")).sum())
        said.append(
            say(
                "of {carrier}, spaced by the {spacing}, up to {level:.1f} dB against the carrier ({channel}, "
                "{speed:.0f} rpm), with steady phases in {steady} of {findings} findings",
                carrier=carrier,
                spacing=spacing,
                level=strongest["sidebands_db"],
                channel=strongest["channel"],
                speed=strongest["speed_rpm"],
                steady=steady,
                findings=len(family),
            )
        )
    sentences = [say("Sidebands stand out {families}.", families="; ".join(said))]
    if held["sidebands_db"].max() < FAINT_DB:
        sentences.append(
            say(
                "All are more than {distance:.0f} dB below their carrier: too faint to matter to the sound.",
                distance=-FAINT_DB,
            )
        )
    return pretty_signs(" ".join(sentences))


def _cells(held: pd.DataFrame, columns: Sequence[Column]) -> list[list[Any]]:
    return [
        [row[column.key] if isinstance(row[column.key], str) or column.kind == "number" else "" for column in columns]
        for row in held.to_dict("records")
    ]
