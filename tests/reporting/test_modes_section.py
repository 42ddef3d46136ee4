"""What the section on modes says of made-up comparisons: bands by name, many speeds in short."""

from types import SimpleNamespace

from tdacoustic.reporting.document import Details, Sentences, Table, walk
from tdacoustic.reporting.sections.modes import modes


def part(band, share, depends_on):
    return SimpleNamespace(
        band=band, mode="traction", mean_square=1e-2, speed_part=1e-2 * (1.0 - share), torque_part=1e-2 * share,
        torque_share=share, share_low=share - 0.05, share_high=share + 0.05, depends_on=depends_on,
        words=f"not decided: {100 * share:.0f} % (10 to 80 %) comes with the torque",
    )  # fmt: skip


def speed(km_h):
    parts = (part("250 Hz", 0.9, "torque"), part("500 Hz", 0.1, "speed"), part("total", 0.5, "undecided"))
    comparison = SimpleNamespace(parts=parts, doubts=(), scatter_assumed=False)
    return SimpleNamespace(
        speed=km_h,
        unit="km/h",
        channel="mic",
        runs=(("traction", "a"), ("coast", "b")),
        comparison=comparison,
        reason="",
    )


def section(*speeds):
    return modes(SimpleNamespace(modes=[speed(s) for s in speeds], campaign=SimpleNamespace(origin="measured")))


def test_few_speeds_are_told_each_with_the_bands_of_the_torque():
    (sentences,) = [block for block in section(20.0, 30.0).blocks if isinstance(block, Sentences)]
    assert len(sentences.items) == 2
    assert sentences.items[0].endswith("50 % (10 to 80 %) comes with the torque; most of it in the band 250 Hz.")


def test_many_speeds_are_told_in_short_and_each_below():
    made = section(*range(20, 30))
    sentences = made.blocks[0]
    assert sentences.items == (
        "Traction at mic, at 10 speeds, 20 km/h to 29 km/h: not decided, 50 % of the sound comes with the "
        "torque; most of the band comes with it in 250 Hz at 10 of 10 speeds.",
    )
    assert made.blocks[1].summary == "Speed by speed, 10 sentences"


def test_the_whole_sound_stands_in_sight_and_its_bands_are_folded():
    made = section(20.0, 30.0)
    (whole,) = [block for block in made.blocks if isinstance(block, Table)]
    assert [row[2] for row in whole.rows] == ["all", "all"]
    folded = [block for block in made.blocks if isinstance(block, Details)]
    tables = [table for block in folded for table in walk(block.blocks) if isinstance(table, Table)]
    assert [(table.name, len(table.rows)) for table in tables] == [("modes-of-bands", 4)]
