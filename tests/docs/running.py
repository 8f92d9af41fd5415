"""What runs a block of each language, in the folder that the process stands in."""

import re
import tomllib
from pathlib import Path

from miro_sim.scenario.board_file import board_of_table
from miro_sim.scenario.file import load
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.steps.reading import steps_of
from tests import children
from tests.docs.shell import commands_of, fits

TEST = re.compile(r"^def (test_\w+)\(", re.MULTILINE)
GROUPS = ("laws", "estimators", "references", "checks", "protocols", "parts")
"""Entry points that another distribution may have."""
EXIT_CODE = re.compile(r"exit code (\d+)")


def shell(example):
    """The first command that is refused, or prints something else."""
    return next(refused(example.namespace["__shell__"], example.parsed.text), None)


def refused(where, text):
    """Every command of a block; in one with `$ `, what it prints has to be what stands below it.

    A command whose output is not shown ends with exit code 0, or with the one that a comment after it names.
    """
    for command in commands_of(text):
        if command.line == "echo $?":
            if command.output.strip() != f"{where.code}":
                yield f"the exit code of the command before is {where.code}, not {command.output.strip()}"
            continue
        printed = where.run(command.line)
        wanted = int(found[1]) if (found := EXIT_CODE.search(command.line)) else 0
        if command.output:
            if not fits(command.output, printed):
                yield f"{command.line}\nprinted\n{printed}\nwhere the document has\n{command.output}"
        elif where.code != wanted and not command.asked:
            yield f"{command.line}\nended with exit code {where.code}, not {wanted}:\n{printed}"


def python(example):
    """Executed in the names of the document; tests are collected by pytest."""
    source = example.parsed.text
    names = example.namespace
    if TEST.search(source):
        Path("test_block.py").write_text(names["__given__"] + source, "utf-8")
        shell = names["__shell__"]
        command = [*shell.python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_block.py"]
        done = children.run(command, env=shell.environment, capture_output=True, text=True)
        return done.stdout + done.stderr if done.returncode else None
    exec(compile("\n" * example.parsed.line + source, example.path, "exec"), names)
    return None


def toml(example):
    """Read by the reader of such files."""
    text = example.parsed.text
    found = tomllib.loads(text)
    if "project" in found:
        groups = [name.removeprefix("mirotwin.") for name in found["project"]["entry-points"]]
        return f"no such entry points: {groups}" if set(groups) - set(GROUPS) else None
    if example.parsed.file.endswith(".board.toml") or "board" in found:
        return None  # the commands below read it, with the parts that they bring
    if "crystal_hz" in found:
        board_of_table(found, "block.board.toml")
    elif "seeds" in found:
        from mirotwin import campaign

        campaign.parse(text, "block.toml")
    elif "scenario" in found or isinstance(found.get("network"), list):
        _load_scenario(text)
    else:  # a part of one
        load("fig6", [f"{key}={_inline(value)}" for key, value in _leaves(found)])
    return None


def _load_scenario(text):
    name = "block.scenario.toml"
    Path(name).write_text(text, "utf-8")
    read = load(name)
    expectations_of(read.scenario, name)
    steps_of(read.scenario, name)


def _leaves(table, inside=""):
    """(path, value) of what holds no further table; a part that is chosen by a key is one value."""
    found = []
    for key, value in table.items():
        if isinstance(value, dict) and not {"law", "kind"} & set(value):
            found += _leaves(value, f"{inside}{key}.")
        else:
            found.append((f"{inside}{key}", value))
    return found


def _inline(value):
    import tomli_w

    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_inline(inner)}" for key, inner in value.items()) + "}"
    return tomli_w.dumps({"x": value}).partition("=")[2].strip()


def c(example):
    """Compiled for the 8051."""
    name = example.parsed.file or "block.c"
    Path(name).write_text(example.parsed.text, "utf-8")
    done = children.run(["sdcc", "-mmcs51", name], capture_output=True, text=True)
    return done.stdout + done.stderr if done.returncode else None
