"""Throughput of decoder and encoder: `python -m benchmarks.codec`.

One process, one run, CPU time, best of several rounds.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Callable, Iterator

from miro_exact import engine
from miro_protocol.decoder import Decoder
from miro_protocol.frames import TeamFrame, decode_fields, encode

N = 3
CHUNK = 4096
ROUNDS = 5
Job = tuple[str, int, Callable[[], object]]


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


def codec_jobs(size: int) -> Iterator[Job]:
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
    for name, length, job in codec_jobs(size):
        print(f"{name:32} {length / best_time(job) / 1e6:8.1f} MB/s")


if __name__ == "__main__":
    main()
