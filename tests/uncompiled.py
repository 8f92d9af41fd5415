"""The source of a hot module as a module of its own: the twin of what was compiled from it, whichever engine runs."""

import importlib.util
from pathlib import Path


def uncompiled(name):
    installed = importlib.util.find_spec(name)
    source = Path(installed.origin).with_name(f"{name.rpartition('.')[2]}.py")
    spec = importlib.util.spec_from_file_location(f"{name}_from_source", source)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
