"""A running world with its checks, watchers and driver.

run = Run(spec)
run.drive()                  by its steps, or control period by control period; `play` replays a script
run.result()                 its verdict and the reasons
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import msgspec
import tomli_w

from miro_exact.bad_input import BadInput
from miro_exact.clock import CHARACTER_BITS, CONTROL_PERIOD_TICKS, CYCLE_TICKS, NEVER_TICK, TICKS_PER_SECOND
from miro_protocol.actions import ScriptItem
from miro_robot.image import Image
from miro_sim.periods import Period
from miro_sim.radio.downlink import TransmissionError
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import any_of_text
from mirotwin.runs import runner
from mirotwin.runs.result import Result, expectation_lines, fault_lines
from mirotwin.runs.spec import RunSpec, silent_scenario
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.outputs import RECORDING, OutputFolder, whole_file
from mirotwin.shell.verdicts import Verdict, judge
from mirotwin.verify.cases.case import Trace, case_of_checks, case_text, tables_of
from mirotwin.verify.checks.happens import expect_of
from mirotwin.verify.checks.interface import Failure
from mirotwin.verify.checks.monitors import Checks
from mirotwin.verify.checks.sleep import Sleep
from mirotwin.verify.effect import Proof
from mirotwin.verify.steps.keys import ConditionStep, HoldStep, WaitStep
from mirotwin.verify.steps.player import Player, player_of

if TYPE_CHECKING:
    from miro_sim.world.world import World
    from mirotwin.recording.recorder import Recorder, RunSource
    from mirotwin.recording.track import Tracks
    from mirotwin.shell.held_signals import Hold


ANSWER_LOOK_TICKS = 24_000
"""Between two looks at whether a board has sent its answer."""

on_world: ContextVar[Callable[[World], object] | None] = ContextVar("on_world", default=None)
"""Called with the world of each run that begins; the sanitizer watches a command's runs through it."""


