"""README's two commands on a machine that has nothing else: what CI runs, and what the tests then may need."""

import re
import shlex
import sys
import tomllib
from pathlib import Path

import pytest

from tests import children

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
RUN = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]
SKIPS = re.compile(r"""importorskip\(\s*["'](\w+)""")

COLLECT = """
import sys
sys.modules.update(dict.fromkeys({modules}))  # imports fail, as where they are not installed
import pytest
sys.exit(pytest.main(["--collect-only", "-q", "-n", "0", "-p", "no:cacheprovider", "-m", ""]))
"""


def modules_of(extra):
    """What an extra brings, as modules: each of these distributions is called as its module is."""
    names = [re.match(r"[\w-]+(?:\[([\w,]+)\])?", requirement) for requirement in EXTRAS[extra]]
    others = {name for found in names if found[1] for name in found[1].split(",")}
    own = {found[0].replace("-", "_") for found in names if not found[1]}
    return own.union(*map(modules_of, others))


ONLY_DEVELOP = (modules_of("develop") - modules_of("test")) | {"foxglove"}  # foxglove-sdk brings `foxglove`


def of_readme(heading):
    """The one command of a section: the first indented line."""
    section = README.split(f"\n## {heading}", 1)[1].split("\n## ", 1)[0]
    return next(line.strip() for line in section.splitlines() if line.startswith("    "))


@pytest.fixture
def commands(tmp_path):
    """What `.ci/run` takes from README."""
    words = re.findall(r"^time readme '(.*)'$", RUN, re.MULTILINE)
    script = re.search(r"^readme\(\) \{.*?^\}$", RUN, re.MULTILINE | re.DOTALL)[0]
    lines = [f"readme {shlex.quote(word)}" for word in words]
    dry = "\n".join(["set -euo pipefail", script.replace("bash -euc", "printf '%s\\n'"), *lines])
    done = children.run(["bash", "-c", dry], cwd=ROOT, capture_output=True, text=True, check=True)
    return [*map(str.strip, done.stdout.splitlines())]


def test_ci_runs_readmes_two_commands_as_they_stand_there(commands):
    assert commands == [of_readme("Install"), of_readme("Run the tests")]


def test_nothing_is_in_the_environment_before_and_develop_comes_after():
    steps = [
        line for line in RUN.splitlines() if line.startswith(("rm -rf .venv", "time readme '", ".venv/"))
    ]
    assert [step.split()[0] for step in steps[:3]] == ["rm", "time", "time"]
    assert re.match(r"\.venv/bin/pip install .*\[develop\]", steps[3])


def test_each_test_that_needs_develop_is_among_those_that_ci_runs_once_it_is_installed():
    assert "-m 'slow or develop'" in RUN
    unmarked = [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "tests").rglob("test_*.py")
        if ONLY_DEVELOP & {*SKIPS.findall(text := path.read_text(encoding="utf-8"))}
        and not re.search(r"mark\.develop|^pytestmark = .*mark\.slow", text, re.MULTILINE)
    ]
    assert unmarked == []


@pytest.mark.slow
def test_without_what_only_develop_brings_every_test_is_collected_or_skipped():
    code = COLLECT.format(modules=sorted(ONLY_DEVELOP))
    done = children.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
