"""No package that holds state computes with anything whose bits depend on machine, process or time."""

import ast
from pathlib import Path

import pytest

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


# fmt: off
# Exact or correctly rounded everywhere; all else in `math` is libm's and differs between machines.
EXACT_MATH = frozenset((
    "pi", "inf", "nan", "sqrt", "floor", "ceil", "trunc", "fabs", "copysign", "fmod", "frexp", "ldexp",
    "isfinite", "isnan", "isinf", "nextafter", "ulp", "gcd", "isqrt", "degrees", "radians",
))
INEXACT_NUMPY = frozenset((
    "sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh", "exp", "exp2",
    "expm1", "log", "log2", "log10", "log1p", "power", "float_power", "cbrt", "hypot", "sum", "nansum",
    "mean", "std", "var", "prod", "cumsum", "trapezoid", "dot", "vdot", "inner", "matmul", "einsum",
    "tensordot", "linalg", "fft", "random", "convolve", "interp", "polyval",
))
FORBIDDEN_MODULES = frozenset((
    "time", "datetime", "random", "secrets", "uuid", "threading", "asyncio", "cmath", "statistics",
))
FORBIDDEN_CALLS = {
    "hash": "hash() of text changes with PYTHONHASHSEED",
    "id": "id() changes from run to run",
    "sum": "sum() over floats hides the order of additions (and compensates since 3.12): write the loop",
    "pow": "pow() of floats is libm's",
}
WALKERS = frozenset((
    "list", "tuple", "enumerate", "iter", "zip", "map", "filter", "next", "dict", "join", "fromkeys",
    "extend",
))
# fmt: on
SET_METHODS = frozenset(["union", "intersection", "difference", "symmetric_difference"])


class Lint(ast.NodeVisitor):
    """Collects (line, what is wrong) of one module; `integers_only` modules may use sum()."""

    def __init__(self, integers_only):
        self.integers_only = integers_only
        self.findings = []
        self.aliases = {}
        self.set_names = set()

    def found(self, node, message):
        self.findings.append((getattr(node, "lineno", 0), message))

    def visit_Import(self, node):
        for name in node.names:
            root = name.name.split(".")[0]
            self.aliases[name.asname or root] = root
            if root in FORBIDDEN_MODULES:
                self.found(node, f"import {name.name}: neither clock, chance nor threads")

    def visit_ImportFrom(self, node):
        root = (node.module or "").split(".")[0]
        if root in FORBIDDEN_MODULES:
            self.found(node, f"from {node.module} import: neither clock, chance nor threads")
        for name in node.names:
            self.check_member(node, root, name.name)

    def check_member(self, node, module, name):
        if module == "math" and name not in EXACT_MATH:
            self.found(node, f"math.{name} is not exact everywhere: use miro_exact.dmath")
        if module == "numpy" and name in INEXACT_NUMPY:
            self.found(node, f"numpy.{name} differs between machines")
        if module == "os" and name in ("environ", "getenv", "urandom"):
            self.found(node, f"os.{name}: state must not come from the environment")

    def visit_Attribute(self, node):
        if isinstance(node.value, ast.Name) and node.value.id in self.aliases:
            self.check_member(node, self.aliases[node.value.id], node.attr)
        self.generic_visit(node)

    def visit_BinOp(self, node):
        self.check_operator(node, node.op, (node.left, node.right))
        self.generic_visit(node)

    def visit_AugAssign(self, node):
        self.check_operator(node, node.op, (node.target, node.value))
        self.generic_visit(node)

    def check_operator(self, node, operator, operands):
        if isinstance(operator, ast.MatMult):
            self.found(node, "@ is BLAS: bits change with threads and core type")
        if isinstance(operator, ast.Pow) and not all(
            isinstance(operand, ast.Constant) and isinstance(operand.value, int) for operand in operands
        ):
            self.found(node, "** of anything but two integer literals: write the product")

    def visit_Call(self, node):
        name = node.func.id if isinstance(node.func, ast.Name) else None
        if name in FORBIDDEN_CALLS and not (name == "sum" and self.integers_only):
            self.found(node, FORBIDDEN_CALLS[name])
        method = node.func.attr if isinstance(node.func, ast.Attribute) else None
        if name in WALKERS or method in WALKERS:
            for argument in node.args:
                self.check_walk(argument)
        self.generic_visit(node)

    def visit_Assign(self, node):
        if self.is_set(node.value):
            self.set_names.update(target.id for target in node.targets if isinstance(target, ast.Name))
        self.generic_visit(node)

    def visit_For(self, node):
        self.check_walk(node.iter)
        self.generic_visit(node)

    def visit_comprehension(self, node):
        self.check_walk(node.iter)
        self.generic_visit(node)

    def visit_Starred(self, node):
        self.check_walk(node.value)
        self.generic_visit(node)

    def check_walk(self, node):
        if self.is_set(node):
            self.found(node, "the order of a set changes from run to run: sorted() it")

    def is_set(self, node):
        if isinstance(node, ast.Set | ast.SetComp):
            return True
        if isinstance(node, ast.Name):
            return node.id in self.set_names
        if isinstance(node, ast.BinOp):
            return self.is_set(node.left) or self.is_set(node.right)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            return node.func.id in ("set", "frozenset")
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            return node.func.attr in SET_METHODS
        return False


def lint(source, integers_only=False):
    """(line, what is wrong) in one module's source, by line."""
    checker = Lint(integers_only)
    checker.visit(ast.parse(source))
    return sorted(checker.findings)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_uses_only_operations_that_are_the_same_everywhere(module):
    source = (ROOT / module).read_text(encoding="utf-8")
    found = [f"{module}:{line}: {what}" for line, what in lint(source, module.startswith(INTEGERS_ONLY))]
    assert found == []


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
    assert [line for line, _ in lint(bad)] == [bad.count("\n") + 1 if "for x" not in bad else 1]


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
    assert lint(good) == []


def test_a_sum_passes_where_everything_is_an_integer():
    assert lint("y = sum(sizes)", integers_only=True) == []
