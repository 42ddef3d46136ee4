"""The table of many campaigns: as CSV, as lines, on a terminal."""

import csv
import io
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from tdacoustic.errors import OutputError
from tdacoustic.tables.writing import csv_rows, csv_text
from tdacoustic.workflows.run_many_table import CampaignRow, check_table, plain_lines, rich_table, write_table
from tdacoustic.workflows.run_many_work import Told

DONE = CampaignRow("c/one", Path("out/one"), Told("done", "One", 3, 2, 0, 15, 1, "", 1.25))
FAILED = CampaignRow("=cmd()", Path("out/x"), Told("failed", "", error="a.h5, b.h5: \x1b[2Jno\nsuch file"))
OPEN = CampaignRow("c/\u202eeno", Path("out/eno"))
ROWS = (DONE, FAILED, OPEN)


def test_the_csv_is_that_of_the_other_tables(tmp_path):
    """Held against `csv_text`, which pandas writes."""
    path = write_table(tmp_path / "new" / "root", ROWS)
    text = path.read_bytes().decode("utf-8")
    columns = text.splitlines()[0].split(",")
    frame = pd.DataFrame([row.cells() for row in ROWS], columns=columns)
    for name in columns:
        if name.startswith(("n_", "steps_")):
            frame[name] = frame[name].astype("Int64")
    assert text == csv_text(frame)
    assert [path.name for path in path.parent.iterdir()] == ["campaigns.csv"]
    read = list(csv.reader(io.StringIO(text)))
    assert read[1] == ["c/one", "One", "out/one", "done", "3", "2", "0", "15", "1", ""]
    assert read[2][0] == "'=cmd()" and read[2][-1] == "a.h5, b.h5:  [2Jno such file"
    assert read[3][3:] == ["open", "", "", "", "", "", ""]


def test_rows_without_pandas():
    assert csv_rows(["a", "b"], [["x,y", 1], ['"', None]]) == 'a,b\n"x,y",1\n"""",\n'


def test_a_table_that_is_there_is_replaced_if_it_is_ours(tmp_path):
    check_table(tmp_path / "nowhere", overwrite=False)
    write_table(tmp_path, ROWS)
    check_table(tmp_path, overwrite=False)
    (tmp_path / "campaigns.csv").write_text("campaign;name\n")
    with pytest.raises(OutputError, match="in the way"):
        check_table(tmp_path, overwrite=False)
    check_table(tmp_path, overwrite=True)


def test_a_table_that_cannot_be_written(tmp_path):
    (tmp_path / "campaigns.csv").mkdir()
    with pytest.raises(OutputError, match=r"campaigns\.csv"):
        write_table(tmp_path, ROWS)
    assert [path.name for path in tmp_path.iterdir()] == ["campaigns.csv"]


def test_lines_for_a_pipe():
    head, done, failed, _ = plain_lines(ROWS)
    assert head.split() == ["campaign", "status", "runs", "problems", "computed", "found", "s"]
    assert done.split() == ["c/one", "done", "3", "0", "15", "1", "1.2"]
    assert len({line.index(word) for line, word in ((head, "status"), (done, "done"), (failed, "failed"))}) == 1


def test_a_table_for_a_terminal_that_nothing_steers():
    screen = Console(file=io.StringIO(), force_terminal=True, width=60, color_system=None)
    screen.print(rich_table(ROWS, lambda text: text.replace("\u202e", "?")))
    text = screen.file.getvalue()
    assert "c/one" in text and "failed" in text and "\u202e" not in text
