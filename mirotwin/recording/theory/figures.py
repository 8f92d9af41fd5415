"""Figures of the paper's theory for a run: the `theory` part of `summary.json` and a line on the screen."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence

import msgspec

from miro_exact.bad_input import amount
from miro_exact.clock import CONTROL_PERIOD_TICKS, seconds
from miro_host.laws.yang_kim import Gains as PaperGains
from miro_sim.periods import RobotId
from miro_sim.scenario.keys import Scenario
from mirotwin.recording.theory.track import PERIOD_S, Broken, TheoryTrack


class SlidingGains(msgspec.Struct, frozen=True):
    """P_1 in m/s2 and P_2 in rad/s2 of a robot's law; None where it has no such gain.

    `layer_*`: the widths of the boundary layers of s_1 and s_2; None where sgn switches without one.
    """

    p1_m_s2: float | None = None
    p2_rad_s2: float | None = None
    layer_s1_m_s: float | None = None
    layer_s2_rad_s: float | None = None


class DisturbanceFigures(msgspec.Struct, frozen=True):
    """f of equation (15) over the run's control periods, against the gains of condition (17).

    `*_above_*`: the share of the periods in which |f_i| is greater than P_i, and greater than the authority, the part
    of P_i that is active inside the boundary layer: P_i |sat(s_i / layer_i)|, with s_i as computed by the law. None for
    a law without P_i.
    """

    f1_rms_m_s2: float
    f1_largest_m_s2: float
    f2_rms_rad_s2: float
    f2_largest_rad_s2: float
    p1_m_s2: float | None
    p2_rad_s2: float | None
    f1_above_p1: float | None
    f2_above_p2: float | None
    f1_above_authority: float | None
    f2_above_authority: float | None


class Assumption(msgspec.Struct, frozen=True):
    """For how long an assumption was broken, and when first and last."""

    broken_s: float
    first_s: float | None
    last_s: float | None


class Assumption1(Assumption, frozen=True):
    """phi_c, theta_c, phi_r or theta_r, followed without jumps, was outside of (-pi, pi]; `seams`: passages of pi."""

    seams: int


class Assumption2(Assumption, frozen=True):
    """rho_c was within 2.40 cm, or rho_r was 0, after the start; the least rho_c in cm."""

    nearest_cm: float | None


class Assumption3(Assumption, frozen=True):
    """The heading was within 0.1 rad of across, in how many frames; the least distance; crossings of it."""

    frames: int
    nearest_rad: float
    crossings: int


class Theory(msgspec.Struct, frozen=True):
    """Figures of one robot, from the true state (unknown to a host) at the exposures; times are whole control periods.

    `reversals`: changes between forward and backward; `backward_s`: time with v < -1 cm/s. `chattering_m_s2`:
    back-and-forth motion of the commanded wheel speeds within a third of a second; `effort_m_s2`: the mean size of a
    wheel's commanded acceleration (both: `chattering`).
    """

    disturbance: DisturbanceFigures | None
    assumption_1: Assumption1
    assumption_2: Assumption2
    assumption_3: Assumption3
    reversals: int
    backward_s: float
    chattering_m_s2: float | None
    effort_m_s2: float | None


def gains_of(scenario: Scenario) -> Mapping[RobotId, SlidingGains]:
    """The gains of each robot that the paper's law steers, by network and slot: other laws have other surfaces."""
    return {
        (index, robot.slot): _gains(robot.controller)
        for index, network in enumerate(scenario.networks)
        for robot in network.robot
    }


def _gains(controller: object) -> SlidingGains:
    if not isinstance(controller, PaperGains):
        return SlidingGains()
    if controller.switching == "sign":
        return SlidingGains(controller.p1_m_s2, controller.p2_rad_s2)
    layers = controller.layer_s1_m_s, controller.layer_s2_rad_s
    return SlidingGains(controller.p1_m_s2, controller.p2_rad_s2, *layers)


