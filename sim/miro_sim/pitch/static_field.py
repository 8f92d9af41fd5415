"""What a calibration alone gets wrong: a posture as somebody reads it who sees the patches without any error."""

from __future__ import annotations

from miro_host.eye.calibration import Calibration
from miro_host.eye.camera_parameters import HEIGHT, WIDTH, CameraParameters
from miro_host.eye.lens import Lens
from miro_host.eye.patterns import ROBOT_HEIGHT_M, PatternName
from miro_host.eye.top import Top
from miro_host.posture import Posture


class StaticField:
    """The same error at the same place, every time."""

    NOT_STATE = ("lens", "top")

    def __init__(self, true: CameraParameters, calibration: Calibration, pattern: PatternName) -> None:
        self.lens = Lens(true)
        self.top = Top(pattern, calibration)

    def __repr__(self) -> str:
        return f"StaticField({self.lens!r}, {self.top!r})"

    def read(self, true: Posture) -> Posture:
        """The posture as it is read. Raises ValueError for one whose patches are outside the picture."""
        team_x, team_y, identity_x, identity_y = self.top.places(true.x_m, true.y_m, true.theta_rad)
        pixels = (*self._drawn(team_x, team_y), *self._drawn(identity_x, identity_y))
        return Posture(*self.top.posture(*pixels))

    def _drawn(self, x_m: float, y_m: float) -> tuple[float, float]:
        u, v = self.lens.pixel(x_m, y_m, ROBOT_HEIGHT_M)
        if not (0.0 <= u <= WIDTH and 0.0 <= v <= HEIGHT):
            raise ValueError(f"({x_m:.3f}, {y_m:.3f}) m is outside the picture")
        return u, v
