"""The ports of `mirotwin serve`: their options, and opening them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from selectors import BaseSelector
from typing import Annotated

from miro_exact.bad_input import BadInput, shortened
from miro_exact.plugins import use_one_of
from miro_sim.world.wire import Wire
from miro_sim.world.world import World
from mirotwin.ports import endpoint
from mirotwin.ports.endpoint import Endpoint, Tell
from mirotwin.ports.radio_port import RadioPort
from mirotwin.ports.rfc2217 import Rfc2217Endpoint
from mirotwin.ports.sockets import TcpEndpoint
from mirotwin.ports.terminal import PtyEndpoint
from mirotwin.ports.wire_port import WirePort
from mirotwin.shell.command import Option, Options, Word
from mirotwin.shell.options import FORCE

HIGHEST_PORT = 65_535
LONGEST_NUMBER = 5
HERE = "127.0.0.1"


def port_number(word: str) -> tuple[int, int]:
    """NUMBER, or NUMBER@NETWORK; 0 stands for a free port."""
    number, separator, network = word.partition("@")
    plain = _is_number(number) and (not separator or _is_number(network))
    if not plain or int(number) > HIGHEST_PORT:
        raise ValueError(f"{shortened(repr(word))} is no port, such as 7000, or 7000@1 for network 1.")
    return int(number), int(network or 0)


def link(word: str) -> tuple[str, int]:
    """A path, or PATH@NETWORK; "" or @NETWORK for none."""
    path, separator, network = word.rpartition("@")
    return (path, int(network)) if separator and _is_number(network) else (word, 0)


def address(word: str) -> str:
    """An address to listen on. The empty one would be all of the machine's."""
    if not word.strip():
        raise ValueError(f"the address is empty; {HERE} is this machine, 0.0.0.0 is all its addresses.")
    return word


def _at_network(value: tuple[object, int]) -> str:
    port, network = value
    return f"{port}@{network}" if network else f"{port}"


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= LONGEST_NUMBER


PORT = Word("port", port_number, _at_network)


class PortOptions(Options, frozen=True, kw_only=True):
    """The ports to open: links and port numbers, each with its network."""

    pty: Annotated[
        tuple[tuple[str, int], ...],
        Option(
            type=Word("link", link, _at_network),
            metavar="[LINK]",
            alone="",
            help="A pseudo-terminal, and a symbolic link to it. The default where no port is asked for.",
        ),
    ] = ()
    tcp: Annotated[
        tuple[tuple[int, int], ...],
        Option(
            type=PORT,
            metavar="PORT",
            help="TCP with the bytes as they are, `socket://` of pyserial. 0: any free port.",
        ),
    ] = ()
    rfc2217: Annotated[
        tuple[tuple[int, int], ...],
        Option(
            type=PORT,
            metavar="PORT",
            help="TCP with telnet negotiation, `rfc2217://` of pyserial. 0: any free port.",
        ),
    ] = ()
    host: Annotated[
        str, Option(type=Word("address", address), help="Address on which TCP ports are opened.")
    ] = HERE
    force: Annotated[
        bool, FORCE.saying("Replace the files of an earlier session in the folder, and its link.")
    ] = False


@contextmanager
def open_ports(
    options: PortOptions, world: World, selector: BaseSelector, tell: Tell
) -> Iterator[list[Endpoint]]:
    """All of them, or none. Raises BadInput for one that cannot be had."""
    radios = [
        WirePort(world, line.index) if isinstance(line, Wire) else RadioPort(world, line.index)
        for line in world.lines
    ]

    def context(option: str, network: int) -> endpoint.PortContext:
        if network >= len(radios):
            remedy = use_one_of(map(str, range(len(radios))))
            raise BadInput(option, "", f"there is no network {network}", remedy)
        return endpoint.PortContext(radios[network], selector, tell)

    pty = options.pty if options.pty or options.tcp or options.rfc2217 else [("", 0)]
    with ExitStack() as closing:
        endpoints: list[Endpoint] = []

        def add(opened: Endpoint) -> None:
            closing.callback(opened.close)
            endpoints.append(opened)

        for link, network in pty:
            add(PtyEndpoint(context("--pty", network), Path(link) if link else None, options.force))
        for number, network in options.tcp:
            add(TcpEndpoint(context("--tcp", network), options.host, number))
        for number, network in options.rfc2217:
            add(Rfc2217Endpoint(context("--rfc2217", network), options.host, number))
        yield endpoints
