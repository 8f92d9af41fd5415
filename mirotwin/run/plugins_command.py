"""`mirotwin plugins`: laws, estimators, references, cameras, protocols, checks and parts that are installed, with their
parameters and where each comes from.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, get_args

import click
import msgspec
from msgspec import inspect as kinds

from miro_exact import installed
from miro_exact.plugins import PluginError, Registry
from miro_host.registries import ESTIMATORS, LAWS, REFERENCES
from miro_protocol.protocol import PROTOCOLS
from miro_sim.scenario.camera_keys import Camera
from miro_sim.scenario.errors import unit_name
from miro_sim.scenario.parts import PARTS
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.console import plain_table
from mirotwin.shell.console import show as print_result
from mirotwin.shell.info_command import version_of
from mirotwin.shell.json_text import print_json
from mirotwin.shell.options import JSON
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.verify.checks.expect import CHECKS

CAMERAS = {str(struct.__struct_config__.tag): struct for struct in get_args(Camera)}
BY_KIND: dict[str, Registry[Any] | None] = {
    "laws": LAWS,
    "estimators": ESTIMATORS,
    "references": REFERENCES,
    "cameras": None,
    "protocols": PROTOCOLS,
    "checks": CHECKS,
    "parts": PARTS,
}
"""Kind to its registry; cameras have none: all are our own."""
_SENTENCE = re.compile(r"(?<=[^A-Z])\.\s")
"""The end of a sentence; not the full stop of an initial."""


class Key(msgspec.Struct):
    """A key of a plug-in's table: type, unit suffix, and default as JSON."""

    key: str
    takes: str
    default: str = ""
    unit: str = ""


class Plugin(msgspec.Struct):
    """Facts about a plug-in. `main`: the key for a bare value. `problem`: why it cannot be used."""

    kind: str
    name: str
    distribution: str
    version: str
    file: str
    about: str
    main: str = ""
    keys: list[Key] = []
    problem: str = ""


class PluginsOptions(Options, frozen=True, kw_only=True):
    COMMAND = "plugins"
    kinds: Annotated[tuple[str, ...], Argument("[KIND..]", click.Choice(tuple(BY_KIND)), several=True)] = ()
    files: PluginFiles = PluginFiles()
    as_json: Annotated[bool, JSON] = False


@command_of(PluginsOptions)
def plugins(options: PluginsOptions) -> None:
    """Lists the installed plug-ins of each KIND: laws, estimators, references, cameras, protocols, checks, parts.

    With KIND also the keys of each, with type and default. A bare value is for the key with a *. The origin of a
    plug-in is its distribution and its file.
    """
    options.files.bring()
    chosen = list(dict.fromkeys(options.kinds or BY_KIND))
    listed = {kind: list(plugins_of(kind)) for kind in chosen}
    if options.as_json:
        print_json({"plugins": [plugin for kind in chosen for plugin in listed[kind]]})
    elif options.kinds:
        print_result(*(line for kind in chosen for plugin in listed[kind] for line in _page(plugin)))
    else:
        for kind in chosen:
            table = plain_table(kind, "what it is", bold=True)
            for plugin in listed[kind]:
                foreign = (
                    f" ({plugin.distribution} {plugin.version})" if plugin.distribution != "mirotwin" else ""
                )
                table.add_row(plugin.name, (plugin.problem or plugin.about) + foreign)
            print_result(table, "")
        print_result("keys of each, and where it comes from: mirotwin plugins KIND, such as laws")


def _page(plugin: Plugin) -> Iterator[Any]:
    yield f"{plugin.name}: {plugin.problem or plugin.about}"
    yield f"    {plugin.distribution} {plugin.version}, {plugin.file}"
    table = plain_table("    key", "takes", "default")
    for key in plugin.keys:
        table.add_row(f"    {key.key}{'*' * (key.key == plugin.main)}", key.takes, key.default)
    if plugin.keys:
        yield table
    yield ""


def plugins_of(kind: str) -> Iterator[Plugin]:
    """All of a kind, in the order of their table; those that cannot be used, too."""
    registry = BY_KIND[kind]
    if registry is None:
        for name, struct in CAMERAS.items():
            yield _described(kind, name, struct)
        return
    for name in registry.names():
        try:
            yield _described(kind, name, registry.find(name))
        except PluginError as error:
            yield Plugin(kind, name, *_origin(kind, name), "", "", problem=f"{error}")


