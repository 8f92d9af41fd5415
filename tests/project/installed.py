"""What an installed mirotwin has to do on any machine: `python tests/project/installed.py --engine compiled`.

It imports nothing of this tree, so it tries what is installed, on each system alike.
"""

import argparse
import json
import os
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
RUN = ("run", "fig6", "--quiet", "--seed", "7", "--set", "duration_s=0.5")
GOLDEN = "fig6 0.5 s seed 7"
ENGINE_LINE = {"compiled": "compiled (", "python": "python (0 of"}
"""How `mirotwin info` begins what it says of the engine."""


def problems(engine, folder):
    """What is wrong, a line each."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    said = _mirotwin(folder, "--version")
    if said.split()[-1:] != [version]:
        yield f"--version says {said!r}, the tree is {version}"
    lines = [line.split(maxsplit=1) for line in _mirotwin(folder, "info").splitlines()]
    about = {line[0]: line[1] for line in lines if len(line) == 2}
    if about.get("mirotwin") != version:
        yield f"info says mirotwin {about.get('mirotwin')}, the tree is {version}"
    if not about.get("engine", "").startswith(ENGINE_LINE[engine]):
        yield f"the engine is {about.get('engine')}, not {engine}"
    _mirotwin(folder, *RUN, "--out", str(folder / "run"))
    summary = json.loads((folder / "run" / "summary.json").read_text(encoding="utf-8"))
    golden = json.loads((ROOT / "tests" / "vectors" / "digests.json").read_text(encoding="utf-8"))[GOLDEN]
    if summary["digest"] != golden:
        yield f"the digest of {GOLDEN} is {summary['digest']}, not {golden}"
    if summary["engine"] != engine:
        yield f"the run had the engine {summary['engine']}, not {engine}"
    script = (ROOT / "protocol" / "miro_protocol" / "dissector.lua").read_text(encoding="utf-8")
    if not _output(folder, sys.executable, "-m", "miro_protocol.dissector").endswith(script):
        yield "miro_protocol.dissector does not print what is in dissector.lua"


def _mirotwin(folder, *arguments):
    """What the installed program prints. Raises SystemExit where it fails."""
    program = Path(sysconfig.get_path("scripts")) / ("mirotwin.exe" if os.name == "nt" else "mirotwin")
    return _output(folder, str(program), *arguments)


def _output(folder, *command):
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        command,
        cwd=folder,
        env={**environment, "COLUMNS": "200", "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def main(arguments=None):
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--engine", choices=sorted(ENGINE_LINE), required=True, help="the one it has to have")
    engine = parser.parse_args(arguments).engine
    with tempfile.TemporaryDirectory(prefix="mirotwin-installed-") as name:
        found = [*problems(engine, Path(name))]
    for what in found:
        print(what, file=sys.stderr)
    if not found:
        print(f"Python {sys.version.split()[0]}, {sysconfig.get_platform()}: {engine}, the digest is right")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
