"""Ports in the test's own process: a world, a selector, and clients that are waited for."""

import socket
import time
from selectors import DefaultSelector
from typing import TypeVar

from miro_sim.scenario.file import live_scenario
from miro_sim.world.world import World
from mirotwin.ports.endpoint import Endpoint, PortContext
from mirotwin.ports.radio_port import RadioPort
from tests.mirotwin.ports.rig import own_image

Port = TypeVar("Port", bound=Endpoint)


class Rig:
    """A world and what is needed to open ports of its radio; `told` is what the user would read."""

    def __init__(self):
        self.world = World(live_scenario("fig6").scenario, 1, own_image())
        self.selector = DefaultSelector()
        self.told = []
        self.context = PortContext(RadioPort(self.world), self.selector, self.told.append)
        self.open = []

    def opened(self, port):
        self.open.append(port)
        return port

    def close(self):
        for port in self.open:
            port.close()
        assert not self.selector.get_map()
        self.selector.close()


def soon(port, wanted):
    """What the port receives until `wanted`, in at most 5 s."""
    got, until_s = b"", time.monotonic() + 5
    while not wanted():
        assert time.monotonic() < until_s, port.client
        got += port.receive()
        port.push()
        time.sleep(0.001)
    return got


def connected(port):
    client = socket.create_connection(("127.0.0.1", int(port.where.rpartition(":")[2])), timeout=5)
    soon(port, lambda: port.client)
    return client
