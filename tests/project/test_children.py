"""Tests start other programs through `tests.children` alone, and so with the default action of signals."""

import ast
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests import children

TESTS = Path(__file__).parents[1]
STARTERS = {
    "subprocess": {"run", "Popen", "call", "check_call", "check_output", "getoutput", "getstatusoutput"},
    "os": {"system", "popen", "fork", "forkpty", "posix_spawn", "posix_spawnp"},
    "pty": {"fork", "spawn"},
    "multiprocessing": {"Process", "Pool", "get_context"},
}
POOL = "ProcessPoolExecutor"
SHOW = "import signal; print([signal.getsignal(n) == signal.SIG_IGN for n in (signal.SIGINT, signal.SIGHUP)])"


def starts(source):
    """Lines of `source` that start a process otherwise than through `tests.children`."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            names = {alias.name for alias in node.names}
            if names & STARTERS.get(node.module or "", set()):
                found.append(node.lineno)
        if not isinstance(node, ast.Call):
            continue
        called = node.func
        if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
            name = called.attr
            wrong = name in STARTERS.get(called.value.id, set()) or name.startswith(("spawn", "exec")) & (
                called.value.id == "os"
            )
        else:
            name = getattr(called, "id", "")
            wrong = False
        if name == POOL:
            given = {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}
            wrong = given.get("initializer") != "children.reset_signals"
        if wrong:
            found.append(node.lineno)
    return found


@pytest.mark.slow
def test_no_test_starts_a_process_otherwise():
    found = [
        f"{path.relative_to(TESTS.parent)}:{line}"
        for path in sorted(TESTS.rglob("*.py"))
        if path not in (TESTS / "children.py", TESTS / "project" / "installed.py", Path(__file__))
        for line in starts(path.read_text(encoding="utf-8"))
    ]
    assert found == [], "use tests.children.run or .start"


@pytest.mark.parametrize(
    "line",
    [
        "subprocess.run(['true'])",
        "with subprocess.Popen(['true']): pass",
        "from subprocess import check_output",
        "os.system('true')",
        "os.execv('true', [])",
        "multiprocessing.Process(target=print).start()",
        "ProcessPoolExecutor(2)",
        "futures.ProcessPoolExecutor(2, initializer=print)",
    ],
)
def test_every_way_to_start_a_process_is_found(line):
    assert starts(line) == [1]


def test_the_helper_itself_is_no_finding():
    assert starts("children.run(['true'])\nProcessPoolExecutor(2, initializer=children.reset_signals)") == []


@pytest.mark.skipif(os.name != "posix", reason="signals that are ignored are inherited on POSIX only")
def test_a_child_has_default_signals_where_the_tests_ignore_them():
    before = [signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)]
    try:
        plain = subprocess.run([sys.executable, "-c", SHOW], capture_output=True, text=True, check=True)
        ours = children.run([sys.executable, "-c", SHOW], capture_output=True, text=True, check=True)
        with children.start([sys.executable, "-c", SHOW], stdout=subprocess.PIPE, text=True) as child:
            started = child.communicate()[0]
    finally:
        for number, handler in zip((signal.SIGINT, signal.SIGHUP), before, strict=True):
            signal.signal(number, handler)
    assert plain.stdout == "[True, True]\n"
    assert ours.stdout == started == "[False, False]\n"


@pytest.mark.skipif(os.name != "posix", reason="preexec_fn is of POSIX")
def test_what_a_test_prepares_in_its_child_is_done_too(tmp_path):
    children.run(["true"], check=True, preexec_fn=(tmp_path / "there").touch)
    assert (tmp_path / "there").exists()
