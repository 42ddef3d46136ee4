"""Which campaigns arguments and lists mean, and where their results go."""

import os
from pathlib import Path

import pytest

from tdacoustic.errors import CampaignError, MissingFileError, OutputError
from tdacoustic.workflows.campaign_list import listed_campaigns, output_folders


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Campaigns, a fleet beside one, a folder of something else."""
    for name in ("b", "a", "deep/c", "deep/d"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "campaign.toml").touch()
    (tmp_path / "a" / "fleet.toml").touch()
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "campaigns.txt").write_text("# all of them\n\n  ../b  \n../deep/*\n../a/campaign.toml\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def given(*arguments, **keys):
    return [campaign.given.replace(os.sep, "/") for campaign in listed_campaigns(arguments, **keys)]


def files(*arguments, **keys):
    return [campaign.file.as_posix() for campaign in listed_campaigns(arguments, **keys)]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["b"], ["b/campaign.toml"]),
        (["b", "a"], ["b/campaign.toml", "a/campaign.toml"]),
        (["*"], ["a/campaign.toml", "b/campaign.toml"]),
        (["*/campaign.toml"], ["a/campaign.toml", "b/campaign.toml"]),
        (["**"], ["a/campaign.toml", "b/campaign.toml", "deep/c/campaign.toml", "deep/d/campaign.toml"]),
        (["a/*.toml"], ["a/campaign.toml", "a/fleet.toml"]),  # files are meant, and the fleet will be said to be one
        (["b", "*", "b/../a"], ["b/campaign.toml", "a/campaign.toml"]),
        ([Path("deep/c"), "deep/[d]"], ["deep/c/campaign.toml", "deep/d/campaign.toml"]),
    ],
)
def test_arguments(tree, arguments, expected):
    assert files(*arguments) == expected


def test_a_link_to_a_campaign_is_the_same_campaign(tree):
    try:
        (tree / "link").symlink_to(tree / "a", target_is_directory=True)
    except OSError:
        pytest.skip("no links here")
    assert files("a", "link") == ["a/campaign.toml"]


def test_a_folder_with_signs_of_a_glob_in_its_name(tree):
    (tree / "a").rename(tree / "[a]")
    assert files("[a]") == ["[a]/campaign.toml"]


def test_a_list_is_relative_to_itself(tree):
    found = listed_campaigns(["a"], tree / "notes" / "campaigns.txt")
    assert [campaign.given for campaign in found] == ["a", "../b", "../deep/c", "../deep/d"]
    assert all(campaign.file.samefile(campaign.file.resolve()) for campaign in found)
    assert found[1].file.samefile(tree / "b" / "campaign.toml")


@pytest.mark.parametrize(
    ("argument", "words"),
    [
        ("nowhere", ["nowhere", "no such file or folder"]),
        ("notes", ["notes", "holds no campaign.toml"]),
        ("deep", ["deep: the folder holds no campaign.toml, but there are campaigns below", "'deep/*'"]),
        (".", ["as a/campaign.toml", "'./*'"]),
        ("nothing*", ["nothing*", "finds no campaign"]),
        ("notes/*", ["notes/*", "finds no campaign"]),
    ],
)
def test_an_argument_that_names_no_campaign(tree, argument, words):
    with pytest.raises(MissingFileError) as error:
        listed_campaigns(["a", argument])
    assert all(word in str(error.value) for word in words) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "error", "words"),
    [
        (b"../a\n../x\n", MissingFileError, "list.txt: line 2: ../x: no such file or folder"),
        (b"# nothing\n\n", CampaignError, "list.txt: names no campaign"),
        (b"../a\n\xff\n", CampaignError, "list.txt: is not UTF-8"),
        (b"../a\x1b[2J\n", CampaignError, "list.txt: line 1: has the sign"),
    ],
)
def test_a_wrong_list(tree, content, error, words):
    (tree / "notes" / "list.txt").write_bytes(content)
    with pytest.raises(error) as found:
        listed_campaigns([], tree / "notes" / "list.txt")
    assert words in str(found.value)


def test_a_list_with_a_byte_order_mark_and_lines_of_windows(tree):
    (tree / "notes" / "list.txt").write_bytes(b"\xef\xbb\xbf../a\r\n../b\r\n")
    assert given(list_file=tree / "notes" / "list.txt") == ["../a", "../b"]


def test_results_go_by_the_names_of_folders(tree):
    folders, note = output_folders(listed_campaigns(["a", "deep/c"]), Path("out"))
    assert folders == (Path("out/a"), Path("out/c")) and note is None


def test_results_of_two_folders_of_one_name_go_by_their_paths(tree):
    (tree / "deep" / "A").mkdir()  # one name where a file system does not tell letters apart
    (tree / "deep" / "A" / "campaign.toml").touch()
    folders, note = output_folders(listed_campaigns(["a", "b", "deep/A"]), Path("out"))
    assert folders == (Path("out/a"), Path("out/b"), Path("out/deep/A"))
    assert str(tree) in note


def test_two_campaign_files_in_one_folder(tree):
    (tree / "a" / "night.toml").touch()
    folders, _ = output_folders(listed_campaigns(["a/night.toml", "b", "deep/c", "deep/d/campaign.toml"]), Path("out"))
    assert folders[0] == Path("out/a")
    with pytest.raises(OutputError, match="inside"):
        output_folders(listed_campaigns(["a", "a/night.toml"]), Path("out"))


def test_results_that_would_lie_in_each_other_are_refused(tree):
    (tree / "a" / "b").mkdir()
    (tree / "a" / "b" / "campaign.toml").touch()
    with pytest.raises(OutputError, match=r"a/b would lie inside those of a"):
        output_folders(listed_campaigns(["a", "b", "a/b"]), Path("out"))
