"""The ways of docs/maps/ways.md against the source: each step exists, and the step above calls it."""

import ast
import re
from typing import NamedTuple

import pytest

from docs.site.imports import ROOT

PAGE = (ROOT / "docs/maps/ways.md").read_text("utf-8")
STEP = re.compile(r"( *)(?:~(\w+) )?([\w.]+)(?: +([\w/]+\.(?:py|c)))?(?: +# .+)?")


class Step(NamedTuple):
    """`word`: what hands over to it; empty: the step above calls it."""

    depth: int
    word: str
    name: str
    file: str


def steps_of(text):
    """(step, the step above that calls it) for each line; the first has none."""
    above, file = [], ""
    for line in text.splitlines():
        read = STEP.fullmatch(line)
        assert read, f"no step: {line!r}"
        file = read[4] or file
        step = Step(len(read[1]) // 2, read[2] or "", read[3], file)
        assert step.depth <= len(above), f"too far in: {line!r}"
        del above[step.depth :]
        yield step, above[-1] if above else None
        above.append(step)


STEPS = [step for way in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL) for step in steps_of(way)]


def defined(name, file):
    """The source of a function or class, by its dotted name. Raises LookupError."""
    source = (ROOT / file).read_text("utf-8")
    if file.endswith(".c"):
        found = re.search(rf"^[^\n;]*\b{name}\([^;{{]*\{{\n.*?^\}}", source, re.DOTALL | re.MULTILINE)
        if found is None:
            raise LookupError(f"{name} is not in {file}")
        return found[0]
    node = ast.parse(source)
    for part in name.split("."):
        named = [
            one for one in node.body if isinstance(one, ast.FunctionDef | ast.ClassDef) and one.name == part
        ]
        if not named:
            raise LookupError(f"{name} is not in {file}")
        node = named[0]
    return ast.unparse(node)


def calls(step, above):
    """Whether the step above names this one, or the word that hands over."""
    if step.word:
        return all(step.word in (ROOT / one.file).read_text("utf-8") for one in (step, above))
    inner = defined(above.name, above.file).partition("\n")[2]
    return re.search(rf"\b{step.name.rpartition('.')[2]}\b", inner) is not None


@pytest.mark.parametrize(("step", "above"), STEPS, ids=lambda step: step and step.name)
def test_a_step_exists_and_the_one_above_calls_it(step, above):
    assert defined(step.name, step.file)
    assert above is None or calls(step, above), f"{above.name} does not name {step.name}"


def test_steps_that_are_not_so_are_found():
    steps = list(
        steps_of(
            "World.step  sim/miro_sim/world/world.py\n"
            "  World.run_to   # a remark\n"
            "  World.save\n"
            "  ~RI main  robot_fw/firmware/main.c\n"
        )
    )
    assert [calls(step, above) for step, above in steps[1:]] == [True, False, False]
    with pytest.raises(LookupError):
        defined("World.stride", "sim/miro_sim/world/world.py")
    with pytest.raises(LookupError):
        defined("stride", "robot_fw/firmware/main.c")
