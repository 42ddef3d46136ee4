"""The page of the fleet view: what it says and tells apart, what it leaves out and says so, how large it is."""

import html.parser
import re

import pytest
from made_up_results import calibration, fitted, level, made_result, many_results, quality, sha, stated, verdict

from tdacoustic.reporting import ReportError
from tdacoustic.reporting.document import FigureBlock, Link, Notice, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.figure import Axis, Line, Markers
from tdacoustic.reporting.fleet_report import fleet_report
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.sections.campaigns_lineage import FILES_OF
from tdacoustic.reporting.sections.campaigns_rows import MOST_POINTS, MOST_ROWS

pytest.importorskip("pyarrow", reason="tables of results are read with pyarrow")

EVIL = "</script><img src=x onerror=alert(1)> %{x} $y$"


def gathered(folder, out=None):
    from tdacoustic.gathering import Gathering, compared, find_folders, open_result, read_result, relative_link

    found = [read_result(open_result(path)).kept for path in find_folders([folder])[0]]
    links = {r.result: relative_link(r.path / "report.html", out or folder / "view") for r in found}
    return Gathering(tuple(found), (), compared(found), {"results": len(found)}, links)


def blocks_of(document, kind):
    return [block for block in walk((*document.summary, *document.sections)) if isinstance(block, kind)]


def table(document, name):
    (found,) = [block for block in blocks_of(document, Table) if block.name == name]
    return found


def figure(document, name):
    (found,) = [block for block in blocks_of(document, FigureBlock) if block.figure.name == name]
    return found


