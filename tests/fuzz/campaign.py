"""A campaign of one target in a process of its own, and what came of it.

build/fuzzing/found/TARGET      inputs that reached something new
build/fuzzing/findings/TARGET   inputs that break the promise, and the report of each
"""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from tests import children
from tests.fuzz import corpus, sanitized
from tests.fuzz.catalogue import TARGETS
from tests.fuzz.sanitized import MissingError as MissingError

ROOT = Path(__file__).parents[2]
WORK = ROOT / "build" / "fuzzing"
HANGS_S, HANGS_SANITIZED_S = 20, 200
MEMORY_MB = 3000
_LIBRARY = ("exact", "protocol", "robot_fw", "host", "sim")
_RATE = re.compile(r"stat::average_exec_per_sec:\s+([0-9]+)")
_EXECUTED = re.compile(r"stat::number_of_executed_units:\s+([0-9]+)")
_COVERAGE = re.compile(r"cov: ([0-9]+) ft: ([0-9]+)")
_WRITTEN = re.compile(r"Test unit written to (\S+)")
_ERROR = re.compile(
    r"^(?:\w+\.)*\w*(?:Error|Exception|Broken)\b.*|^ERROR: .*|^==[0-9]+== ?ERROR.*|.*runtime error: .*", re.M
)


class Result(NamedTuple):
    """`per_s`: of the inputs alone. `reached`: edges and features of libFuzzer, or outcomes. `what`: of a finding."""

    executions: int
    per_s: float
    reached: str
    finding: Path | None = None
    what: str = ""

    def line(self, name):
        rate = f"{self.executions:8d} inputs, {self.per_s:7.0f}/s, {self.reached}"
        if self.finding is None:
            return f"{name:16} {rate}"
        again = f"python -m tests.fuzz {name} --run {os.path.relpath(self.finding, ROOT)}"
        return f"{name:16} {rate}\n{'':16} FOUND {self.what}\n{'':16} {again}"


class Engine(NamedTuple):
    """`guided`: by Atheris. `environment`: what a child gets beside ours. `fixed`: the engine of hot modules, or ""."""

    guided: bool
    environment: dict[str, str]
    about: str
    fixed: str = ""

    def run(self, name, limit_s, seed):
        findings, found = (WORK / part / name for part in ("findings", "found"))
        for path in (findings, found):
            path.mkdir(parents=True, exist_ok=True)
        kept = corpus.FOLDER / name
        task = ["chance", limit_s, seed, findings, kept]
        if self.guided:
            hangs_s = HANGS_SANITIZED_S if self.fixed else HANGS_S
            task = ["guided", *_words(name, limit_s, seed, findings, hangs_s), found, kept]
        child = children.run(
            _command(name, self.fixed or TARGETS[name].engine, *task),
            cwd=ROOT,
            env=child_environment(self.environment),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="backslashreplace",
        )
        return _result(child, limit_s, findings)


def prepared(plain, sanitize):
    """What a campaign runs with. Raises MissingError for tools that are asked for and are not there."""
    installed = importlib.util.find_spec("atheris") is not None
    atheris = installed and not plain
    about = "guided by Atheris" if atheris else "changes by chance"
    if not plain and not atheris:
        about += " (for guidance: pip install -r tests/fuzz/requirements.txt)"
    if not sanitize:
        return Engine(atheris, {}, about)
    build = sanitized.built(WORK / "sanitized", installed)
    return Engine(atheris, build.environment, f"{about}; {build.about}", "compiled")


def _command(name, engine, *task):
    return [sys.executable, "-m", "tests.fuzz.process", name, engine, *map(str, task)]


def child_environment(more):
    """Of this process, with our packages from this checkout unless `more` says from where."""
    own = os.pathsep.join(str(ROOT / part) for part in _LIBRARY)
    paths = [str(ROOT), more.get("PYTHONPATH", own), os.environ.get("PYTHONPATH", "")]
    named = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **more}
    return {**named, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def _words(name, limit_s, seed, findings, hangs_s):
    target = TARGETS[name]
    words = [
        f"-max_total_time={max(1, int(limit_s))}",
        f"-max_len={target.most_bytes}",
        f"-timeout={hangs_s}",
        f"-rss_limit_mb={MEMORY_MB}",
        "-print_final_stats=1",
        f"-artifact_prefix={findings}/",
        f"-seed={seed + 1}",
    ]
    if target.words:
        path = findings.parent / f"{name}.dict"
        quoted = ("".join(f"\\x{byte:02x}" for byte in word) for word in target.words)
        path.write_text("".join(f'"{word}"\n' for word in quoted))
        words.append(f"-dict={path}")
    return words


def _result(child, limit_s, findings):
    text = child.stdout
    executed = _EXECUTED.search(text)
    coverage = _COVERAGE.findall(text)
    if said := re.search(r"^outcomes: ([0-9]+), inputs: ([0-9]+)$", text, re.M):
        return Result(int(said[2]), int(said[2]) / limit_s, f"{said[1]} outcomes")
    reached = "{} edges, {} features".format(*coverage[-1]) if coverage else ""
    executions = int(executed[1]) if executed else 0
    rate = _RATE.search(text)
    per_s = float(rate[1]) if rate else 0.0
    if child.returncode == 0:
        return Result(executions, per_s, reached)
    written = _WRITTEN.findall(text)
    errors = [found.strip() for found in _ERROR.findall(text)]
    path = Path(written[-1]) if written else findings / "last"
    path.with_name(f"{path.name}.txt").write_text(text)
    return Result(executions, per_s, reached, path, errors[0] if errors else text.strip()[-200:])


def once(name, path, sanitize):
    """One input in this process, or in one with the sanitizers; its exit code."""
    environment = prepared(False, True).environment if sanitize else {}
    engine = "compiled" if sanitize else TARGETS[name].engine
    command = _command(name, engine, "once", path)
    return children.run(command, env=child_environment(environment)).returncode


def keep(name):
    """Chooses the kept inputs again from those kept and found ones, in a process of its own; how many."""
    command = _command(name, TARGETS[name].engine, "choose", WORK / "found" / name)
    children.run(command, cwd=ROOT, env=child_environment({}), check=True)
    return len(corpus.kept(name))
