"""A target for tests of engines, without a robot: it fails for an input that begins with FZ."""

from mirotwin.fuzz.target import TargetFailure


class Toy:
    """Edge 0 for each input, 1 for an F in front, 2 once for each byte. A failure for FZ, by the byte behind it."""

    input = "bytes"
    map_size = 64

    def __init__(self):
        self.executions = 0
        self.failure = None
        self.edges = bytearray(self.map_size)

    def use_map(self, edges):
        self.edges = edges

    def run(self, data):
        self.executions += 1
        self.edges[0] = 1
        self.edges[1] = int(data[:1] == b"F")
        self.edges[2] = len(data) & 0xFF
        self.failure = None
        if data[:2] == b"FZ":
            pc = data[2] if len(data) > 2 else 0
            self.failure = TargetFailure("no_fault", 1, pc, "FZ")
        return int(self.failure is not None)


def toy(spec):
    """For `TargetSpec.maker`."""
    if spec.parameters.get("broken"):
        raise ValueError("the toy is broken")
    return Toy()
