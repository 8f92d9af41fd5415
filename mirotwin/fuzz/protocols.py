"""Wire formats by name, or in a file that the command line names, and their mistakes reported as bad input."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from typing import TypeVar

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.plugins import PluginError
from miro_exact.raised import at_place, defined_at, described, raised, raised_at
from miro_protocol.protocol import PROTOCOLS, Damage, Frame, Protocol
from miro_protocol.toml_text import TomlError, struct_of

T = TypeVar("T")
OPTION = "--protocol"


def protocol_named(text: str) -> Protocol:
    """The protocol that `NAME` or `FILE.py:CLASS` means, with parameters behind it: `:KEY=VALUE,KEY=VALUE`, as in TOML.

    A file is run: `text` must come from the command line. Raises BadInput.
    """
    protocol, name, parameters = _class_in_file(text) or _installed(text)
    try:
        given = tomllib.loads(f"given = {{{parameters}}}")["given"]
    except tomllib.TOMLDecodeError:
        form = "write NAME:KEY=VALUE,KEY=VALUE, such as miro:robots=5"
        raise BadInput("", OPTION, f"{parameters!r} are no parameters", form) from None
    try:
        return struct_of(given, protocol)
    except TomlError as error:
        keys = ", ".join(field.name for field in msgspec.structs.fields(protocol)) or "no parameters"
        raise BadInput("", OPTION, f"{text}: {error.place}: {error.what}", f"{name} has {keys}") from None
    except (Exception, SystemExit) as error:  # from the protocol's own check of its parameters
        reason = f"{text}: cannot check its parameters: {raised(error)}"
        raise BadInput("", OPTION, reason, "repair the protocol") from error


def _installed(text: str) -> tuple[type[Protocol], str, str]:
    """The class, its name and the parameters of `NAME:PARAMETERS`."""
    name, _, parameters = text.partition(":")
    try:
        return PROTOCOLS.find(name), name, parameters
    except PluginError as error:
        raise BadInput("", OPTION, error.what, error.remedy) from error


def _class_in_file(text: str) -> tuple[type[Protocol], str, str] | None:
    """The class, its name and the parameters of `FILE.py:CLASS:PARAMETERS`; None for another text."""
    match = re.match(r"(.+?\.py)(?::([^:]*))?(?::(.*))?$", text, re.DOTALL)
    if match is None:
        return None
    path, name, parameters = match[1], match[2] or "", match[3] or ""
    return PROTOCOLS.of_file(path, name, OPTION), name, parameters


def called(method: Callable[..., object], call: Callable[[], T]) -> T:
    """The result of a protocol's method. Raises BadInput where it fails itself."""
    try:
        return call()
    except (Exception, SystemExit) as error:
        name = method.__name__
        reason = at_place(f"`{name}` failed: {described(error)}", raised_at(error) or defined_at(method))
        raise BadInput("", OPTION, reason, f"let `{name}` do what miro_protocol.protocol says") from error


def shown(part: Frame | Damage) -> str:
    return f"damage ({part.reason})" if isinstance(part, Damage) else f"frame {part.body.hex(' ')}"
