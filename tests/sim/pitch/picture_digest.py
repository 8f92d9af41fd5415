"""SHA-256 over windows of random scenes in one engine: `python -m tests.sim.pitch.picture_digest --engine python`."""

import argparse
import hashlib

from miro_exact import engine


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--engine", choices=("compiled", "python"), required=True)
    parser.add_argument("--scenes", type=int, default=4)
    args = parser.parse_args()
    engine.select(args.engine)
    import random

    from tests.sim.pitch.scenes import rig, scene  # hot modules: not before the engine was chosen

    draw = random.Random(5)
    digest = hashlib.sha256()
    for _ in range(args.scenes):
        drawn = rig(draw)
        one = scene(draw, drawn.lens)
        camera = drawn.camera()
        one.put(camera)
        digest.update(camera.window(*one.window))
    print(digest.hexdigest())


if __name__ == "__main__":
    main()
