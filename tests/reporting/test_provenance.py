"""The versions that made the numbers: those of every record, not of the first one."""

from tdacoustic.reporting.document import Facts, Paragraph
from tdacoustic.reporting.sections.provenance import versions_of
from tdacoustic.steps.record import Record


def record(**libraries):
    return Record("step", 1, "Step", "", "{}", (), tuple(libraries.items()), 0.0)


def told(section):
    facts = {fact.key: fact.value for block in section.blocks if isinstance(block, Facts) for fact in block.pairs}
    return facts, [block.text for block in section.blocks if isinstance(block, Paragraph)]


def test_one_version_is_said_plainly():
    records = [(str(n), record(numpy="2.1.0", scipy="1.14")) for n in range(3)]
    assert told(versions_of({"numpy": "2.1.0", "scipy": "1.14"}, records)) == (
        {"numpy": "2.1.0", "scipy": "1.14"},
        [],
    )


def test_each_of_several_versions_is_said_with_its_steps():
    records = [("a", record(numpy="2.1.0")), ("b", record(numpy="2.0.2")), ("c", record(numpy="2.0.2"))]
    facts, words = told(versions_of({"numpy": "2.1.0"}, [*records, records[0]]))  # a step may be listed twice
    assert facts == {"numpy": "2.0.2 in 2 steps; 2.1.0 in 1 step"}
    assert len(words) == 1 and "kept in the store" in words[0]


def test_a_version_of_now_stands_beside_those_of_kept_steps():
    facts, words = told(versions_of({"numpy": "2.2.0", "python": "3.12"}, [("a", record(numpy="2.1.0"))]))
    assert facts == {"numpy": "2.2.0 now; 2.1.0 in 1 step", "python": "3.12"} and words
