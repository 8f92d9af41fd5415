"""Shell commands of documents. `mirotwin ..` runs in a fork of this process, which has all modules loaded already;
everything else is given to bash.

A fork costs some milliseconds where a new interpreter costs half a second of loading, and there are a hundred commands.
It has arguments, files, exit code and output as the program has them.
"""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import click

from mirotwin.commands import main
from tests import children

MAY_TAKE_S = 60
SLOW_MAY_TAKE_S = 600
FRESH = ("campaign", "fuzz", "reproduce")
"""Commands that start processes of their own, which begin with the program's file."""
OPTIONAL = ("tshark", "afl-showmap")
"""Programs without which a command is passed over, except in CI (CONTRIBUTING, "Set-up")."""


class Command(NamedTuple):
    """`line` as a shell reads it, `output` as the document shows it, `asked`: the next command is `echo $?`."""

    line: str
    output: str = ""
    asked: bool = False


def commands_of(text):
    """The commands of a block, comment lines left out."""
    lines = text.replace("\\\n", " ").splitlines()
    if not any(line.startswith("$ ") for line in lines):
        yield from (
            Command(line.strip()) for line in lines if line.strip() and not line.strip().startswith("#")
        )
        return
    places = [index for index, line in enumerate(lines) if line.startswith("$ ")]
    for index, after in zip(places, [*places[1:], len(lines)], strict=True):
        asked = after < len(lines) and lines[after] == "$ echo $?"
        yield Command(lines[index][2:].strip(), "\n".join(lines[index + 1 : after]), asked)


def fits(wanted, printed):
    """Whether this is what a document shows: `..` stands for anything, on a line of its own for any lines."""
    pattern = r"\n".join(
        ".*" if line.strip() == ".." else ".*".join(re.escape(part) for part in line.rstrip().split(".."))
        for line in wanted.splitlines()
    )
    plain = "\n".join(line.rstrip() for line in printed.strip().splitlines())
    return re.fullmatch(pattern, plain, re.DOTALL) is not None


class Shell:
    """Runs commands one after the other. `code`: exit code of the last one. `python`: an interpreter with this tree."""

    def __init__(self, programs):
        self.code = 0
        self.python = [str(programs / "python")]
        self.environment = {
            **os.environ,
            "PATH": f"{programs}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
            "COLUMNS": "200",
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTEST_ADDOPTS": "-p no:hypothesispytest",
        }

    def run(self, line):
        """What the command printed, on stdout and stderr."""
        with tempfile.TemporaryFile() as out:
            words = plain(line)
            if (
                line.split()[0] in OPTIONAL
                and shutil.which(line.split()[0]) is None
                and not os.environ.get("CI")
            ):
                return ""
            if words is not None and words[0] == "export":
                self.environment.update(word.split("=", 1) for word in words[1:])
            elif words is not None and words[0] == "mirotwin" and words[1] not in FRESH:
                self.code = self._forked(words[1:], out.fileno())
            else:
                self.code = self._by_bash(line, out)
            out.seek(0)
            return out.read().decode("utf-8", "replace")

    def _by_bash(self, line, out, may_take_s=MAY_TAKE_S):
        bash = children.start(
            ["bash", "-c", line],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
            env=self.environment,
            start_new_session=True,
        )
        try:
            return int(bash.wait(may_take_s))
        except subprocess.TimeoutExpired:
            os.killpg(bash.pid, signal.SIGKILL)
            bash.wait()
            raise

    def _forked(self, arguments, out):
        load_modules()
        sys.stdout.flush()
        sys.stderr.flush()
        process = children.fork()
        if process == 0:
            _become(arguments, out, self.environment)
        return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


class Literal(Shell):
    """Gives every line to bash, with the programs of an environment that something was installed in."""

    def __init__(self, environment):
        self.code = 0
        self.environment = {**environment, "COLUMNS": "200"}

    def run(self, line):
        with tempfile.TemporaryFile() as out:
            self.code = self._by_bash(line, out, SLOW_MAY_TAKE_S)
            out.seek(0)
            return out.read().decode("utf-8", "replace")


@cache
def load_modules():
    """Loads what the forks would load, each for itself."""
    context = click.Context(main)
    for name in main.list_commands(context):
        main.get_command(context, name)
    import_module("mirotwin.report.figure")


def plain(line):
    """The words of a command, None for one that needs a shell."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
    lexer.commenters = "#"
    lexer.whitespace_split = True  # fan.py:Fan is one word
    words = list(lexer)
    return None if any(set(word) <= set("();<>|&") or set(word) & set("*?$`") for word in words) else words


def _become(arguments, out, environment):
    """The rest of a forked process: the program, with its output where it belongs."""
    code = 70
    try:
        signal.alarm(MAY_TAKE_S)
        null = os.open(os.devnull, os.O_RDONLY)
        for number, file in ((0, null), (1, out), (2, out)):
            os.dup2(file, number)
        sys.stdin = open(0, closefd=False)  # noqa: SIM115
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False, buffering=1)  # noqa: SIM115
        os.environ.update(environment)
        sys.argv = ["mirotwin", *arguments]
        main(arguments)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
