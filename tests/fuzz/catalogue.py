"""Which targets there are: those of all files in `targets/`."""

from importlib import import_module
from pathlib import Path

TARGETS = {}
for room in sorted(path.stem for path in (Path(__file__).parent / "targets").glob("*.py")):
    TARGETS |= import_module(f"tests.fuzz.targets.{room}").TARGETS
