"""Windows beside the slow twin and the whole picture: `python -m tests.sim.pitch.windows --count 100000`.

Windows are compared with the whole picture in every scene, 200 of them; with the slow twin once a scene.
"""

import argparse
import random
import sys

from tests.sim.pitch.scenes import rig, scene

WINDOWS = 200
"""Of one scene that are compared with the whole picture."""
SCENES = 5
"""With one camera."""


def cut(whole, left, top, width, height):
    """The window of a picture of 320 x 240."""
    lines = [3 * (320 * row + left) for row in range(top, top + height)]
    return b"".join(bytes(whole[at : at + 3 * width]) for at in lines)


def check_rig(draw, windows=WINDOWS):
    """Scenes of one camera. Returns how many windows were compared; raises AssertionError for one that differs."""
    drawn = rig(draw)
    camera, naive = drawn.camera(), drawn.naive()
    for _ in range(SCENES):
        one = scene(draw, drawn.lens)
        one.put(camera)
        assert camera.window(*one.window) == one.drawn_by(naive), (drawn, one)
        whole = camera.window(0, 0, 320, 240)
        for _ in range(windows):
            width, height = draw.randint(1, 48), draw.randint(1, 48)
            left, top = draw.randrange(321 - width), draw.randrange(241 - height)
            found = camera.window(left, top, width, height)
            assert found == cut(whole, left, top, width, height), (drawn, one, left, top, width, height)
    return SCENES * (windows + 1)


def main():
    parser = argparse.ArgumentParser(description="Windows beside the whole picture and the slow twin.")
    parser.add_argument("--count", type=int, default=100_000, help="windows (default 100000)")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    draw = random.Random(args.seed)
    done = 0
    while done < args.count:
        done += check_rig(draw)
        print(f"\r{done} windows equal", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(f"{done} windows: each is that part of the whole picture, and one in {WINDOWS + 1} the slow twin's")


if __name__ == "__main__":
    main()
