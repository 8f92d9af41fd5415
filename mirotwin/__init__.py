"""Mirotwin's Python interface: load firmware and scenarios, run worlds, wait for conditions.

    import mirotwin

    image = mirotwin.load_hex(mirotwin.image_path())
    world = mirotwin.World(mirotwin.load_scenario("fig6").scenario, seed=7, image=image)
    answer = world.run_until(mirotwin.conditions.Answer(), within=mirotwin.ticks(0.2))

The names are those of the stub beside this file. They are loaded on first use: importing this package takes almost no
time, and the program (`entry`) starts at once.
"""

from mirotwin import conform as _conform  # noqa: F401  adds its check, whoever reads a scenario


def names_of_stub(package):
    """The `__getattr__` of a package whose `__init__.pyi` lists its names, one import a line.

    (lazy_loader takes no names of other packages, and needs 5 ms to read a stub.)
    """
    import re
    import sys
    from functools import cache
    from importlib import import_module
    from pathlib import Path

    @cache
    def places():
        text = Path(sys.modules[package].__file__).with_suffix(".pyi").read_text(encoding="utf-8")
        origins = {name: (module, inner) for module, inner, name in re.findall(IMPORTED, text, re.MULTILINE)}
        for name, of, inner in re.findall(SET, text, re.MULTILINE):
            module, submodule = origins[of]
            origins[name] = f"{module.rstrip('.')}.{submodule}", inner
        return {name: origins[name] for name in sorted(origins) if not name.startswith("_")}

    def loaded(name):
        if name == "__all__":
            return list(places())
        if name not in places():
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}; it has {', '.join(places())}"
            )
        module, inner = places()[name]
        if module == ".":
            value = import_module(f".{inner}", package)
        else:
            value = getattr(import_module(module, package), inner, None) or import_module(f"{module}.{inner}")
        setattr(sys.modules[package], name, value)
        return value

    return loaded


IMPORTED = r"^from (\S+) import (\w+) as (\w+)$"
SET = r"^(\w+) = (\w+)\.(\w+)$"
__getattr__ = names_of_stub(__name__)


def __dir__():
    return __getattr__("__all__")
