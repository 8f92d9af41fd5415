"""The sample project as a stranger's CI has it: `python -m tests.project.sample`.

It is begun outside of any checkout, by an installed wheel, pushed to a bare repository, cloned, and tested by its own
ci.sh on a machine that has git, Python, a C compiler, make, SDCC, and an empty home. The firmware as it is has to be
green; with a mistake it has to be red, and leave reports, cases and a summary. Then the steps of action.yml test a
project without firmware. Compiling takes minutes; with `--smoke` the wheel is built without, and what is installed gets
the compiled modules of this tree.
"""

import argparse
import os
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

from tests import children
from tests.project.clean import PURE, Clean, pure_wheel
from tests.project.lowest import ROOT, copy_tree

MISTAKE = ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15)")
AGAIN = re.compile(r"^    ((?:mirotwin replay|mirotwin test|pytest) .*)  # (.*)$", re.M)
"""What the summary of a failed test prints to run it again."""
PROGRAMS = (
    *("git", "make", "cc", "gcc", "as", "ld", "sdcc", "sdcpp", "sdas8051", "sdld", "packihx"),
    *(
        "sh",
        "bash",
        "cat",
        "cp",
        "cut",
        "env",
        "find",
        "grep",
        "head",
        "ln",
        "ls",
        "mkdir",
        "mv",
        "printf",
        "rm",
        "sed",
    ),
    *("sort", "test", "touch", "tr", "true", "uname"),
)
"""What the machine of the CI has, beside Python."""
REPORTS = ("conform.xml", "pytest.xml", "scenarios.xml")
GIT = ("git", "-c", "user.name=A user", "-c", "user.email=user@example.org", "-c", "init.defaultBranch=main")


class Machine(Clean):
    """A machine of a CI: an empty home, and the programs above. What runs there, runs in `project`."""

    def __init__(self, folder, project):
        super().__init__(folder)
        self.project = project
        self.bin = project / ".venv" / "bin"
        programs = folder / "bin"
        for path in (folder / "home", programs):
            path.mkdir(parents=True)
        for name in PROGRAMS:
            if found := shutil.which(name):
                (programs / name).symlink_to(found)
        (programs / "python3").symlink_to(sys._base_executable)
        own = {key: value for key, value in os.environ.items() if key.startswith(("PIP_", "SSL_"))}
        self.environment = {**own, "HOME": str(folder / "home"), "PATH": str(programs), "LANG": "C.UTF-8"}

    def ci(self, *words, **more):
        """Exit code and output of the project's ci.sh."""
        return self.run("sh", "ci.sh", *words, cwd=self.project, more=more)

    def again(self, text):
        """The exit code of each line in a summary that gives a failure again."""
        found = AGAIN.findall(text)
        path = {"PATH": f"{self.bin}{os.pathsep}{self.environment['PATH']}"}
        return {
            line: self.run("sh", "-c", line, cwd=self.project, more=path)[0]
            for line, _ in dict.fromkeys(found)
        }


def built(folder, smoke):
    """A wheel of this tree; the tree without what git does not track is in `folder`/tree."""
    copy_tree(folder / "tree", ())
    if smoke:
        return pure_wheel(folder / "tree", folder / "dist")
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder), "."]
    children.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def begun(folder, wheel):
    """The project, written by Mirotwin from that wheel, which is in it; and its bare repository."""
    user = Clean(folder / "user")
    user.folder.mkdir()
    user.make()
    user.must("pip", "install", "-q", wheel)
    wheels = user.folder / "mine" / "wheels"
    wheels.mkdir(parents=True)
    shutil.copy2(wheel, wheels)
    user.must("mirotwin", "init", "mine", "--from", f"mine/wheels/{wheel.name}")
    user.must("mirotwin", "init", "--without-firmware", "other")
    project, bare = user.folder / "mine", folder / "mine.git"
    user.must(*GIT, "init", "-q", "--bare", bare)
    user.must(*GIT, "init", "-q", cwd=project)
    user.must(*GIT, "remote", "add", "origin", bare, cwd=project)
    pushed(user, project, "A project")
    return user, project, bare


def pushed(user, project, message):
    for words in (("add", "-A"), ("commit", "-q", "-m", message), ("push", "-q", "origin", "HEAD")):
        user.must(*GIT, *words, cwd=project)


def timed(name, machine, *words, **more):
    begun = time.perf_counter()
    code, out = machine.ci(*words, **more)
    print(f"{name}: exit code {code}, {time.perf_counter() - begun:.1f} s", flush=True)
    return code, out


