"""The page of the steps: its example runs, its tables have every verb, kind and key."""

import re
from pathlib import Path

from miro_sim.world.conditions import CONDITIONS
from mirotwin.verify.steps.keys import SENDS, VERBS, SendFrame, StreamStep
from mirotwin.verify.steps.running import run_test
from tests.mirotwin.verify.steps.rig import own_image

PAGE = (Path(__file__).parents[4] / "mirotwin/verify/steps/README.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (`.*?) \| (.*) \|$", PAGE, re.M)
EVERYWHERE = {"network", "slot", "note", "number"}


def test_the_example_passes(tmp_path):
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, re.S)
    path = tmp_path / "page.scenario.toml"
    path.write_text(example)
    outcome = run_test(str(path), own_image())
    assert (outcome.verdict, outcome.lines) == ("passed", ())


def test_each_verb_has_a_row():
    said = {word for head, _ in ROWS for word in re.findall(r"`(\w+) = ", head)}
    assert set(VERBS) <= said


def test_each_kind_of_event_has_a_row_with_its_keys():
    for name, struct in CONDITIONS.items():
        (row,) = [row for head, row in ROWS if re.search(rf"`{name}`", head)]
        keys = set(struct.__struct_encode_fields__) - EVERYWHERE
        assert keys <= set(re.findall(r"`(\w+)`", row)), name


def test_each_kind_of_frame_is_said_with_its_keys():
    of_frames = set(SendFrame.__struct_encode_fields__)
    for name, struct in SENDS.items():
        (both,) = [f"{head} {row}" for head, row in ROWS if f'"{name}"' in head]
        keys = set(struct.__struct_encode_fields__) - EVERYWHERE - of_frames
        assert keys <= set(re.findall(r"`(\w+)[` =]", both)), name
    assert all(f"`{key}" in PAGE for key in of_frames)
    (row,) = [row for head, row in ROWS if head.startswith("`stream")]
    assert set(StreamStep.__struct_encode_fields__) - {*EVERYWHERE, "stream"} <= set(
        re.findall(r"`(\w+)`", row)
    )