class Run:
    """`world`: built from the spec and unmoved, or moved to the tick at which the checks begin.

    `trace`: records its input, None if no case is needed. `player`: of its steps. `periods`: the control periods that
    `play` completed. `proofs`: that each hardware fault changed something. `tick`: end of the run, -1 before.
    `is_session`: a live session, which the user ends.
    """

    def __init__(self, spec: RunSpec, world: World | None = None, trace: Trace | None = None) -> None:
        self.spec = spec
        self.world = spec.world() if world is None else world
        if (begun := on_world.get()) is not None:
            begun(self.world)
        self.trace = trace
        self.checks = Checks(self.world, spec.checks(), spec.cut)
        self.player: Player | None = player_of(self.world, spec.steps, spec.origin)
        self.proofs: list[Proof] = self.player.proofs if self.player is not None else []
        self.periods: list[Period] = []
        self.tick = -1
        self.is_session = False

    @classmethod
    def traced(cls, spec: RunSpec, world: World | None = None) -> Run:
        """A run that can become a case, unless it continues a saved world."""
        world = spec.world() if world is None else world
        return cls(spec, world, None if world.tick else Trace(world))

    # Driving

    def drive(
        self,
        recorder: Recorder | None = None,
        full: bool = False,
        on_period: Callable[[Period], object] = lambda period: None,
        move: Callable[[], object] | None = None,
    ) -> None:
        """Runs to the end: by `move`, by its steps, or control period by control period; see `runner.run`."""
        if move is None and self.player is not None:
            move = self.player.run
        runner.run(self.world, recorder, full, on_period, move)

    def record(
        self,
        stream: BinaryIO,
        source: RunSource,
        tracks: Tracks,
        hold: Hold | None = None,
        begun: Callable[[Recorder], object] = lambda recorder: None,
        on_period: Callable[[Period], object] = lambda period: None,
        move: Callable[[], object] | None = None,
    ) -> None:
        """Runs to the end, recorded to `stream` and in `tracks`, flushed several times a second.

        `begun` gets the recorder. `hold` holds signals, except while the world is moved.
        """

        from mirotwin.recording.recorder import Recorder  # loads the library of the format

        def keep(period: Period) -> None:
            tracks.add(period)
            recorder.write_theories(tracks.theories())
            recorder.flush_if_due()
            on_period(period)

        with Recorder(stream, source, hold) as recorder:
            recorder.flush()
            begun(recorder)
            with nullcontext() if hold is None else hold.released():
                self.drive(recorder, source.record == "full", keep, move)

    def play(self, progress: Callable[[int], object] = lambda tick: None) -> Run:
        """Runs to its end, which may be within a control period; with steps, to the end of its scenario. `progress`
        gets the tick.

        Raises TransmissionError for a script that cannot be sent.
        """
        world, until_tick = self.world, self.spec.until_tick
        world.observers.append(self.periods.append)
        if self.player is not None:
            world.observers.append(lambda period: progress(world.tick))
            self.player.run()
        else:
            self._go_to(world.scenario.end_tick if until_tick is None else until_tick, progress)
        if self.checks.sleep is not None:
            self._let_answer(self.checks.sleep, progress)
        self.finish()
        return self

    def _go_to(self, end_tick: int, progress: Callable[[int], object]) -> None:
        world, sleep = self.world, self.checks.sleep
        while not world.stopped and world.tick < end_tick:
            world.run_to(
                min(end_tick, world.period_end, NEVER_TICK if sleep is None else sleep.next_tick(world.tick))
            )
            progress(world.tick)

    def _let_answer(self, sleep: Sleep, progress: Callable[[int], object]) -> None:
        """Lets a board that has gone to sleep in time continue until its answer, which belongs to the run, is sent."""
        from miro_robot.harness.recording_bus import LONGEST_ANSWER_TICKS  # only boards alone need it loaded

        world, last_tick = self.world, self.world.tick + LONGEST_ANSWER_TICKS
        sleep.next_tick(world.tick)
        while sleep.answers and not world.stopped and world.tick < last_tick:
            self._go_to(sleep.cpu.cycles * CYCLE_TICKS + ANSWER_LOOK_TICKS, progress)

    def finish(self) -> None:
        """Ends the run, completed or interrupted."""
        if self.tick < 0:
            self.tick = self.world.tick
        self.checks.finish()

    # Judging

    @property
    def judges(self) -> list[Checks]:
        """The checks of the whole run, and those that steps began."""
        return [self.checks, *(self.player.checks if self.player else ())]

    @property
    def failures(self) -> list[Failure]:
        return self.checks.failures

    @property
    def failure(self) -> Failure | None:
        """The first one."""
        return self.failures[0] if self.failures else None

    def verdict_on(self, name: str) -> Verdict:
        """The verdict of one check."""
        return next(verdict.verdict for verdict in self.checks.verdicts() if verdict.name == name)

    def result(self) -> Result:
        """Its verdict, and the lines of steps, checks and firmware faults."""
        world, player = self.world, self.player
        lines = [line for group in self.judges for line in expectation_lines(group)]
        if player is not None and player.failure is not None:
            lines.insert(0, ("failed", f"step failed: {player.failure}"))
        lines += fault_lines(world.devices, NEVER_TICK if self.spec.until_tick is None else self.tick)
        lines += [("passed", note) for device in world.devices for note in device.notes()]
        missing = [proof.missing(self.spec.world) for proof in self.proofs]
        lines += [("not judged", line) for line in missing if line]
        parts = [group.verdict() for group in self.judges]
        parts += [verdict for verdict, _ in lines if verdict in ("fault", "failed")]
        parts += ["not judged" for line in missing if line]
        return Result(
            path=self.spec.origin,
            verdict=judge(parts),
            verdict_lines=lines,
            failures=[failure for group in self.judges for failure in group.failures],
            expectations=[verdict for group in self.judges for verdict in group.verdicts()],
            done=0 if player is None else player.done,
            steps=0 if player is None else player.count,
            step_tick=-1 if player is None or player.failure is None else player.failure.tick,
            tick=world.tick if self.tick < 0 else self.tick,
            clock=world.clock,
            seed=self.spec.seed,
            digest=world.digest,
            firmware_sha256=world.image.sha256 or "",
            has_page=not (isinstance(world.scenario, BoardScenario) and world.scenario.others),
        )

    # As files

    def write(self, folder: OutputFolder) -> None:
        """Records the periods that `play` came past, as run.mcap in the folder. Raises OutputError."""
        from mirotwin.recording.recorder import Recorder, source_of  # loads the library of the format

        text = any_of_text(tomli_w.dumps(tables_of(self.spec.robot_scenario)), self.spec.origin)
        source = source_of(text, self.world, resumed=self.spec.resumed)
        with folder, folder.part(RECORDING).open("wb") as stream, Recorder(stream, source) as recorder:
            for period in self.periods:
                recorder.write(period)
            recorder.write_faults(self.world.devices, alone=not self.world.robots)

    def keep_saved(self, folder: Path) -> None:
        """Writes the states of the `save` steps. Raises OutputError."""
        for name, content in (self.player.saved if self.player else {}).items():
            folder.mkdir(parents=True, exist_ok=True)
            with whole_file(folder / name, "--artifacts") as part:
                part.write_bytes(content)

    def case(self) -> str:
        """The case of the first failure as text. Raises ValueError if nothing failed."""
        return case_of_checks(self.world, self._known_trace(), self.checks, self._end_tick)

    @property
    def _end_tick(self) -> int | None:
        """End tick of its case; None: the present tick.

        For a board it leaves time for a slower build to reach its fault, but not for a session, whose scenario lasts a
        day.
        """
        if self.is_session or not isinstance(self.world.scenario, BoardScenario):
            return None
        return max(self.world.scenario.end_tick, *(failure.tick for failure in self.failures[:1]), 0)

    def stream(self, expect: Mapping[str, Any] = {}, verdict: str = "") -> str:
        """This run as a stream: the case of the check in `expect`; without a check the stream expects nothing."""
        return case_text(self.world, self._known_trace(), expect, verdict, self._end_tick)

    def case_of_step(self) -> str | None:
        """The case of the step that has just failed; None where no check can judge it."""
        player = self.player
        failure = None if player is None else player.failure
        if player is None or failure is None or failure.tick <= failure.begun_tick:
            return None
        step = player.steps[player.done]
        if not isinstance(step, ConditionStep) or (isinstance(step, WaitStep) and not failure.timed_out):
            return None
        name, condition = "happens", step.condition
        if isinstance(step, HoldStep):
            name, condition = "never_happens", step.forbidden()
        until_tick = max(failure.tick, self.world.tick)
        alone = isinstance(self.world.scenario, BoardScenario)
        expect = expect_of(name, condition, failure.begun_tick, until_tick, alone)
        return None if expect is None else self.case_of_expect(expect)

    def case_of_expect(self, expect: Mapping[str, Any]) -> str | None:
        """The case by a check that the run did not have: a new one with the same input is judged by `expect`.

        None where the check passes, or cannot be one: a wait for no time at all.
        """
        try:
            again = Run(self.as_sent(expect)).play()
        except BadInput:
            return None
        failure = next((failed for failed in again.failures if failed.check in expect), None)
        return None if failure is None else self.stream(expect, str(failure))

    def as_sent(self, expect: Mapping[str, Any]) -> RunSpec:
        """A spec that repeats the run up to here from its inputs: no controller computes, no step is done."""
        world = self.world
        scenario = msgspec.structs.replace(world.scenario, expect=dict(expect))
        if isinstance(scenario, BoardScenario):  # at the rate at which it was sent
            bit_ticks = world.lines[0].outbox.character_ticks // CHARACTER_BITS
            scenario = msgspec.structs.replace(scenario, step=(), bit_ticks=bit_ticks)
        return RunSpec(
            scenario=scenario,
            image=world.image,
            seed=world.seed,
            script=self.script(),
            until_tick=world.tick,
        )

    def script(self) -> Sequence[ScriptItem]:
        """The run's input as a script."""
        return self._known_trace().script()

    def _known_trace(self) -> Trace:
        assert self.trace is not None, "nobody traced the run, or it began with what another one had saved"
        return self.trace


