"""The rules of "the same bits everywhere" that can be read off the syntax tree of a module."""

import ast
from dataclasses import dataclass, field

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


@dataclass
class Finding:
    line: int
    message: str


@dataclass
class Lint(ast.NodeVisitor):
    """Collects findings of one module; `integers_only` modules may use sum()."""

    integers_only: bool = False
    findings: list[Finding] = field(default_factory=list)
    aliases: dict[str, str] = field(default_factory=dict)
    set_names: set[str] = field(default_factory=set)

    def found(self, node, message):
        self.findings.append(Finding(getattr(node, "lineno", 0), message))

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
    """Findings of one module's source, by line."""
    checker = Lint(integers_only)
    checker.visit(ast.parse(source))
    return iter(sorted(checker.findings, key=lambda finding: finding.line))
