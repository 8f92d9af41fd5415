"""One run of many: what it is made from, and the row of figures that it leaves.

A run that cannot be made, or fails, leaves a row with its error: one bad corner of a plan does not cost the others.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_sim.periods import Period
from miro_sim.scenario.file import ScenarioText, load
from miro_sim.world.world import World
from mirotwin.recording.recorder import Recorder
from mirotwin.recording.source import source_of
from mirotwin.recording.track import Errors, Tracks
from mirotwin.report.seen import Seen
from mirotwin.report.summary import tracking_of
from mirotwin.report.theory import Theory, gains_of, theory_of
from mirotwin.rerun import runner


class Job(msgspec.Struct, frozen=True):
    """A scenario (a built-in name or a path) with `settings` (KEY=VALUE), and a seed; `label` names its group.

    `recording`: where the run is recorded, if it is.
    """

    label: str
    scenario: str
    settings: tuple[str, ...]
    seed: int
    recording: str = ""


class Row(msgspec.Struct, frozen=True):
    """What the first robot of a run did; `error` says why there is nothing else.

    `rms_*`: root mean square over the last second, truth against reference; `seen_*`: measurement against the reference
    at its exposure (None, if the robot was not seen in that second). `settling_s` as in summary.json; `settled` at the
    end of the run. The last five: `report.theory`.
    """

    label: str
    scenario: str
    seed: int
    error: str = ""
    digest: str = ""
    rms_x_cm: float | None = None
    rms_y_cm: float | None = None
    rms_theta_deg: float | None = None
    rms_position_cm: float | None = None
    seen_x_cm: float | None = None
    seen_y_cm: float | None = None
    seen_theta_deg: float | None = None
    seen_position_cm: float | None = None
    settling_s: float | None = None
    settled: bool = False
    off_pitch_s: float | None = None
    faults: int = 0
    reversals: int = 0
    backward_s: float = 0.0
    crossings: int = 0
    frames_across: int = 0
    chattering_m_s2: float | None = None


@lru_cache(maxsize=4)
def _image(path: str) -> Image:
    return load_hex(Path(path))


@lru_cache(maxsize=64)
def _text(scenario: str, settings: tuple[str, ...]) -> ScenarioText:
    return load(scenario, settings)


def run(job: Job) -> Row:
    """Runs it to the end. A process keeps images and scenarios, so the next run costs its loop."""
    try:
        return _run(job)
    except BadInput as error:
        return Row(job.label, job.scenario, job.seed, error=f"{error}")


def _run(job: Job) -> Row:
    text, image = _text(job.scenario, job.settings), _image(str(image_path()))
    world = World(text.scenario, job.seed, image)
    tracks, seen = Tracks(), Seen(text.scenario.camera.delay_frames)

    def keep(period: Period, recorder: Recorder | None = None) -> None:
        tracks.add(period)
        seen.add(period.robots[0], period.tick)
        if recorder is not None:
            recorder.write_theories(tracks.theories())

    if job.recording:
        source = source_of(text, world)
        with Path(job.recording).open("wb") as stream, Recorder(stream, source) as recorder:
            runner.run(world, recorder, on_period=lambda period: keep(period, recorder))
    else:
        runner.run(world, on_period=keep)
    faults = len([fault for _, _, found in runner.faults_by_robot(world) for fault in found])
    gains = gains_of(text.scenario)
    place, track = next(iter(tracks.robots.items()))
    return _row(job, tracks.digest, track.errors, seen, theory_of(track.theory, gains[place]), faults)


def _row(job: Job, digest: str, errors: Errors, seen: Seen, theory: Theory | None, faults: int) -> Row:
    end_tick = errors[-1].tick - TICKS_PER_SECOND
    truth = tracking_of(errors)
    camera = seen.tracking(end_tick)
    return Row(
        label=job.label,
        scenario=job.scenario,
        seed=job.seed,
        digest=digest,
        rms_x_cm=truth.rms_x_cm,
        rms_y_cm=truth.rms_y_cm,
        rms_theta_deg=truth.rms_theta_deg,
        rms_position_cm=truth.rms_position_cm,
        seen_x_cm=camera.rms_x_cm,
        seen_y_cm=camera.rms_y_cm,
        seen_theta_deg=camera.rms_theta_deg,
        seen_position_cm=camera.rms_position_cm,
        settling_s=truth.settling_s,
        settled=errors[-1].settled,
        off_pitch_s=truth.off_pitch_s,
        faults=faults,
        reversals=theory.reversals if theory else 0,
        backward_s=theory.backward_s if theory else 0.0,
        crossings=theory.assumption_3.crossings if theory else 0,
        frames_across=theory.assumption_3.frames if theory else 0,
        chattering_m_s2=theory.chattering_m_s2 if theory else None,
    )
