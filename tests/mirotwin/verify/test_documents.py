"""The pages of checks, steps and rules: their tables say what the code says of itself."""

import re
from pathlib import Path

import pytest

from docs.site import tables
from miro_sim.world.conditions import CONDITIONS, Fault
from mirotwin.conform.rules import CHAPTERS, find
from mirotwin.runs.test_file import run_test
from mirotwin.verify.checks.expect import ALWAYS_ON, CHECKS, struct_of
from mirotwin.verify.steps.keys import SENDS, VERBS, SendFrame, StreamStep
from tests.mirotwin.verify.checks.rig import own_image

ROOT = Path(__file__).parents[3]
CHECK_PAGE, STEP_PAGE, RULE_PAGE = (
    (ROOT / name).read_text(encoding="utf-8")
    for name in ("mirotwin/verify/checks/README.md", "mirotwin/verify/steps/README.md", "docs/conformance.md")
)
CHECK_ROWS = {
    name: (kind, parameters, fails)
    for name, kind, parameters, fails in re.findall(
        r"^\* `(\w+)` \((safety|liveness)(.*?)\): (.*(?:\n  .*)*)$", CHECK_PAGE, re.M
    )
}
STEP_ROWS = re.findall(r"^\* (`.*?): (.*(?:\n  .*)*)$", STEP_PAGE, re.M)
EVERYWHERE = {"network", "slot", "note", "number"}


def test_the_table_has_every_check_in_the_order_of_the_registry():
    assert list(CHECK_ROWS) == list(CHECKS.own)
    assert [name for name, row in CHECK_ROWS.items() if "always on" in row[2]] == list(ALWAYS_ON)


@pytest.mark.parametrize("name", CHECKS.own)
def test_a_row_says_kind_parameters_and_defaults(name):
    struct = struct_of(name)
    kind, parameters, _ = CHECK_ROWS[name]
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


def test_the_example_of_steps_passes(tmp_path):
    (example,) = re.findall(r"```toml\n(.*?)```", STEP_PAGE, re.S)
    path = tmp_path / "page.scenario.toml"
    path.write_text(example)
    outcome = run_test(str(path), own_image())
    assert (outcome.verdict, outcome.lines) == ("passed", ())


def test_each_verb_has_a_row():
    said = {word for head, _ in STEP_ROWS for word in re.findall(r"`(\w+) = ", head)}
    assert set(VERBS) <= said


def test_each_kind_of_event_has_a_row_with_its_keys():
    for name, struct in CONDITIONS.items():
        (row,) = [row for head, row in STEP_ROWS if re.search(rf"`{name}`", head)]
        keys = set(struct.__struct_encode_fields__) - EVERYWHERE
        assert keys <= set(re.findall(r"`(\w+)`", row)), name


def test_each_kind_of_frame_is_said_with_its_keys():
    of_frames = set(SendFrame.__struct_encode_fields__) - {"number"}
    for name, struct in SENDS.items():
        (both,) = [f"{head} {row}" for head, row in STEP_ROWS if f'"{name}"' in head]
        keys = set(struct.__struct_encode_fields__) - EVERYWHERE - of_frames
        assert keys <= set(re.findall(r"`(\w+)[` =]", both)), name
    assert all(f"`{key}" in STEP_PAGE for key in of_frames)
    (row,) = [row for head, row in STEP_ROWS if head.startswith("`stream")]
    assert set(StreamStep.__struct_encode_fields__) - {*EVERYWHERE, "stream"} <= set(
        re.findall(r"`(\w+)`", row)
    )


def test_the_page_of_rules_is_filled_with_each_rule_and_its_source():
    filled = tables.filled(RULE_PAGE)
    rows = re.findall(r"^\| (P\d\d) \| (.*?) \| (.*?) \| \[(.*?)\]\((.*?)#(.*?)\) \| ", filled, re.M)
    assert [row[0] for row in rows] == [rule.id for chapter in CHAPTERS for rule in chapter.rules]
    for id, name, text, section, page, anchor in rows:
        rule = find(id)
        assert (name, text.replace("\\|", "|")) == (rule.name, rule.text)
        assert f"{Path(page).relative_to('..')}, {section}" == rule.source
        headings = re.findall(r"^#+ (.*)$", (ROOT / "docs" / page).read_text("utf-8"), re.M)
        assert anchor in {re.sub(r"[^\w-]", "", heading.lower().replace(" ", "-")) for heading in headings}
    assert re.findall(r"^### (.*)$", filled, re.M) == [one.title for one in CHAPTERS]
