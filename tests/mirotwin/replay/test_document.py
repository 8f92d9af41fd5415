"""The page of replay and diff: its example runs, and its defaults and keys are those of the program."""

import json
import re
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from mirotwin.commands import main
from mirotwin.recording.compare import KINDS, WITHIN_COUNTS, WITHIN_COUNTS_PER_SAMPLE, WITHIN_TICKS

PAGE = (Path(__file__).parents[3] / "mirotwin/replay/README.md").read_text(encoding="utf-8")


def test_the_example_in_python_prints_what_the_page_says(capsys):
    code = PAGE.split("```python\n")[1].split("```")[0]
    exec(code, {})
    assert capsys.readouterr().out == code.rpartition("# ")[2]


def test_every_rule_and_tolerance_is_there_with_its_default():
    assert tuple(re.findall(r"^\| `(\w+)`(?: \(default\))? \|.*\|.*\|$", PAGE, re.M))[:5] == KINDS
    for option, default in (
        ("--within-ms", WITHIN_TICKS / 24_000),
        ("--within-counts", WITHIN_COUNTS),
        ("--within-counts-per-sample", WITHIN_COUNTS_PER_SAMPLE),
    ):
        found = re.search(rf"`{option}` ([\d.]+)", PAGE)
        assert float(found[1]) == default


@pytest.mark.parametrize("name", ["replay", "diff"])
def test_every_option_on_the_page_is_one_of_the_commands(name):
    context = click.Context(main)
    there = {
        option
        for command in ("replay", "diff", "run")
        for parameter in main.get_command(context, command).params
        for option in parameter.opts
    }
    assert set(re.findall(r"--[a-z][a-z-]+", PAGE)) <= there
    own = {option for parameter in main.get_command(context, name).params for option in parameter.opts}
    assert {"--compare", "--json", "--from", "--to", "--all", "--lines-from", "--sources"} <= own


def run(*arguments):
    return CliRunner().invoke(main, list(map(str, arguments))).stdout


def test_every_key_of_the_json_is_on_the_page(tmp_path):
    for seed in (1, 2):
        out = ("--out", tmp_path / f"{seed}", "-q", "--no-figure")
        run("run", "fig6", "--set", "duration_s=0.1", "--seed", seed, *out)
    first, second = (tmp_path / f"{seed}" / "run.mcap" for seed in (1, 2))
    said = set(re.findall(r"`(\w+)`", PAGE.partition("## The JSON document")[2]))
    for arguments in (("replay", first, "--seed", 2), ("diff", first, second)):
        document = json.loads(run(*arguments, "--json", "--all"))
        assert set(document) <= said
        assert set(document["first"]) <= said
