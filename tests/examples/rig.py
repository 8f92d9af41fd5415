"""Examples as a user has them: installed by pip into a folder of their own, which programs look modules up in first."""

import os
import shutil
import sys
from pathlib import Path

from tests import children

EXAMPLES = Path(__file__).parents[2] / "examples"
MIROTWIN = Path(sys.executable).with_name("mirotwin")


def installed(name, folder):
    """The folder in which pip leaves the example."""
    source = shutil.copytree(EXAMPLES / name, folder / "source")
    options = ["--quiet", "--no-index", "--no-build-isolation", "--no-deps", "--target", folder / "installed"]
    children.run([sys.executable, "-m", "pip", "install", *options, source], check=True)
    return folder / "installed"


def run(site, *command):
    """Outputs and exit code of a program; `site` comes before another checkout (docs/commands.md)."""
    paths = [str(site), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}
    return children.run([*map(str, command)], env=environment, capture_output=True, text=True)
