"""No package that holds state computes with anything whose bits depend on machine, process or time."""

from pathlib import Path

import pytest

from tests.project.determinism_lint import lint

ROOT = Path(__file__).parents[2]
PACKAGES = (
    "exact/miro_exact",
    "protocol/miro_protocol",
    "robot_fw/miro_robot",
    "host/miro_host",
    "sim/miro_sim",
)
"""`mirotwin` is what people see of a run, never what the run is made of."""


# Frames and chips are integers from end to end, so the order of a sum cannot matter.
INTEGERS_ONLY = ("protocol/miro_protocol/", "robot_fw/miro_robot/")

MODULES = sorted(
    path.relative_to(ROOT).as_posix() for package in PACKAGES for path in (ROOT / package).rglob("*.py")
)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_uses_only_operations_that_are_the_same_everywhere(module):
    source = (ROOT / module).read_text(encoding="utf-8")
    found = [f"{module}:{one.line}: {one.message}" for one in lint(source, module.startswith(INTEGERS_ONLY))]
    assert found == []


def test_every_place_on_the_allow_list_exists():
    for place in INTEGERS_ONLY:
        assert (ROOT / place).exists(), place


@pytest.mark.parametrize(
    "bad",
    [
        "import math\ny = math.sin(x)",
        "import math as m\ny = m.exp(x)",
        "import math\ny = math.hypot(x, x)",
        "from math import cos",
        "y = x ** 2",
        "x **= 2",
        "y = 2 ** n",
        "y = pow(x, 0.5)",
        "y = sum(values)",
        "y = a @ b",
        "a @= b",
        "import numpy as np\ny = np.tanh(x)",
        "import numpy\ny = numpy.sum(x)",
        "from numpy import linalg",
        "import time",
        "from time import perf_counter",
        "import random",
        "from datetime import datetime",
        "import os\ny = os.environ",
        "y = hash(name)",
        "y = id(name)",
        "for x in {1, 2}:\n    pass",
        "for x in set(names):\n    pass",
        "seen = set(names)\ny = [n for n in seen]",
        "seen = {n for n in names}\ny = list(seen)",
        "y = ','.join({a, b})",
        "y = [*frozenset(names)]",
        "y = tuple(set(a) | b)",
    ],
)
def test_each_forbidden_thing_is_found(bad):
    assert [one.line for one in lint(bad)] == [bad.count("\n") + 1 if "for x" not in bad else 1]


@pytest.mark.parametrize(
    "good",
    [
        "import math\ny = math.sqrt(x * x) + math.floor(x) + math.pi",
        "y = 2 ** 32",
        "from miro_exact import dmath\ny = dmath.sin(x)",
        "y = sorted(set(names))",
        "y = name in {'a', 'b'}",
        "import numpy as np\ny = np.sqrt(x)",
        "import os.path",
        "@decorator\ndef f(): ...",
    ],
)
def test_what_is_exact_passes(good):
    assert list(lint(good)) == []


def test_a_sum_passes_where_everything_is_an_integer():
    assert list(lint("y = sum(sizes)", integers_only=True)) == []
