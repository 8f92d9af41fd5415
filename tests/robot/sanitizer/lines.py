"""Characters on RXD, for programs on the bare processor."""

BIT, FROM = 2500, 24_000


def receive(cpu, characters):
    """They come one after the other at 9600 baud, from 1 ms on."""
    tick = FROM
    for byte in characters:
        for level in (0, *(byte >> number & 1 for number in range(8)), 1):
            cpu.rxd.append(tick, level)
            tick += BIT
    if characters:
        cpu.rxd.settled_tick = 1 << 60
