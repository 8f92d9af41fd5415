"""Makes a board from its description: parts, soldered to their nets, around a processor with its program."""

from __future__ import annotations

from miro_exact.bad_input import BadInput
from miro_exact.plugins import PluginError
from miro_exact.raised import raised
from miro_exact.rng import Stream
from miro_robot.board_spec import BoardSpec
from miro_robot.empty_board import EmptyBoard
from miro_robot.image import Image
from miro_robot.parts.keys import Place
from miro_robot.parts.netlist import Netlist
from miro_robot.parts.own import check_made
from miro_robot.parts.part import Part
from miro_robot.parts.resolve import resolve
from miro_robot.wired_board import WiredBoard


def board_of(
    spec: BoardSpec,
    image: Image,
    seed: int = 0,
    stop_on_fault: bool = True,
    stop_at: tuple[int, ...] = (),
    stop_at_end: bool = False,
) -> EmptyBoard:
    """The board with `image` in its code memory; noise of its parts is made from `seed`. Raises BadInput."""
    stops = (stop_on_fault, stop_at, stop_at_end)
    if not spec.is_wired:
        return EmptyBoard(spec, image, *stops)
    netlist = resolve(spec)
    return WiredBoard(spec, image, netlist, parts_of(spec, netlist, seed), *stops)


def parts_of(spec: BoardSpec, netlist: Netlist, seed: int) -> list[Part]:
    """The parts of a board, in the order of their names, each with those that share a net with it. Raises BadInput."""
    at_cpu = {*netlist.ports, *(net for buffer in netlist.buffers for net in buffer)}
    places = [
        Place(
            name=name,
            crystal_hz=spec.crystal_hz,
            noise=Stream(seed, name),
            connected=frozenset(pin for pin, on in enumerate(pins) if on.net >= 0),
            peers={pin: [] for pin, on in enumerate(pins) if on.net >= 0},
            at_cpu=frozenset(pin for pin, on in enumerate(pins) if on.net >= 0 and on.net in at_cpu),
        )
        for name, pins in zip(spec.parts, netlist.parts, strict=True)
    ]
    parts = [_made(spec, place) for place in places]
    on_net: dict[int, list[tuple[int, int]]] = {}
    for index, pins in enumerate(netlist.parts):
        for pin, on in enumerate(pins):
            on_net.setdefault(on.net, []).append((index, pin))
    for index, place in enumerate(places):
        for pin, peers in place.peers.items():
            net = netlist.parts[index][pin].net
            peers += [(parts[other], number) for other, number in on_net[net] if other != index]
    return parts


def _made(spec: BoardSpec, place: Place) -> Part:
    keys = spec.parts[place.name].keys
    try:
        made = keys.make(place)
    except BadInput:
        raise
    except (Exception, SystemExit) as error:
        reason = f"part {place.name!r} ({keys.name}) cannot be made: {raised(error)}"
        raise PluginError(reason, "repair the part") from error
    return check_made(made, keys, place)
