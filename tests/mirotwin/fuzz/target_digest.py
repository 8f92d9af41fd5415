"""What a target makes of some inputs: `python -m tests.mirotwin.fuzz.target_digest --engine python`."""

import argparse
import hashlib

from miro_exact import engine

INPUTS = (
    ("bytes", b""),
    ("bytes", b"\x55\x2d\xd4\xff"),
    ("frames", b"\x00\x10\x00\x20\x00"),
    ("session", b"\x00\x10\x00\x20\x80\x03\x01\x02\x03\x04\x0a\x10\x05\x00\x01\x99"),
    ("session", b"\x0c\x09\x01\x00\x01\x0e\x05\x01\x02\x03\x0d\x07\x02\x09\x03\x2d\xd4\x00\x0f\x00\x01\x02"),
)


def lines():
    from miro_robot.firmware import image_path
    from miro_robot.image import load_hex
    from mirotwin.fuzz.target import target_for

    image = load_hex(image_path())
    found = []
    for kind, data in INPUTS:
        target = target_for(image, kind)
        code = target.run(data)
        ram = bytes(map(target.cpu.peek_iram, range(256)))
        sha256 = hashlib.sha256(bytes(target.edges) + ram).hexdigest()
        numbers = (code, target.accepted, target.highest_sp, target.cpu.cycles, target.cpu.instructions)
        found.append(f"{kind} {' '.join(map(str, numbers))} {sha256}")
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--engine", choices=("compiled", "python"), required=True)
    engine.select(parser.parse_args().engine)
    print("\n".join(lines()))


if __name__ == "__main__":
    main()
