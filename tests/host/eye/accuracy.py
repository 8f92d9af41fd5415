"""How well the tracker measures painted robots: `python -m tests.host.eye.accuracy 3000`.

Prints, for each pattern, kind of centroid and floor, position and heading errors over that many random postures on the
pitch, all ten pairs of team and identity in turn, with noise: rms, 99.9 %, largest.
"""

import sys

import numpy as np

from miro_host.eye.colours import classes_of
from miro_host.eye.track import Sighting
from tests.host.eye.scenes import FRAME, beside, drawn, errors, tracker
from tests.naive.painted_frame import PAINTS, PaintedFrame, PaintedRobot, sampled

FLOORS = {"green": (15, 60, 35), "grey": (40, 40, 40)}


def measured(count, pattern, centroid):
    """Errors in cm and degrees of the robots that were found, and the number of the lost."""
    colours = classes_of(sampled())
    found, lost = [], 0
    for index in range(count):
        true, team, number = drawn(index), ("yellow", "blue")[index % 2], index // 2 % 5
        one = tracker(team, (number,), pattern=pattern, centroid=centroid, colours=colours)
        near = beside(true, 0.004, -0.003, 0.1)
        one.tracks[0].remember(Sighting(near.x_m, near.y_m, near.theta_rad, 0, 1.0))
        [sighting] = one.track(PaintedFrame([PaintedRobot(true, team, number, pattern)], noise=index), FRAME)
        if sighting is None:
            lost += 1
        else:
            found.append(errors(sighting, true))
    return np.array(found), lost


def main():
    for floor, paint in FLOORS.items():
        PAINTS["floor"] = paint
        for pattern in ("diagonal", "strip"):
            for centroid in ("binary", "weighted"):
                off, lost = measured(int(sys.argv[1]), pattern, centroid)
                rms, most = np.sqrt((off * off).mean(axis=0)), off.max(axis=0)
                nearly = np.quantile(off, 0.999, axis=0)
                print(
                    f"{floor} {pattern} {centroid}: {rms[0]:.3f} {nearly[0]:.3f} {most[0]:.3f} cm,"
                    f" {rms[1]:.2f} {nearly[1]:.2f} {most[1]:.2f} degrees, lost {lost}"
                )


if __name__ == "__main__":
    main()
