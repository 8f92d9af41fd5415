"""Wire formats by name: `miro`, `miro:robots=5`, `slip` of a distribution of one's own."""

from __future__ import annotations

import tomllib

import msgspec

from miro_exact.bad_input import BadInput
from miro_host.plugins import PluginError, Registry
from miro_host.raised import raised
from miro_protocol.protocol import Protocol

OPTION = "--protocol"
PROTOCOLS: Registry[Protocol] = Registry(
    "mirotwin.protocols",
    word="protocol",
    key="protocol",
    base="miro_protocol.protocol:Protocol",
    own={"miro": "miro_protocol.miro_wire:Miro"},
)


def protocol_named(text: str) -> Protocol:
    """The protocol that `NAME` or `NAME:KEY=VALUE,KEY=VALUE` means; values as in TOML. Raises BadInput."""
    name, _, parameters = text.partition(":")
    try:
        found = PROTOCOLS.find(name)
    except PluginError as error:
        raise BadInput("", OPTION, error.what, error.remedy) from error
    try:
        given = tomllib.loads(f"given = {{{parameters}}}")["given"]
    except tomllib.TOMLDecodeError:
        form = "write NAME:KEY=VALUE,KEY=VALUE, such as miro:robots=5"
        raise BadInput("", OPTION, f"{parameters!r} are no parameters", form) from None
    try:
        return msgspec.convert(given, found)
    except msgspec.ValidationError as error:
        keys = ", ".join(field.name for field in msgspec.structs.fields(found)) or "no parameters"
        raise BadInput("", OPTION, f"{text}: {error}", f"{name} has {keys}") from None
    except (Exception, SystemExit) as error:  # from the protocol's own check of its parameters
        what = f"{text}: cannot check its parameters: {raised(error)}"
        raise BadInput("", OPTION, what, "repair the protocol") from error
