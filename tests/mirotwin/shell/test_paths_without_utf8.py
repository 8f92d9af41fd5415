"""Paths are bytes: commands take names that are not UTF-8, and what they write about them is UTF-8 all the same."""

import json
import os
import sys
from xml.etree import ElementTree

import pytest

from miro_robot.firmware import image_path
from tests.mirotwin.conftest import SHORT
from tests.mirotwin.program import mirotwin

ODD = os.fsdecode(b"f\xff")
FAILS = """
scenario = "silent"
duration_s = 0.3
step = [
    { send = "team", left_m_s = 0.2, right_m_s = 0.2 },
    { expect = "wheels", left_m_s = 0.2, within_ms = 0.1 },
]
"""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with an odd name, files with odd names, and two runs in it."""
    folder = tmp_path_factory.mktemp("paths") / ODD
    folder.mkdir()
    (folder / f"{ODD}.toml").write_text(SHORT)
    (folder / f"{ODD}.scenario.toml").write_text(FAILS)
    (folder / f"{ODD}.ihx").write_bytes(image_path().read_bytes())
    for seed in (1, 2):
        out = folder / f"{ODD}{seed}"
        mirotwin.succeeds("run", folder / f"{ODD}.toml", "--seed", seed, "--out", out, "-q", "--no-figure")
    return folder


def test_replay_and_diff_print_json(folder):
    found = json.loads(mirotwin.succeeds("replay", folder / f"{ODD}1", "--json"))
    assert "f\\udcff1" in json.dumps(found).replace("\\\\", "\\")
    code, out, _ = mirotwin("diff", folder / f"{ODD}1", folder / f"{ODD}2", "--json")
    assert (code, json.loads(out)["exit_code"]) == (4, 4)
    firmware = ("--firmware", folder / f"{ODD}.ihx")
    assert json.loads(mirotwin("replay", folder / f"{ODD}1", "--json", *firmware)[1])["exit_code"] == 0


def test_a_failed_test_leaves_its_artifacts_and_junit(folder, tmp_path):
    words = ("--artifacts", folder / f"{ODD}-artifacts", "--junit", tmp_path / f"{ODD}.xml")
    code, out, _ = mirotwin("test", folder / f"{ODD}.scenario.toml", *words)
    assert (code, "1 failed" in out) == (1, True)
    assert any(path.read_text("utf-8") for path in (folder / f"{ODD}-artifacts").rglob("*.txt"))
    assert ElementTree.parse(tmp_path / f"{ODD}.xml").getroot().tag == "testsuites"


def test_a_campaign_its_statistics_and_its_page(folder):
    pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")
    (folder / f"{ODD}-c.toml").write_text('scenario = "fig6"\nseeds = "0-1"\nset = { duration_s = 0.1 }\n')
    results = folder / f"{ODD}.parquet"
    mirotwin.succeeds("campaign", folder / f"{ODD}-c.toml", "--out", results, "--jobs", "1", "-q")
    assert json.loads(mirotwin.succeeds("campaign", "show", results, "--json"))["runs"] == 2
    mirotwin.succeeds("campaign", "show", results)
    mirotwin.succeeds("campaign", "page", results, "--out", folder / f"{ODD}.html")
    assert "<html" in (folder / f"{ODD}.html").read_text("utf-8")


@pytest.mark.parametrize(
    "words",
    [
        ("report", "{}1", "--out", "{}-r.html"),
        ("decode", "{}1", "--json"),
        ("export", "{}1", "--out", "{}-e.stream"),
        ("fw", "profile", "{}1", "--json"),
        ("fw", "trace", "{}1", "--to", "1ms"),
        ("conform", "--rule", "alive", "--firmware", "{}.ihx", "--json"),
    ],
)
def test_a_command_ends_without_an_internal_error(folder, words, monkeypatch):
    monkeypatch.chdir(folder)
    code, _, err = mirotwin(*(word.format(ODD) for word in words))
    assert code in (0, 1, 2, 3), err
    assert "internal error" not in err


def test_a_fuzzing_campaign_leaves_its_summary(folder):
    words = ("--time", "1s", "--jobs", "1", "--out", folder / f"{ODD}-fuzz", "-q")
    code, _, err = mirotwin("fuzz", folder / f"{ODD}.ihx", *words)
    assert code in (0, 1, 2), err
    assert "internal error" not in err
