"""SUBJECT, what the `mirotwin fw` commands look into: an image, a scenario, a recording or a stream file."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import msgspec

from miro_exact import clock
from miro_exact.bad_input import BadInput
from miro_exact.seed import MAX_SEED
from miro_robot.inspect.watcher import Watcher
from miro_sim.radio.downlink import TransmissionError
from miro_sim.scenario.file import builtin_names, load
from miro_sim.world.world import World
from mirotwin.firmware.bare_options import (
    BareRequest,
    bare_options,
    load_bare_image,
    make_machine,
    report,
    take_bare,
    target_of,
)
from mirotwin.rerun.faults import report_faults
from mirotwin.rerun.inspected_run import BareRun, RobotRun, Run, watch
from mirotwin.rerun.job import load_job
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import (
    Place,
    Whole,
    choose_engine,
    engine_option,
    firmware_option,
    plain_parameters,
    refuse_steps,
    set_option,
)
from mirotwin.shell.program import tell_notes
from mirotwin.shell.progress import ProgressBar
from mirotwin.shell.times import Time, TimeType

IMAGE_SUFFIXES = (".ihx", ".hex", ".ihex")


class Request(msgspec.Struct, frozen=True):
    """What the command line says about the run; names as the options'."""

    subject: str
    seed: int | None
    firmware: str | None
    settings: tuple[str, ...]
    network: int | None
    robot: int | None
    from_tick: int
    to_tick: int | None
    engine: str | None
    bare: BareRequest

    @property
    def files(self) -> tuple[str | None, ...]:
        """What is read, and so must not be written."""
        return (self.subject, self.firmware, *self.bare.files)


_OPTIONS: tuple[Callable[[Any], Any], ...] = (
    click.argument("subject", metavar="SUBJECT", type=Place()),
    click.option("--from", "from_tick", type=TimeType(), default="0t", help="Start there: 1.5s, 20ms, 48000t."),
    click.option("--to", "to_tick", type=TimeType(), help="Stop there. Default: the end of the run."),
    click.option("--seed", type=Whole(0, MAX_SEED), help="Scenario: master seed of all noise. Default 0."),
    firmware_option("Scenario, recording, stream: image to run instead of its own."),
    set_option("Scenario, recording, stream: a key to set in its scenario, as for `run`."),
    click.option("--network", type=Whole(0), help="Network of the robot. Default 0."),
    click.option("--robot", type=Whole(0, 4), help="Slot of the robot. Default: the lowest slot used."),
    bare_options("Image: "),
    engine_option,
)  # fmt: skip