def words(document):
    said = [block.text for block in blocks_of(document, (Paragraph, Notice))]
    said += [item for block in blocks_of(document, Sentences) for item in block.items]
    return " ".join([*said, *(notice.text for notice in document.notices)])


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Two trains measured, one synthetic, one printed level; over two years and two speeds."""
    folder = tmp_path_factory.mktemp("mixed")
    for number, (train, year, shift) in enumerate([("A 1", 2019, 0.0), ("A 1", 2021, 1.0), ("A 2", 2021, 2.0)]):
        made_result(
            folder / f"m{number}",
            name=f"measured {number}",
            meta={"train": train, "year": str(year)},
            levels=[level("20", 20.0, 80.0 + shift), level("60", 60.0, 95.0 + shift)],
            dominance=[verdict("20", 20.0, "motor", 0.97), verdict("60", 60.0, ("gearbox", "motor")[number % 2], 0.95)],
            quality=[quality("20"), quality("60", word="bad" if number == 2 else "ok", channel="z")],
            files={"calibration.json": calibration({"masuda.constant_db": fitted(20.0 + shift, 19.0, 24.0)})},
        )
    made_result(
        folder / "s",
        name="synthetic",
        origin="synthetic",
        levels=[level("60", 60.0, 70.0)],
        dominance=[verdict("60", 60.0, "wheelset", 0.99)],
    )
    made_result(folder / "p", name="printed", origin="printed", levels=[stated(1, "60", 88.0)])
    return fleet_report(gathered(folder))


def test_origins_are_told_apart_everywhere(mixed):
    assert mixed.origin == "mixed"
    assert [(fact.value, fact.origin) for fact in mixed.facts if fact.origin] == [
        ("3", "measured"),
        ("1", "synthetic"),
        ("1", "printed"),
    ]
    for block in blocks_of(mixed, FigureBlock):
        assert block.origin is not None
        assert block.origin in block.figure.title
    for found in blocks_of(mixed, Table):
        kinds = {column.kind for column in found.columns}
        no_numbers_of_campaigns = found.name in ("dataset", "files-behind")
        assert found.origin is not None or "origin" in kinds or no_numbers_of_campaigns, found.name
    assert [row[1] for row in table(mixed, "dominance-matrix").rows] == ["measured", "measured", "synthetic"]
    assert "1 of 5 campaigns here was made by a program; nothing in it was measured." in words(mixed)


def test_each_section_leads_to_the_files_and_each_result_to_its_inputs(tmp_path):
    from tdacoustic.gathering.contracts import COPIED

    logs = [sha(f"log {number}") for number in range(4)]
    made_result(tmp_path / "a", name="a", levels=[level("20", 20.0, 80.0)], quality=[quality("20")], inputs=logs)
    document = fleet_report(gathered(tmp_path))
    read = {f"{name}.csv" for name in COPIED} | {"quality.csv", "calibration.json", "manifest.json"}
    assert {file for files in FILES_OF.values() for file in files} <= read
    page = render_html(document)
    assert page.count('class="behind" href="#sources"') >= 3
    for section in document.sections[:-1]:
        inside = page.split(f'<section id="{section.id}"')[1].split("</section>")[0]
        shown = inside.count('<figure class="figure"') + inside.count('<figure class="table')
        assert inside.count('class="behind" href="#sources"') == shown, section.id
    titles = {section.title for section in document.sections}
    assert titles >= {row[0] for row in table(document, "files-behind").rows}
    (row,) = table(document, "results-behind").rows
    campaign_file = sha("aa")
    assert row[-1] == " ".join(digits[:12] for digits in (campaign_file, *logs[:2])) + " …"
    assert row[5] == 5 and row[6] == pytest.approx(4.5e-3)


def test_the_matrix_has_the_word_the_probability_and_the_way_to_the_report(mixed):
    found = table(mixed, "dominance-matrix")
    assert [column.title for column in found.columns] == ["Train, else campaign", "Origin", "Fleet", "15–25", "55–65"]
    first, second, third = found.rows
    assert first[0] == Link("A 1", "../m1/report.html")  # the newest of two
    assert list(first[3:]) == ["motor 0.97 (2)", "mixed: gearbox 1, motor 1"]
    assert list(second[3:]) == ["motor 0.97", "gearbox 0.95"]
    assert (third[0].text, list(third[3:])) == ("synthetic", [None, "wheelset 0.99"])


def test_the_levels_table_and_figures_hold_the_medians(mixed):
    assert list(table(mixed, "levels-measured").rows[0][2:]) == ["2019–2021", 4, 80.5, 95.5]
    lines = [e for e in figure(mixed, "levels-over-speed-measured").figure.elements if isinstance(e, Line)]
    assert {line.name: (line.x.tolist(), line.y.tolist()) for line in lines} == {
        "A 1": ([20.0, 60.0], [80.5, 95.5]),
        "A 2": ([20.0, 60.0], [82.0, 97.0]),
    }
    years = figure(mixed, "levels-over-years-measured").figure
    medians = {e.name: (e.x.tolist(), e.y.tolist()) for e in years.elements if isinstance(e, Line)}
    assert medians["57.5–62.5 km/h, median"] == ([2019.5, 2021.5], [95.0, 96.5])
    assert "Levels over years, synthetic: no year is known of recorded ones, so there is no figure." in words(mixed)


def test_stated_levels_are_not_mixed_with_recorded_ones(tmp_path):
    for number, shift in enumerate((0.0, 1.0)):
        keys = {"levels": [level("60", 60.0, 90.0 + shift), stated(1, "60", 80.0)], "dominance": [verdict("60", 60.0)]}
        made_result(tmp_path / str(number), name=f"c{number}", meta={"train": "A", "year": f"202{number}"}, **keys)
    document = fleet_report(gathered(tmp_path))
    assert [list(row[2:]) for row in table(document, "levels-measured").rows] == [
        ["recorded", "2020–2021", 2, 90.5],
        ["stated", "2020–2021", 2, 80.0],
    ]
    elements = figure(document, "levels-over-speed-measured").figure.elements
    (line,) = [element for element in elements if isinstance(element, Line)]
    assert line.y.tolist() == [90.5]
    crosses = [element.y.tolist() for element in elements if isinstance(element, Markers) and element.symbol == "x"]
    assert crosses == [[80.0, 80.0]]
    years = figure(document, "levels-over-years-measured").figure.elements
    assert {level for element in years for level in element.y.tolist()} == {90.0, 91.0}


def test_the_summary_says_how_much_and_what(mixed):
    said = words(mixed)
    assert (
        "3 measured campaigns, 1 synthetic campaign and 1 printed campaign of 2 trains, 1 fleet, 2019 to 2021." in said
    )
    assert "is of the motor in 4 and the gearbox in 2 of 6 measured conditions with a verdict." in said
    assert "The 6 measured levels at 4 m go from 80.0 dB re 20 µPa (A 1, 20 km/h) to 97.0 dB (A 2, 60 km/h)." in said
    assert "Of 6 measured runs 1 is bad, most often for clipping; 0 more have a warning." in said
    assert "nothing can stand out" in said


def test_intervals_are_drawn_and_stuck_values_marked(tmp_path):
    for number, keys in enumerate(
        [
            {"value": 20.0, "low": 19.0, "high": 21.0},
            {"value": 22.0, "low": 20.0},
            {"value": 60.0},
            {"value": 21.0, "low": 19.0, "high": 23.0},
        ]
    ):
        files = {"calibration.json": calibration({"masuda.constant_db": fitted(**keys)})}
        made_result(tmp_path / str(number), name=f"c{number}", files=files)
    document = fleet_report(gathered(tmp_path))
    drawn = figure(document, "parameter-1").figure
    assert drawn.y_axis.names == ("c2", "c1", "c3", "c0")  # from below: the largest value is lowest
    markers = {
        e.name.split(",")[0].split(":")[0]: (e.x.tolist(), e.y.tolist())
        for e in drawn.elements
        if isinstance(e, Markers)
    }
    assert markers == {
        "determined": ([20.0, 21.0], [3.0, 2.0]),
        "on a bound": ([60.0], [0.0]),
        "not determined by the data": ([22.0], [1.0]),
    }
    ends = [tuple(e.x[:2]) for e in drawn.elements if isinstance(e, Line)]
    assert ends == [(19.0, 21.0), (20.0, 60.0)]  # the open end at the bound
    row = table(document, "parameters").rows[0]
    assert list(row[3:]) == [4, 2, 1, 1, 20.5, pytest.approx(1.4826 * 0.5)]


def test_an_outlier_is_in_its_table_with_group_and_threshold(tmp_path):
    """Median 85.1; the fifth and sixth of the ten distances are 0.6 and 0.8: scatter 1.4826 times 0.7, 1.038 dB."""
    for number, value in enumerate([84.0, 85.0, 85.5, 86.0, 84.5, 85.2, 84.8, 85.9, 84.2, 97.0]):
        made_result(tmp_path / str(number), name=f"c{number}", levels=[level("a", 40.0, value)])
    document = fleet_report(gathered(tmp_path))
    (row,) = table(document, "outliers").rows
    assert row[0] == Link("c9", "../9/report.html")
    assert list(row[2:8]) == ["measured", "Fleet A", "level at 37.5–42.5 km/h, dB", 97.0, 85.1, 1.038]
    assert list(row[9:]) == [7.1, 10]
    assert "1 value stands out" in words(document)


def test_names_from_results_stay_text_and_links_lead_nowhere_else(tmp_path):
    class Links(html.parser.HTMLParser):
        def __init__(self):
            super().__init__()
            self.hrefs, self.tags = [], set()

        def handle_starttag(self, tag, attrs):
            self.tags.add((tag, dict(attrs).get("onerror")))
            if tag == "a":
                self.hrefs.append(dict(attrs)["href"])

    for number in range(2):
        made_result(
            tmp_path / f"javascript:{number}",
            name=EVIL + str(number),
            meta={"train": EVIL, "date": EVIL},
            fleet=EVIL,
            levels=[level("20", 20.0, 80.0), level("40", 40.0, 90.0)],
            dominance=[verdict("20", 20.0, "<b>motor</b>"), verdict("40", 40.0)],
            quality=[quality("20", EVIL, EVIL, "bad", EVIL)],
            files={"calibration.json": calibration({EVIL: fitted(20.0, 19.0, 21.0)})},
            problems=[EVIL],
        )
    page = render_html(fleet_report(gathered(tmp_path)))
    links = Links()
    links.feed(page)
    assert not any(onerror for _, onerror in links.tags)
    outside = {href for href in links.hrefs if not href.startswith("#")}
    assert outside == {"../javascript%3A1/report.html", "../javascript%3A0/report.html"}
    assert "<b>motor</b>" not in page


def test_numbers_that_cannot_be_true_break_no_page(tmp_path):
    for number in range(6):
        made_result(
            tmp_path / str(number),
            name=f"c{number}",
            meta={"date": "0001-01-01" if number else "9999-12-31"},
            levels=[level("a", 1e15, 300.0 * (-1) ** number), level("b", -1e15, -1000.0), level("c", 0.0, 390.0)],
            dominance=[verdict("a", 1e15), verdict("b", -1e15, "gearbox", -5.0), verdict("c", 0.0, "", 7.0)],
            files={"calibration.json": calibration({"x": fitted(1e15, -1e15, 1e15, (-1e15, 1e15))})},
        )
    assert "</html>" in render_html(fleet_report(gathered(tmp_path)))


@pytest.mark.parametrize(
    "href", ["javascript:alert(1)", "//host/x", "/etc/passwd", "http://x", 'a"b', "a b", "", "a\n"]
)
def test_a_link_leads_to_a_relative_path_alone(href):
    with pytest.raises(ReportError, match="a link must be a relative path"):
        Link("x", href)


def test_a_logarithmic_axis_has_no_names():
    with pytest.raises(ReportError, match="has names, it must be linear"):
        Axis("x", scale="log", names=("a",))


def test_one_result_makes_a_page(tmp_path):
    made_result(tmp_path / "a", name="alone", fleet="", levels=[level("60", 60.0, 85.0)])
    page = render_html(fleet_report(gathered(tmp_path)))
    assert "The one measured level at 4 m is 85.0 dB re 20 µPa at 60 km/h." in page


def test_a_result_without_any_number_makes_a_page(tmp_path):
    made_result(tmp_path / "a", name="empty")
    assert "1 measured campaign, 1 fleet." in words(fleet_report(gathered(tmp_path)))


def test_many_results_are_capped_and_the_page_says_so(tmp_path):
    many_results(tmp_path, 450, lines=0, trains=300)
    found = gathered(tmp_path)
    document = fleet_report(found)
    trains = {(r.train, r.origin, r.fleet) for r in found.results}
    assert len(trains) > MOST_ROWS
    matrix = table(document, "dominance-matrix")
    assert len(matrix.rows) == MOST_ROWS
    assert f"Shown are {MOST_ROWS} of {len(trains)} rows" in matrix.caption
    campaigns = table(document, "campaigns")
    assert "Shown are 300 of 450" in campaigns.caption
    for block in blocks_of(document, FigureBlock):
        for element in block.figure.elements:
            assert len(getattr(element, "x", ())) <= 3 * MOST_POINTS
    page = render_html(document)
    assert len(page) < 5_000_000
    assert not re.search(r"\bnan\b", re.sub(r"<script.*?</script>|src=\"[^\"]*\"", "", page, flags=re.DOTALL))
