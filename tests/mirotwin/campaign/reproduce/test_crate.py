"""A folder for an archive: what describes it, and what it refuses."""

import json

import pytest
from click.testing import CliRunner

from mirotwin.campaign.reproduce.crate import PROFILE, metadata, write_rows
from mirotwin.campaign.reproduce.rows import RunRow
from mirotwin.commands import main

DAY = "2026-11-22"


def called(*arguments):
    return CliRunner().invoke(main, ["reproduce", *map(str, arguments)])


@pytest.fixture
def graph(tmp_path):
    """Entities of a crate of two files, by their name."""
    (tmp_path / "sub").mkdir()
    paths = [tmp_path / "sub" / "b.csv", tmp_path / "a.md"]
    for path in paths:
        path.write_text(path.name, encoding="utf-8")
    found = json.loads(metadata(tmp_path, paths, "0 to 1", DAY))
    assert found["@context"][0] == f"{PROFILE}/context"
    return {entity["@id"]: entity for entity in found["@graph"]}


def test_the_crate_has_the_two_entities_that_version_1_1_requires(graph):
    """RO-Crate 1.1: "RO-Crate Metadata File Descriptor", and "Direct properties of the Root Data Entity"."""
    descriptor, root = graph["ro-crate-metadata.json"], graph["./"]
    assert descriptor["@type"] == "CreativeWork"
    assert descriptor["conformsTo"] == {"@id": PROFILE}
    assert descriptor["about"] == {"@id": "./"}
    assert root["@type"] == "Dataset"
    assert root["datePublished"] == DAY
    assert root.keys() >= {"name", "description", "license"}


def test_each_file_is_a_part_with_its_relative_path_and_each_reference_has_its_entity(graph):
    assert graph["./"]["hasPart"] == [{"@id": "a.md"}, {"@id": "sub/b.csv"}]
    for entity in graph.values():
        for value in entity.values():
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, dict) and not one["@id"].startswith(PROFILE):
                    assert one["@id"] in graph


def test_the_same_files_and_the_same_date_give_the_same_bytes(tmp_path):
    rows = [RunRow("a", "fig6", 1, rms_x_cm=0.5), RunRow("a", "fig6", 2, error="no such thing")]
    for name in ("one.parquet", "two.parquet"):
        write_rows(rows, tmp_path / name)
    assert (tmp_path / "one.parquet").read_bytes() == (tmp_path / "two.parquet").read_bytes()
    path = tmp_path / "one.parquet"
    assert metadata(tmp_path, [path], "1 to 2", DAY) == metadata(tmp_path, [path], "1 to 2", DAY)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--deposit", "full"), "the folder is not empty (mine.txt); choose another one, or replace"),
        (("--deposit", "full/mine.txt"), "exists and is not a folder"),
        (("--deposit", "new", "--out", "full"), "--deposit does not go with --out"),
        (("--date", DAY), "--date needs --deposit"),
        (("--deposit", "new", "--date", "yesterday"), "--date"),
    ],
)
def test_what_cannot_be_a_deposit_is_refused_and_nothing_is_touched(
    tmp_path, monkeypatch, arguments, complaint
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine", encoding="utf-8")
    result = called(*arguments, "--seeds", "4")
    assert result.exit_code == 2
    assert complaint in result.output
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["full", "mine.txt"]
    assert (tmp_path / "full" / "mine.txt").read_text(encoding="utf-8") == "mine"
