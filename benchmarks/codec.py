"""Throughput of the decoder beside other ways to get packets out of bytes: `python -m benchmarks.codec`.

One process, one run, CPU time, best of several rounds; ratios rather than MB/s are what can be compared between
machines. The others do less: pyserial's Packetizer cuts at a terminator, cobs decodes one packet that was cut
out already, crcmod checks one. "Packetizer + cobs + crcmod" is the pipeline a user would build from them.
`cobs` is only needed here (`pip install cobs`); without it its lines are left out.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec

from crcmod import mkCrcFun
from serial.threaded import Packetizer

from miro_exact import engine
from miro_protocol import crc
from miro_protocol.decoder import Decoder
from miro_protocol.frames import TeamFrame, decode_fields, encode

N = 3
CHUNK = 4096
ROUNDS = 5
Job = tuple[str, int, Callable[[], object]]


class Cutter(Packetizer):  # type: ignore[misc]
    """Counts packets; `unpack` makes of one what `cobs` and crcmod can."""

    def __init__(self, unpack: Callable[[bytes], object]) -> None:
        super().__init__()
        self.unpack = unpack
        self.packets = 0

    def handle_packet(self, packet: bytes) -> None:
        self.packets += 1
        self.unpack(packet)


def chunks(data: bytes) -> Iterator[bytes]:
    for start in range(0, len(data), CHUNK):
        yield data[start : start + CHUNK]


def team_frames(count: int) -> list[TeamFrame]:
    draw = random.Random(1)
    pairs = [tuple((draw.randint(-16633, 16633), 0) for _ in range(N)) for _ in range(count)]
    return [TeamFrame(0, number % 64, velocities) for number, velocities in enumerate(pairs)]


def decode(data: bytes, frames: int) -> Callable[[], None]:
    def job() -> None:
        decoder = Decoder(N)
        for chunk in chunks(data):
            decoder.feed(chunk)
        assert decoder.valid == frames, decoder

    return job


def cut(data: bytes, unpack: Callable[[bytes], object], packets: int) -> Callable[[], None]:
    def job() -> None:
        cutter = Cutter(unpack)
        for chunk in chunks(data):
            cutter.data_received(chunk)
        assert cutter.packets == packets

    return job


def own_jobs(size: int) -> Iterator[Job]:
    messages = team_frames(2000)
    wires = [encode(message, N) for message in messages]
    valid = b"".join(wires) * (size // (len(wires) * len(wires[0])))
    yield "decoder, valid frames", len(valid), decode(valid, len(valid) // len(wires[0]))
    for scale in (1, 4):
        garbage = random.Random(2).randbytes(scale * size)
        yield f"decoder, random bytes, {scale} x", len(garbage), decode(garbage, 0)
        worst = b"\x2d\xd4" * (scale * size // 2)
        yield f"decoder, sync repeated, {scale} x", len(worst), decode(worst, 0)
    bodies = [event.body for event in Decoder(N).feed(b"".join(wires))]
    whole = sum(map(len, wires))
    yield "encode", whole, lambda: [encode(message, N) for message in messages]
    yield "decode_fields", whole, lambda: [decode_fields(body, N) for body in bodies]


def other_jobs(size: int) -> Iterator[Job]:
    """The same HDR, payload and CRC, framed as COBS does it, and a plain loop of crcmod."""
    check = mkCrcFun(0x10000 | crc.POLYNOMIAL, initCrc=0, rev=True, xorOut=crc.XOR_OUT)
    wires = [encode(message, N) for message in team_frames(2000)]
    bodies = [event.body + b"\1\2" for event in Decoder(N).feed(b"".join(wires))] * (
        size // (2000 * len(wires[0]))
    )
    carried = len(bodies) * len(wires[0])
    yield "crcmod loop", carried, lambda: [check(body) for body in bodies]
    if find_spec("cobs") is None:
        return
    cobs = import_module("cobs.cobs")
    packed = [cobs.encode(body) for body in bodies]
    data = b"".join(packet + b"\0" for packet in packed)
    yield "pyserial Packetizer", carried, cut(data, len, len(packed))
    yield "cobs.decode loop", carried, lambda: [cobs.decode(packet) for packet in packed]
    both = cut(data, lambda packet: check(cobs.decode(bytes(packet))), len(packed))
    yield "Packetizer + cobs + crcmod", carried, both


def best_time(job: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        job()
        times.append(time.process_time() - begin)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--megabytes", type=int, default=2, help="of input a job [%(default)s]")
    size = parser.parse_args().megabytes * 1_000_000
    engine_name = engine.active()
    print(f"engine {engine_name}, N = {N}; MB are characters on the wire, 23 a frame, chunks of {CHUNK}")
    reference = 0.0
    for jobs in (own_jobs(size), other_jobs(size)):
        for name, length, job in jobs:
            rate = length / best_time(job) / 1e6
            reference = reference or rate
            print(f"{name:32} {rate:8.1f} MB/s  {rate / reference:6.2f} x")


if __name__ == "__main__":
    main()
