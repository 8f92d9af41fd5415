"""What may be sent to a robot, read aloud: every window of both lengths, one after the other, bit by bit."""

from tests.naive.crc import crc16, pn9

WHITE = pn9(31)
SIZES = {3: 17, 5: 25}


def frames(data):
    """(end, robots, body in clear) of every window that a robot of 3 or of 5 takes for a frame, wherever it begins."""
    found = []
    for robots, size in SIZES.items():
        for start in range(len(data) - size + 1):
            window = data[start : start + size]
            if window[0] != 0x2D or window[1] != 0xD4:
                continue
            clear = bytes(a ^ b for a, b in zip(window[2:], WHITE, strict=False))
            if crc16(bytes([0x10 + robots]) + clear[:-2]) == clear[-2] + 256 * clear[-1]:
                found.append((start + size, robots, clear[:-2]))
    return sorted(found)


def stands(robots, body):
    """Whether a standing robot is left as it is by a frame: all is zero, but for the robot that is pinged."""
    if body[0] >> 6 == 1 and body[1] < robots:
        return not any(body[2:])
    return not any(body[1:])


def fastest(body):
    """Of all wheels, in 1/256 count per sample."""
    if body[0] >> 6 not in (0, 3):
        return 0
    words = [low + 256 * high for low, high in zip(body[1::2], body[2::2], strict=True)]
    return max(abs(word - 65536 if word >= 32768 else word) for word in words)