def theory_of(track: TheoryTrack, gains: SlidingGains) -> Theory | None:
    """The figures of one robot; None where no host steered it."""
    if not track.chattering.commands:
        return None
    return Theory(
        disturbance=_disturbance(track, gains),
        assumption_1=Assumption1(*_when(track.ranges), track.seams),
        assumption_2=Assumption2(*_when(track.origin), 100.0 * track.nearest_m if track.f1_m_s2 else None),
        assumption_3=Assumption3(
            *_when(track.perpendicular), track.perpendicular.count, track.nearest_rad, track.crossings
        ),
        reversals=track.reversals,
        backward_s=_time_s(track.backward),
        chattering_m_s2=track.chattering.index(PERIOD_S),
        effort_m_s2=track.chattering.effort(PERIOD_S),
    )


def _time_s(periods: int) -> float:
    return seconds(CONTROL_PERIOD_TICKS * periods)


def _when(broken: Broken) -> tuple[float, float | None, float | None]:
    if not broken.count:
        return 0.0, None, None
    return _time_s(broken.count), seconds(broken.first_tick), seconds(broken.last_tick)


def _disturbance(track: TheoryTrack, gains: SlidingGains) -> DisturbanceFigures | None:
    if not track.f1_m_s2:
        return None
    return DisturbanceFigures(
        *_sizes(track.f1_m_s2),
        *_sizes(track.f2_rad_s2),
        gains.p1_m_s2,
        gains.p2_rad_s2,
        _share_above(track.f1_m_s2, gains.p1_m_s2),
        _share_above(track.f2_rad_s2, gains.p2_rad_s2),
        _share_above_authority(track.f1_m_s2, track.s1_m_s, gains.p1_m_s2, gains.layer_s1_m_s),
        _share_above_authority(track.f2_rad_s2, track.s2_rad_s, gains.p2_rad_s2, gains.layer_s2_rad_s),
    )


def rms(values: Sequence[float]) -> float:
    """Root mean square."""
    total = 0.0
    for value in values:
        total += value * value
    return math.sqrt(total / len(values))


def _sizes(values: array[float]) -> tuple[float, float]:
    """Root mean square, and the largest without its sign."""
    return rms(values), max(map(abs, values))


def _share_above(values: array[float], bound: float | None) -> float | None:
    if bound is None:
        return None
    return len([1 for value in values if abs(value) > bound]) / len(values)


def _share_above_authority(
    values: array[float], surfaces: array[float], gain: float | None, layer: float | None
) -> float | None:
    """The share of periods with |f_i| above the authority; None also for a law that does not name its surface."""
    if gain is None or len(surfaces) != len(values):
        return None
    pairs = zip(values, surfaces, strict=True)
    above = [1 for value, surface in pairs if abs(value) > authority(surface, gain, layer)]
    return len(above) / len(values)


def authority(surface: float, gain: float, layer: float | None) -> float:
    """Size of the switching term: the gain, reduced inside the layer."""
    if layer is None:
        return gain if surface else 0.0
    return gain * min(1.0, abs(surface) / layer)


def theory_text(theory: Theory) -> str:
    """The figures in one line: assumptions that hold are left out, but condition (17) is always given."""
    parts = []
    third, f = theory.assumption_3, theory.disturbance
    for number, broken in enumerate((theory.assumption_1, theory.assumption_2), 1):
        if broken.broken_s:
            parts.append(f"assumption {number} broken for {broken.broken_s:.2f} s")
    if third.frames or third.crossings:
        crossed = f", crossed {third.crossings} x" if third.crossings else ""
        parts.append(f"assumption 3 within 0.1 rad in {amount(third.frames, 'frame')}{crossed}")
    if f is not None:
        for axis, above_gain, above_authority in (
            ("1", f.f1_above_p1, f.f1_above_authority),
            ("2", f.f2_above_p2, f.f2_above_authority),
        ):
            if above_gain is not None:
                parts.append(_condition_17(axis, above_gain, above_authority))
    if theory.backward_s:
        parts.append(f"backward for {theory.backward_s:.2f} s")
    return "; ".join(parts)


def _condition_17(axis: str, above_gain: float, above_authority: float | None) -> str:
    text = f"|f{axis}| > P{axis} in {100.0 * above_gain:.0f} %"
    if above_authority is not None:
        text += f" (> P{axis} |sat(s{axis})| in {100.0 * above_authority:.0f} %)"
    return text