def subject_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Gives a command SUBJECT and these options, as one `request`."""

    @functools.wraps(command)
    def gathered(**given: Any) -> Any:
        bare = take_bare(given)
        for name in ("from_tick", "to_tick"):
            time: Time | None = given[name]
            given[name] = None if time is None else time.ticks(bare.crystal_hz)
        names = [name for name in Request.__struct_fields__ if name != "bare"]
        request = Request(**{name: given.pop(name) for name in names}, bare=bare)
        return command(request=request, **given)

    with_options: Callable[..., Any] = gathered
    for option in reversed(_OPTIONS):
        with_options = option(with_options)
    return with_options


def open_run(request: Request) -> Run:
    """The run that was asked for, at its first tick. Raises BadInput."""
    if request.to_tick is not None and request.to_tick <= request.from_tick:
        raise BadInput(
            "",
            f"--from {request.from_tick}t --to {request.to_tick}t",
            "the window is empty",
            "--to must be later",
        )
    if request.subject.lower().endswith(IMAGE_SUFFIXES):
        run: Run = _bare_run(request)
    else:
        run = _robot_run(request)
    if run.end_tick is not None and request.from_tick >= run.end_tick:
        raise BadInput(
            request.subject,
            f"--from {request.from_tick}t",
            f"the run ends at tick {run.end_tick}",
            "look earlier",
        )
    return run


def look(run: Run, request: Request, *watchers: Watcher, early_ticks: int = 0, late_ticks: int = 0) -> int:
    """Runs it under the eyes of `watchers` and says how it ended; returns the exit code.

    They look on from `early_ticks` before the window to `late_ticks` behind it, as far as the run goes.
    Raises BadInput when the run was over before there was anything to look at.
    """

    first_tick = max(0, request.from_tick - early_ticks)
    last_tick = None if request.to_tick is None else request.to_tick + late_ticks
    end_tick = _earlier(run.end_tick, last_tick)
    with ProgressBar(f"running {request.subject}", end_tick) as bar:
        try:
            with plain_parameters(request.subject):
                reached = watch(run, watchers, first_tick, last_tick, bar.to)
        except TransmissionError as error:
            now = run.cpu.cycles * clock.CYCLE_TICKS
            raise BadInput(request.subject, "", f"cannot be run beyond tick {now}: {error}") from None
    if not reached:
        end = run.cpu.cycles * clock.CYCLE_TICKS
        raise BadInput(
            request.subject, f"--from {request.from_tick}t", f"the run ended at tick {end}", "look earlier"
        )
    return _verdict(run, request)


def _earlier(one: int | None, other: int | None) -> int | None:
    return min((tick for tick in (one, other) if tick is not None), default=None)


def _refuse(request: Request, kind: str, *options: str) -> None:
    for option in options:
        value = getattr(request, option)
        if value not in (None, False, ()):
            name = "set" if option == "settings" else option.replace("_", "-")
            raise BadInput(request.subject, "", f"is {kind}, --{name} does not apply to it", "leave it out")


def _bare_run(request: Request) -> BareRun:
    _refuse(request, "an image on the bare processor", "seed", "firmware", "settings", "network", "robot")
    choose_engine(request.engine)
    image = load_bare_image(request.subject, request.bare)
    until = target_of(request.subject, image, request.bare)

    return BareRun(make_machine(image, request.bare), until, request.bare.max_cycles)


def _robot_run(request: Request) -> RobotRun:
    for option in request.bare.given():
        raise BadInput(request.subject, "", f"is no image, {option} does not apply to it", "leave it out")
    subject = request.subject
    is_path = os.path.exists(subject) or "/" in subject or "\\" in subject
    periods = None
    if subject in builtin_names() or subject.endswith(".toml") or not is_path:
        choose_engine(request.engine)
        text = load(subject, request.settings)
        tell_notes(text.notes)
        refuse_steps(text.scenario, subject)
        image = load_firmware(request.firmware)
        with plain_parameters(subject):
            world = World(text.scenario, request.seed or 0, image)
    else:
        _refuse(request, "a recording or stream, which has its seed", "seed")
        job, image = load_job(subject, request.firmware, request.engine, request.settings)
        periods = job.recorded[-1].index + 1 if job.recorded else None
        with plain_parameters(subject):
            world = job.world(image)
    network, index = _which_robot(world, request)
    return RobotRun(world, network, index, periods)


def _which_robot(world: World, request: Request) -> tuple[int, int]:
    """(network, place among its robots) of the robot that was asked for."""
    network = request.network or 0
    if network >= len(world.networks):
        raise BadInput(
            request.subject, f"--network {network}", f"there are {len(world.networks)}, numbered from 0"
        )
    slots = [robot.spec.slot for robot in world.networks[network].robots]
    if request.robot is None:
        return network, 0
    if request.robot not in slots:
        there = ", ".join(map(str, slots))
        raise BadInput(
            request.subject, f"--robot {request.robot}", "no robot in that slot", f"there is {there}"
        )
    return network, slots.index(request.robot)


def _verdict(run: Run, request: Request) -> int:
    """Says on stderr why a run ended that did not end as planned."""

    if isinstance(run, RobotRun):
        return report_faults(run.world)
    assert isinstance(run, BareRun)
    return report(run.machine, run.ended, request.bare)


def image_name(run: Run) -> str:
    """What to call the image in output: its file's name."""
    return Path(run.image.path).name
