"""This tree beside another commit: processor time and memory of what people wait for, as ratios.

    python -m benchmarks.against COMMIT [--pairs 41] [--only loop,world]

The commit is copied and built once (`against_copy.py`). Each tree has a process of its own that stays alive
(`against_worker.py`); they work in turn, A B B A .., so that whatever else the machine does meets both alike. Times are
processor times, not wall times. A ratio is the other commit's time by this tree's, pair by pair: above 1 this tree is
faster. Given are its median and quartiles. Both trees must end runs alike, or the table says so.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median, quantiles
from typing import NamedTuple

from benchmarks.against_copy import Tree, copy_of, this_tree

WORKER = Path(__file__).with_name("against_worker.py")
SLOW_PAIRS = 11
"""Pairs of whole commands, which take a second each."""
MEMORY_PAIRS = 3
INSTALL_PAIRS = 1
"""Compiling takes minutes, so it is done once, cold."""
NOT_COPIED = shutil.ignore_patterns(
    ".git", ".venv", "build", "runs", "*.so", "*.pyd", "__pycache__", "*.egg-info"
)

COMMAND = """
import sys
sys.meta_path[:] = [f for f in sys.meta_path if not getattr(f, "__module__", "").startswith("__editable__")]
sys.argv[0] = "mirotwin"
from mirotwin.entry import main
sys.exit(main())
"""
GROUPS = ("loop", "teams", "harness", "world", "state", "shell", "install", "memory")
SLOW_SPEED = "speed_m_s = 0.005"  # stays on the pitch for three minutes


class Task(NamedTuple):
    """A line of the table; `unit` is its name and how many of it make a second (or a byte)."""

    group: str
    title: str
    unit: tuple[str, float]
    pairs: int
    measure: Callable[[Side], tuple[float, str]]


class Side:
    """One of the two trees, and its worker, which is started when first asked."""

    def __init__(self, tree: Tree, folder: Path) -> None:
        self.tree = tree
        self.folder = folder
        self.folder.mkdir()
        self._worker: subprocess.Popen[str] | None = None
        self.no_figure = ["--no-figure"] if "--no-figure" in self._output("run", "--help") else []

    def ask(self, task: str) -> tuple[float, str]:
        """Processor seconds of `task` in the worker, and its result."""
        if self._worker is None:
            self._worker = subprocess.Popen(
                [sys.executable, "-P", str(WORKER), str(self.tree.folder)],
                env=self.tree.environment(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            self._answer()
        assert self._worker.stdin is not None
        self._worker.stdin.write(f"{task}\n")
        self._worker.stdin.flush()
        seconds, _, result = self._answer().partition(" ")
        return float(seconds), result

    def _answer(self) -> str:
        assert self._worker is not None
        assert self._worker.stdout is not None
        line = self._worker.stdout.readline().strip()
        if not line:
            sys.exit(f"{self.tree.name}: its process ended; what it wrote is above")
        return line

    def command(self, *arguments: str) -> os.struct_rusage:
        """What `mirotwin ARGUMENTS` used, from start to end."""
        with open(os.devnull, "wb") as nothing:
            line, environment = self._line(*arguments), self.tree.environment()
            child = subprocess.Popen(line, cwd=self.folder, env=environment, stdout=nothing)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            sys.exit(f"{self.tree.name}: mirotwin {' '.join(arguments)}: exit code {child.returncode}")
        return usage

    def processor_s(self, *arguments: str) -> tuple[float, str]:
        usage = self.command(*arguments)
        return usage.ru_utime + usage.ru_stime, ""

    def run(self, *options: str) -> tuple[float, str]:
        """`mirotwin run fig6` from shell to prompt."""
        return self.processor_s("run", "fig6", "--out", str(self.folder / "run"), "--force", "-q", *options)

    def report(self) -> tuple[float, str]:
        """`mirotwin report` of the run that was made last."""
        return self.processor_s("report", str(self.folder / "run"))

    def compile(self) -> tuple[float, str]:
        """Processor seconds of compiling everything, in a copy of the tree that has nothing compiled."""
        copy = Path(tempfile.mkdtemp(dir=self.folder))
        shutil.copytree(self.tree.folder, copy, ignore=NOT_COPIED, dirs_exist_ok=True)
        line = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(line, cwd=copy, capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        shutil.rmtree(copy)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, ""

    def peak_bytes(self, duration_s: int) -> tuple[float, str]:
        """Most memory that a slow run of `duration_s` occupies."""
        scenario = self.folder / f"slow{duration_s}.toml"
        text = self._output("scenarios", "show", "fig6")
        text = text.replace("duration_s = 6.0", f"duration_s = {duration_s}.0", 1)
        scenario.write_text(text.replace("speed_m_s = 0.20", SLOW_SPEED, 1))
        usage = self.command(
            "run", str(scenario), "--out", str(self.folder / "slow"), "--force", "-q", *self.no_figure
        )
        return usage.ru_maxrss * 1024.0, ""

    def _line(self, *arguments: str) -> list[str]:
        return [sys.executable, "-P", "-c", COMMAND, *arguments]

    def _output(self, *arguments: str) -> str:
        line = self._line(*arguments)
        return subprocess.run(
            line, env=self.tree.environment(), stdout=subprocess.PIPE, text=True, check=True
        ).stdout

    def end(self) -> None:
        if self._worker is not None:
            self._worker.communicate()


def tasks(pairs: int) -> list[Task]:
    """The lines of the table."""
    slow, ms, us = min(pairs, SLOW_PAIRS), ("ms", 1e3), ("us", 1e6)
    few, mb, once = min(pairs, MEMORY_PAIRS), ("MB", 1e-6), min(pairs, INSTALL_PAIRS)
    return [
        Task("loop", "fig6 pixels, recorded", ms, pairs, lambda side: side.ask("recorded_pixels")),
        Task("loop", "fig6 pixels, not recorded", ms, pairs, lambda side: side.ask("unrecorded_pixels")),
        Task("loop", "fig6 gaussian, recorded", ms, pairs, lambda side: side.ask("recorded")),
        Task("loop", "fig6 gaussian, not recorded", ms, pairs, lambda side: side.ask("unrecorded")),
        Task("teams", "two_teams pixels, a period", ms, slow, lambda side: side.ask("two_teams")),
        Task("harness", "harness, 8 random bytes", us, pairs, lambda side: side.ask("harness_bytes")),
        Task("harness", "harness, one accepted frame", us, pairs, lambda side: side.ask("harness_frame")),
        Task("world", "World()", ms, pairs, lambda side: side.ask("construction")),
        Task("world", "load_hex of a known image", ms, pairs, lambda side: side.ask("known_image")),
        Task("state", "World.save", us, pairs, lambda side: side.ask("save")),
        Task("state", "World.load, same bytes again", us, pairs, lambda side: side.ask("load")),
        Task("state", "World.load, other bytes", us, pairs, lambda side: side.ask("load_other")),
        Task("state", "Board.snapshot", us, pairs, lambda side: side.ask("board_snapshot")),
        Task("state", "Board.restore, same bytes again", us, pairs, lambda side: side.ask("board_restore")),
        Task("state", "Board.restore, other bytes", us, pairs, lambda side: side.ask("board_restore_other")),
        Task("shell", "mirotwin --help", ms, slow, lambda side: side.processor_s("--help")),
        Task("shell", "mirotwin run fig6", ms, slow, lambda side: side.run()),
        Task("shell", "  with --no-figure, if it has it", ms, slow, lambda side: side.run(*side.no_figure)),
        Task("shell", "mirotwin conform", ms, slow, lambda side: side.processor_s("conform")),
        Task("shell", "mirotwin report of that run", ms, slow, lambda side: side.report()),
        Task("install", "compiling everything", ("s", 1.0), once, lambda side: side.compile()),
        Task("memory", "peak memory of a 6 s run", mb, few, lambda side: side.peak_bytes(6)),
        Task("memory", "peak memory of a 180 s run", mb, few, lambda side: side.peak_bytes(180)),
    ]


def in_pairs(task: Task, other: Side, own: Side) -> tuple[list[tuple[float, float]], bool]:
    """(other, own) of each pair, begun by each side in turn, and whether all results were equal."""
    found, results = [], {}
    for side in (other, own) if task.pairs > 1 else ():  # once for nothing: caches, first imports
        results[task.measure(side)[1]] = True
    for pair in range(task.pairs):
        first, second = (other, own) if pair % 2 == 0 else (own, other)
        values = {first: task.measure(first), second: task.measure(second)}
        found.append((values[other][0], values[own][0]))
        results.update({result: True for _, result in values.values()})
    return found, len(results) == 1


def row(task: Task, found: list[tuple[float, float]], equal: bool) -> str:
    """One line: medians of both, median ratio and its quartiles."""
    unit, scale = task.unit
    ratios = [old / new for old, new in found]
    low, middle, high = quantiles(ratios, method="inclusive") if len(ratios) > 1 else ratios * 3
    old, new = (median(pair[side] for pair in found) * scale for side in (0, 1))
    note = "" if equal else "   results differ"
    return (
        f"{task.title:32}{old:10.4g}{new:10.4g} {unit}{middle:8.2f}   {low:.2f} .. {high:.2f}"
        f"{len(found):6}{note}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("commit", help="what this tree is compared with")
    parser.add_argument("--pairs", type=int, default=41, help="measurements of each side (default 41)")
    parser.add_argument("--only", default="", help=f"groups, by commas: {', '.join(GROUPS)}")
    arguments = parser.parse_args()
    groups = {name for name in arguments.only.split(",") if name}
    chosen = [task for task in tasks(arguments.pairs) if not groups or task.group in groups]
    if not chosen or arguments.pairs < 1:
        parser.error("nothing to measure")
    copy = copy_of(arguments.commit)
    with tempfile.TemporaryDirectory() as folder:
        other, own = Side(copy, Path(folder) / "other"), Side(this_tree(), Path(folder) / "own")
        print(f"{'':32}{copy.name[:9]:>10}{'this tree':>10}       ratio   quartiles    pairs")
        for task in chosen:
            print(row(task, *in_pairs(task, other, own)), flush=True)
        other.end()
        own.end()


if __name__ == "__main__":
    main()
