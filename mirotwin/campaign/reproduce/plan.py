"""Which runs reproduce the paper: starts, controllers, cameras.

Each group is one controller from one start, over all seeds. The paper compares two controllers from different starts;
here each of them also runs from those of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import msgspec

from miro_host.laws.epsilon_tracking import THEORY as THEORY_GAINS
from miro_sim.scenario.file import source_text
from mirotwin.campaign.design import Level
from mirotwin.campaign.plan import Plan, plan_of_levels
from mirotwin.campaign.worker import Work

PAPER = "paper"
IMPROVED = "improved"
LEARNING = "improved, learning"
ILLUSTRATIVE = "epsilon, illustrative"
THEORY = "epsilon, theory"
RETUNED = "epsilon, retuned"
LINE = "epsilon, line"
EPSILONS = (ILLUSTRATIVE, THEORY, RETUNED, LINE)
RIVALS = (RETUNED, LINE)
"""Sets of gains of the other law that were found for this loop: by one search, and by others for the line alone."""


class Start(msgspec.Struct, frozen=True):
    """A figure of the paper: initial errors of its caption, and its path.

    `proposed`, `other`: scenarios with the gains of the proposed law, and of the other one, on this path.
    """

    figure: int
    x_cm: float
    y_cm: float
    theta_rad: float
    path: str
    proposed: str
    other: str

    @property
    def name(self) -> str:
        """The name of the scenario and of the picture."""
        return f"fig{self.figure}"


STARTS = (
    Start(6, 7.09, 1.72, -0.38, "straight line", "fig6", "fig9"),
    Start(7, 52.58, 16.62, -3.09, "straight line", "fig7", "fig9"),
    Start(8, 11.20, 28.92, -1.31, "curve", "fig8", "fig10"),
    Start(9, 2.43, 3.08, -0.96, "straight line", "fig6", "fig9"),
    Start(10, 2.92, 1.85, 0.56, "curve", "fig8", "fig10"),
)
"""Captions of the paper's Figs. 6 to 10."""

IMPROVED_SETTINGS = (
    "network.robot.controller={law = 'body_frame'}",
    "network.robot.estimator={kind = 'ekf'}",
)
SETTINGS: Mapping[str, tuple[str, ...]] = {
    PAPER: (),
    ILLUSTRATIVE: (),  # those of fig9 and fig10
    THEORY: tuple(
        f"network.robot.controller.{gain}={getattr(THEORY_GAINS, gain)}"
        for gain in ("epsilon_rad", "alpha_per_s", "beta_per_s", "length_m", "sigma", "switching")
    ),
    RETUNED: ("network.robot.controller={law = 'epsilon_tracking'}",),  # the defaults of the law
    LINE: (
        "network.robot.controller={law = 'epsilon_tracking', epsilon_rad = 0.0177, alpha_per_s = 7.36,"
        " length_m = 0.211, beta_per_s = 6.71, layer_sigma_rad2 = 0.0642, max_v_m_s = 0.218, max_w_rad_s = 1.55}",
    ),
    IMPROVED: IMPROVED_SETTINGS,
    LEARNING: (*IMPROVED_SETTINGS, "camera.self_calibration=lines"),
}
"""Settings of each controller; one without gains takes those of the scenario."""
CONTROLLERS = tuple(SETTINGS)
CAMERAS = {"white noise": "camera={kind = 'gaussian'}", "pixels, exact": "camera.calibration=exact"}
"""Other cameras than that of the scenarios, which is `1997`."""
DISTURBANCES = {
    "integration of second order": ("host.integration=adams_bashforth",),
    "words of 8 bits": ("host.word_bits=8",),
    "control noise 5 cm/s, 0.25 rad/s": ("network.control_noise={v_m_s = 0.05, w_rad_s = 0.25}",),
    "control noise 20 cm/s, 1 rad/s": ("network.control_noise={v_m_s = 0.2, w_rad_s = 1.0}",),
}
"""The paper's disturbances 1 and 2 of section V-A, for Figs. 6 to 8. It gives no bounds: these are chosen. All other
runs integrate by Euler's rule, with an error of half a step of a changing acceleration. The second-order run is without
this error. Short words round the integrator's output to 22 mm/s.
"""
INTEGRATION = tuple(DISTURBANCES)[:2]
CONTROL_NOISE = tuple(DISTURBANCES)[2:]
NOISE = "network.robot.estimator={kind = 'ekf', position_noise_m = 0.0081, heading_noise_rad = 0.028}"
"""The filter's parameters for white noise of 2.40 cm and 4.83 degrees (three standard deviations)."""


class RunGroup(msgspec.Struct, frozen=True):
    """One controller from one start under one camera and one disturbance (empty: the scenario's)."""

    start: Start
    controller: str
    camera: str = ""
    disturbance: str = ""

    @property
    def label(self) -> str:
        """The label of the row and the name of its recording: fig7-paper, fig7-improved-white-noise."""
        parts = [self.start.name, self.controller, self.camera, self.disturbance]
        return "-".join(
            part.replace(",", "").replace("/", "-per-").replace(" ", "-") for part in parts if part
        )

    @property
    def recording(self) -> str:
        """The file of its recording."""
        return f"{self.label}.mcap"

    def scenario(self) -> tuple[str, tuple[str, ...]]:
        """The built-in scenario, and the settings in it."""
        start = self.start
        base = start.other if self.controller in EPSILONS else start.proposed
        settings = [
            f"network.robot.start_error_x_cm={start.x_cm}",
            f"network.robot.start_error_y_cm={start.y_cm}",
            f"network.robot.start_error_theta_rad={start.theta_rad}",
        ]
        if self.camera:
            settings.append(CAMERAS[self.camera])
        settings += DISTURBANCES.get(self.disturbance, ())
        settings += SETTINGS[self.controller]
        if self.controller == IMPROVED and self.camera == "white noise":
            settings[-1] = NOISE
        return base, tuple(settings)


LOST = RunGroup(STARTS[1], ILLUSTRATIVE, "white noise")
"""From the start of Fig. 7 this one drives out of the camera's view: a camera that sees everywhere is beside it."""
GROUPS = (
    *(RunGroup(start, controller) for start in STARTS for controller in CONTROLLERS),
    *(
        RunGroup(start, controller, camera)
        for start in STARTS
        for controller in (PAPER, *RIVALS, IMPROVED)
        for camera in CAMERAS
    ),
    LOST,
    *(RunGroup(start, PAPER, "", disturbance) for start in STARTS[:3] for disturbance in DISTURBANCES),
)


def plan_of(seeds: range) -> Plan:
    """All groups with all seeds."""
    levels = []
    for group in GROUPS:
        scenario, settings = group.scenario()
        levels.append(Level(group.label, settings, scenario))
    return plan_of_levels("mirotwin reproduce", levels, seeds)


def recorded(plan: Plan, seeds: Mapping[str, int], place: Callable[[str], str]) -> list[Work]:
    """For each group in `seeds`, its run with that seed, of the whole scenario with its expectations.

    `place(name)`: path of the recording.
    """
    jobs = []
    for index, group in enumerate(GROUPS):
        if group.label in seeds:
            run = index * plan.design.seed_count + seeds[group.label] - plan.design.first_seed
            text, path = source_text(group.scenario()[0]), place(group.recording)
            jobs.append(msgspec.structs.replace(plan.work(run), text=text, recording=path))
    return jobs
