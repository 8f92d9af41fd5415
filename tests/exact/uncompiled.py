"""The source of a compiled module, as a second module beside it."""

import importlib.util
from pathlib import Path


def uncompiled(module):
    path = Path(module.__file__).parent / f"{module.__name__.rpartition('.')[2]}.py"
    spec = importlib.util.spec_from_file_location(f"uncompiled_{path.stem}", path)
    source = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(source)
    return source