def scripted(spec: RunSpec, progress: Callable[[int], object] = lambda tick: None) -> RunSpec:
    """A run with steps as the script of everything the steps sent and did; such a run can be stopped anywhere."""
    run = Run.traced(spec).play(progress)
    scenario = spec.scenario
    if isinstance(scenario, BoardScenario):
        scenario = msgspec.structs.replace(scenario, bit_ticks=run.world.bit_ticks)
    return msgspec.structs.replace(spec, scenario=scenario, steps=(), script=run.script())


def robot_spec(
    image: Image,
    robots: int,
    slot: int,
    script: Sequence[ScriptItem],
    expect: Mapping[str, Any],
    until_tick: int,
) -> RunSpec:
    """One standing robot of a network of `robots` receives `script`, over a radio without errors whose carrier is
    always on. `expect`: checks by name with their parameters, as in `[expect]`. The run continues to the end of the
    control period.
    """
    whole_s = -(-until_tick // TICKS_PER_SECOND)  # whole seconds, so that few texts are read
    settings = (
        f"network.robots={robots}",
        f"network.robot.slot={slot}",
        'network.radio.carrier="on"',
        f"duration_s={whole_s + 1}",
    )
    return RunSpec(
        scenario=msgspec.structs.replace(silent_scenario(settings), expect=dict(expect)),
        image=image,
        script=sorted(script, key=lambda item: item.tick),
        until_tick=-(-until_tick // CONTROL_PERIOD_TICKS) * CONTROL_PERIOD_TICKS,
    )


@contextmanager
def replaying(file: str, world: World) -> Iterator[None]:
    """Converts errors in sending or computing to BadInput for `file`."""
    try:
        with plain_parameters(file, "replayed"):
            yield
    except TransmissionError as error:
        raise BadInput(file, "", f"cannot be replayed beyond tick {world.tick}: {error}") from None
