"""The page of the checks: its examples run, and its table says what the checks say of themselves."""

import re
from pathlib import Path

import pytest

from miro_sim.scenario.file import parse
from miro_sim.world.conditions import Fault
from mirotwin.verify.checks.expect import ALWAYS_ON, CHECKS, expectations_of, struct_of

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "mirotwin/verify/checks/README.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(\w+)` \| (\w+) \|(.*?)\| (.*) \|$", re.M)
ROWS = {name: (kind, parameters, fails) for name, kind, parameters, fails in ROW.findall(PAGE)}


def test_the_table_has_every_check_in_the_order_of_the_registry():
    assert list(ROWS) == list(CHECKS.own)
    assert [name for name, row in ROWS.items() if "always on" in row[2]] == list(ALWAYS_ON)


@pytest.mark.parametrize("name", CHECKS.own)
def test_a_row_says_kind_parameters_and_defaults(name):
    struct = struct_of(name)
    kind, parameters, _ = ROWS[name]
    assert kind == struct.KIND
    said = dict(re.findall(r"`(\w+)`(?: ([\d.]+))?", parameters))
    assert list(said) == list(struct.__struct_fields__)
    assert struct.MAIN in ("", *list(said)[:1])
    event = {"condition": Fault(), "until_tick": 1} if "condition" in said else {}
    given = {struct.MAIN: "P01" if struct.MAIN == "rule" else 1} if struct.MAIN else event
    made = struct(**given)
    for key, default in said.items():
        assert key == struct.MAIN or not default or float(default) == getattr(made, key)
    if struct.MAIN and said[struct.MAIN]:
        assert float(said[struct.MAIN]) == getattr(struct(), struct.MAIN)


def test_the_example_in_python_runs(capsys):
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    exec(example, {})
    assert "('answers_within_ms', 'passed')" in capsys.readouterr().out


def test_the_example_of_a_scenario_is_read():
    example = re.findall(r"```toml\n(.*?)```", PAGE, re.S)[0]
    for_all, for_one = example.split("[network.robot.expect]")
    robot = '[[network]]\n[[network.robot]]\nreference.kind = "line"\n'
    text = f'name = "x"\nduration_s = 6.0\n{for_all}\n{robot}[network.robot.expect]{for_one}'
    (found,) = expectations_of(parse(text, "x"), "x").values()
    assert [check.name for check in found] == [*ALWAYS_ON, "tracks_within_cm", "settles_within_s"]