def _described(kind: str, name: str, struct: Any) -> Plugin:
    distribution, version = _origin(kind, name)
    main = str(getattr(struct, "MAIN", ""))
    return Plugin(
        kind, name, distribution, version, file_of(struct), about(struct), main, list(keys_of(struct))
    )


def _origin(kind: str, name: str) -> tuple[str, str]:
    """Distribution and version; of one that the command line brought, its file and class."""
    made_of = installed.described(kind.removesuffix("s"), name).partition(": ")[2]
    if not made_of:
        return "mirotwin", version_of("mirotwin")
    distribution, _, version = made_of.partition(", sources")[0].partition(" ")
    return distribution, version


def file_of(struct: type) -> str:
    """Path of the source, also of a compiled module; "" if there is none."""
    file = getattr(sys.modules.get(struct.__module__), "__file__", None)
    if file is None:
        return ""
    source = Path(file).with_name(Path(file).name.partition(".")[0] + ".py")
    return f"{source if source.exists() else file}"


def head_of(struct: type) -> str:
    """The head of the struct's file."""
    module = sys.modules.get(struct.__module__)
    return inspect.cleandoc(getattr(module, "__doc__", None) or "")


def about(struct: type) -> str:
    """A description in one sentence: from the head of its file, or from its class if the file contains several."""
    module = sys.modules.get(struct.__module__)
    tagged = (
        [member for member in vars(module).values() if _tagged(member, struct)] if module is not None else []
    )
    own = inspect.cleandoc(struct.__doc__ or "")
    text = (own if len(tagged) > 1 else "") or head_of(struct) or own
    sentence = _SENTENCE.split(" ".join(text.partition("\n\n")[0].split()))[0]
    return f"{sentence.rstrip('.')}." if sentence else ""


def _tagged(value: Any, struct: type) -> bool:
    """True for another plug-in class of the same file."""
    config = getattr(value, "__struct_config__", None)
    return isinstance(value, type) and value.__module__ == struct.__module__ and bool(config and config.tag)


def keys_of(struct: type[msgspec.Struct], above: str = "", whole: Any = None) -> Iterator[Key]:
    """The keys of a table, those of tables in it by their paths. `whole`: the table that is the default."""
    for field in kinds.type_info(struct).fields:  # type: ignore[attr-defined]
        key = f"{above}{field.encode_name}"
        default = field.default if whole is None else getattr(whole, field.name)
        if isinstance(field.type, kinds.StructType):
            yield from keys_of(field.type.cls, f"{key}.", None if default is msgspec.NODEFAULT else default)
            continue
        if default is msgspec.NODEFAULT and field.default_factory is not msgspec.NODEFAULT:
            default = field.default_factory()
        shown = "" if default in (msgspec.NODEFAULT, None) else msgspec.json.encode(default).decode()
        yield Key(key, takes(field.type, key), shown, unit_name(key))


def takes(kind: kinds.Type, key: str = "") -> str:
    """The type of a key's value in words: `a number in milliseconds, 0 to 100`."""
    if isinstance(kind, kinds.Metadata):
        return takes(kind.type, key)
    if isinstance(kind, kinds.LiteralType):
        return " or ".join(msgspec.json.encode(value).decode() for value in kind.values)
    if isinstance(kind, kinds.UnionType):
        return " or ".join(dict.fromkeys(takes(option, key) for option in kind.types))
    if isinstance(kind, kinds.IntType | kinds.FloatType):
        word = "a whole number" if isinstance(kind, kinds.IntType) else "a number"
        unit = unit_name(key)
        return f"{word}{' in ' * bool(unit)}{unit}{_range(kind)}"
    words = {kinds.BoolType: "true or false", kinds.StrType: "a string", kinds.NoneType: "nothing"}
    return words.get(type(kind), "a list" if "Tuple" in type(kind).__name__ else "a table")


def _range(kind: kinds.IntType | kinds.FloatType) -> str:
    least = kind.gt if kind.ge is None else kind.ge
    most = kind.lt if kind.le is None else kind.le
    above, below = "above " * (kind.gt is not None), "below " * (kind.lt is not None)
    if least is not None and most is not None:
        return f", {above}{least:.12g} to {below}{most:.12g}"
    if least is not None:
        return f", {above or 'at least '}{least:.12g}"
    return f", {below or 'at most '}{most:.12g}" if most is not None else ""