def tried(machine, user, project):
    """What is wrong with the verdicts, the reports and the summary of ci.sh, a line each."""
    build = machine.project / "build"
    code, out = timed("good firmware", machine)
    summary = (build / "summary.md").read_text("utf-8")
    if code or "passed or skipped" not in summary:
        yield f"the good firmware is red:\n{out}\n{summary}"
    if missing := [name for name in REPORTS if not (build / name).is_file()]:
        yield f"there is no {', '.join(missing)}"

    source = project / "firmware" / MISTAKE[0]
    text = source.read_text(encoding="utf-8")
    assert text.count(MISTAKE[1]) == 1
    source.write_text(text.replace(*MISTAKE[1:]), encoding="utf-8")
    pushed(user, project, "A mistake")
    machine.must("git", "pull", "-q", cwd=machine.project)
    step = machine.folder / "step.md"
    code, out = timed("bad firmware", machine, GITHUB_ACTIONS="true", GITHUB_STEP_SUMMARY=str(step))
    summary = (build / "summary.md").read_text("utf-8")
    print(summary)
    if not code:
        yield f"firmware with a mistake is green:\n{out}"
    if step.read_text("utf-8") != summary:
        yield "GITHUB_STEP_SUMMARY has not what build/summary.md has"
    if not re.search(r"^::error file=firmware/\w+\.c,line=\d+,title=P29 stop::", out, re.M):
        yield f"no annotation names a C line for P29:\n{out}"
    for name in ("P29 stop", "failsafe", "test_it_stops_when"):
        if not re.search(
            rf"^\| {re.escape(name)}.* \|.*firmware/\w+\.c:\d+", summary.replace("\\_", "_"), re.M
        ):
            yield f"the summary names no C line for {name}:\n{summary}"
    if not list((build / "failed").glob("**/*.stream")):
        yield "no case is left"
    lines = machine.again(summary)
    print(f"{len(lines)} lines to reproduce", flush=True)
    yield from (f"exit code {code}, not 1: {line}" for line, code in lines.items() if code != 1)
    if not lines:
        yield f"nothing says how to reproduce it:\n{summary}"

    code, out = timed("no test", machine, "true")
    if code != 2 or "No test ran" not in (build / "summary.md").read_text("utf-8"):
        yield f"where nothing was tested, the exit code is {code}:\n{out}"


def acted(machine, tree, smoke):
    """What is wrong with the steps of action.yml, on a project without firmware."""
    text = (tree / "action.yml").read_text("utf-8")
    (step,) = re.findall(r"- run: (sh .*)", text)
    (hashes,) = re.findall(r"- id: source\n +run: \|\n((?: {8}.*\n)+)", text)
    (command,) = re.findall(r"default: (mirotwin test .*)", text)
    given = {
        "GITHUB_ACTION_PATH": str(tree),
        "MIROTWIN_FROM": str(tree),
        "GITHUB_OUTPUT": str(machine.folder / "out"),
    }
    machine.must("bash", "-euc", hashes, more=given)
    if not re.fullmatch(r"hash=[0-9a-f]{40}\n", (machine.folder / "out").read_text()):
        yield f"the hash of the action is none: {(machine.folder / 'out').read_text()}"
    setup = PURE if smoke else {}
    code, out = machine.run(
        "bash", "-ec", step, cwd=machine.project, more={**given, **setup, "COMMAND": "exit 7"}
    )
    if code != 7:
        yield f"the action does not end as its command does:\n{out}"
    if smoke:
        machine.copy_engines()
    code, out = machine.run("bash", "-ec", step, cwd=machine.project, more={**given, "COMMAND": command})
    summary = (machine.project / "build" / "summary.md").read_text("utf-8")
    if code or "## 2 tests passed" not in summary:
        yield f"the action's command: exit code {code}:\n{out}\n{summary}"


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="take the compiled modules of this tree")
    smoke = parser.parse_args(arguments).smoke
    with tempfile.TemporaryDirectory(prefix="mirotwin-sample-") as name:
        folder = Path(name)
        user, project, bare = begun(folder, built(folder, smoke))
        user.must("git", "clone", "-q", bare, "clone", cwd=folder)
        machine = Machine(folder / "machine", folder / "clone")
        code, out = timed("set up", machine, "setup")
        if code:
            raise SystemExit(out)
        if smoke:
            machine.copy_engines()
        found = [*tried(machine, user, project)]
        found += acted(Machine(folder / "other", user.folder / "other"), folder / "tree", smoke)
    for what in found:
        print(what, file=sys.stderr)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
