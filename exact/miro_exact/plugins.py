"""Plug-ins named in a scenario: our own, and those added by other distributions' entry points.

A plug-in is chosen by a frozen `msgspec` struct of its parameters whose tag is the plug-in's name. A distribution adds
one in its `pyproject.toml`:

    [project.entry-points."mirotwin.laws"]
    samson = "samson_law:Parameters"

Two plug-ins of one name are an error that names both, also if one is our own: a run must not depend on the search
order. The command line may bring one in a file, `FILE.py:CLASS`. Files from untrusted sources contain names only.
"""

import importlib.util
import sys
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar

import msgspec

from miro_exact import installed
from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.raised import raised

Plugin = TypeVar("Plugin")


class PluginError(BadInput):
    """A plug-in that cannot be found, loaded or used: `what` and `remedy`."""

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__("", "", reason, remedy)


class Registry(msgspec.Struct, Generic[Plugin], frozen=True, eq=False):
    """Plug-ins of one kind.

    `word`: the kind in messages; with an s, the entry points' group. `key`: the scenario key that names the plug-in.
    `base`: the struct from which all parameter structs derive (`module:class`). `own`: our table, name ->
    `module:class`. `default`: the plug-in of a table without a name, if there is one. `in_files`: brought by the
    command line, by name.
    """

    word: str
    key: str
    base: str
    own: Mapping[str, str]
    default: str | None = None
    in_files: dict[str, type[Plugin]] = {}

    @property
    def group(self) -> str:
        return f"{installed.PREFIX}{self.word}s"

    def names(self) -> list[str]:
        """All names that can be used: our own in the order of the table, then the others sorted."""
        names = {*self.in_files, *(entry.name for entry in installed.entries_of(self.group))}
        return [*self.own, *sorted(names.difference(self.own))]

    def find(self, name: str) -> type[Plugin]:
        """The struct of parameters of the plug-in `name`. Raises PluginError with the reason in one line."""
        if name in self.in_files:
            return self.in_files[name]
        entry = installed_part(self.group, self.word, name, self.own.get(name, ""))
        if entry is None and name in self.own:
            return self._checked(_loaded(self.own[name]), name, self.own[name])
        if entry is None:
            names = self.names()
            own = f"{use_one_of(names)}, or one of your own: --{self.word} FILE.py:CLASS"
            raise PluginError(f"{name!r} is not one of the choices", did_you_mean(name, names, own))
        owner = installed.owner(entry)
        entry_point = f"{entry.value}, from {owner}"
        try:
            loaded = entry.load()
        except (Exception, SystemExit) as error:
            reason = f"{self.word} {name!r} ({entry_point}) cannot be imported: {raised(error)}"
            raise PluginError(reason, f"repair or uninstall {owner}") from error
        return self._checked(loaded, name, entry_point)

    def of_file(self, path: str, name: str, option: str) -> type[Plugin]:
        """The struct `name` of a file in Python, which is run: `option` of the command line named it.

        Raises BadInput, also for a struct with the name of one of our own. An installed one has to give way.
        """
        module, base = module_of(path, option), _loaded(self.base)
        structs = {
            key: value
            for key, value in vars(module).items()
            if isinstance(value, type) and issubclass(value, base) and value is not base
        }
        if name not in structs:
            reason = f"there is no class {name!r} derived from {base.__name__}"
            remedy = did_you_mean(name, list(structs), f"it has {', '.join(structs) or 'none'}")
            raise BadInput(path, option, reason, remedy)
        struct: Any = structs[name]
        tag = struct.__struct_config__.tag
        if tag in self.own:
            reason = f"{self.word} {tag!r} is in mirotwin ({self.own[tag]}), too"
            raise BadInput(path, f"{option} {name}", reason, "give the class another tag")
        return self._checked(struct, tag, f"{path}:{name}")

    def _checked(self, loaded: Any, name: str, entry_point: str) -> type[Plugin]:
        """`loaded` if it is a struct of parameters as this kind of plug-in needs it."""
        found_as = f"{self.word} {name!r} ({entry_point})"
        if not (isinstance(loaded, type) and issubclass(loaded, _loaded(self.base))):
            raise PluginError(f"{found_as} is not a struct of parameters", f"derive it from {self.base}")
        struct: Any = loaded
        config = struct.__struct_config__
        if config.tag != name or config.tag_field != self.key:
            raise PluginError(f"{found_as} has the tag {config.tag!r}", f"give the class tag={name!r}")
        if not (config.frozen and config.forbid_unknown_fields):
            raise PluginError(f"{found_as} can change, or takes unknown keys", "give the class frozen=True")
        return loaded


def installed_part(group: str, word: str, name: str, own: str = "") -> Any:
    """The entry point of this name, None if there is none. Raises PluginError if two plug-ins have it.

    `own`: our own plug-in of this name, if there is one.
    """
    entries = installed.entries_of(group, name)
    places = ([f"mirotwin ({own})"] if own else []) + [installed.place(entry) for entry in entries]
    if len(places) > 1:
        others = " or ".join(installed.owner(entry) for entry in entries)
        reason = f"{word} {name!r} is in {' and in '.join(places)}"
        raise PluginError(reason, f"uninstall {others}, or give one of them another name")
    return entries[0] if entries else None


def module_of(path: str, option: str) -> ModuleType:
    """Runs a file that `option` of the command line names. Raises BadInput.

    Who resolves the file's annotations looks for its module by name: it stays among the modules, under its path where
    another one has the file's name.
    """
    if not Path(path).is_file():
        raise BadInput(path, option, "there is no such file", "give the path of a file in Python")
    stem = Path(path).stem
    spec = importlib.util.spec_from_file_location(path if stem in sys.modules else stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise BadInput(path, option, f"cannot be run: {raised(error)}", "repair it") from error
    return module


def use_one_of(choices: Iterable[str]) -> str:
    """The remedy for a value that is not among `choices`."""
    *others, last = choices
    return f"use {', '.join(others)} or {last}" if others else f"use {last}"


def _loaded(entry_point: str) -> Any:
    """The attribute that `module:attribute` names."""
    module, _, attribute = entry_point.partition(":")
    return getattr(import_module(module), attribute)
