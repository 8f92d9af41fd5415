"""The first difference of two runs: control period, tick, fields of the state, and with two firmwares the
instruction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_robot.image import Image
from miro_sim.periods import Period
from miro_sim.scenario.board import BoardScenario
from mirotwin.recording.compare import EXACT, CompareRule, differences
from mirotwin.recording.difference import DIGEST, WORDS, Difference, first_per_channel
from mirotwin.replay.lockstep.annotated_image import AnnotatedImage
from mirotwin.replay.lockstep.firmwares import FirmwareDifference, first_instruction
from mirotwin.replay.lockstep.pair import LOOK_TICKS, StateDifference, first_difference
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.options import plain_parameters

if TYPE_CHECKING:
    from miro_sim.world.world import World

Annotate = Callable[[Image], AnnotatedImage]


class ComparedRun(msgspec.Struct, frozen=True):
    """One of two runs. `periods`: its control periods; `ways`: possible ways to repeat it, empty if there are none.
    `recorded`: a repetition is accepted only if it gives the digests of `periods`. `state`: the form of the states, and
    `plugins`, both from its recording. `notes`: remarks for the user.
    """

    periods: Sequence[Period]
    ways: Sequence[RunSpec]
    recorded: bool = False
    state: str = ""
    plugins: tuple[str, ...] = ()
    notes: Sequence[str] = ()

    def again(self, way: RunSpec, period: int) -> World | None:
        """Its world at the start of control period `period`, None where the way does not repeat it.

        A run that was recorded beside a controller, with input put in, is repeated by no controller.
        """
        try:
            world = way.world()
            world.run_to(period * world.period_ticks)
        except BadInput:
            raise
        except ValueError:  # what no host can have sent, and no caller can have done
            return None
        before = self.periods[:period] if self.recorded else ()
        same = not before or before[-1].digest == world.digest
        return world if same and world.index == period else None


class RunDifference(msgspec.Struct, frozen=True):
    """The differences of two runs, called `names`. `differences`: in the order of time. `state` and `instruction`:
    found by repeating both; `notes`: failed steps with reasons. `alone`: the runs are of a board without a robot.
    `rule`: of the comparison.
    """

    names: tuple[str, str] = WORDS
    differences: Sequence[Difference] = ()
    state: StateDifference | None = None
    instruction: FirmwareDifference | None = None
    notes: Sequence[str] = ()
    alone: bool = False
    rule: CompareRule = EXACT

    @property
    def period(self) -> int:
        """The first control period that differs."""
        return min(each.period for each in self.differences)

    @property
    def observed_tick(self) -> int:
        """Tick of the first difference that is more than a digest; unused bytes of a stack are enough to change a
        digest.
        """
        ticks = [each.tick for each in self.differences if each.channel != DIGEST]
        return (ticks or [self.differences[0].tick])[0]

    def as_json(self, everything: bool) -> dict[str, Any]:
        """`channels`: the first difference of each; `differences` only if all are wanted."""
        keys = self.names[0].lower(), self.names[1].lower()
        all_of_them = [each.as_json(keys) for each in self.differences]
        channels = first_per_channel(self.differences)
        return {
            "count": len(all_of_them),
            "first": all_of_them[0] if all_of_them else None,
            "channels": [{**first.as_json(keys), "count": count} for first, count in channels],
            **({"differences": all_of_them} if everything else {}),
            "period": self.period if all_of_them else None,
            "state": self.state and self.state.as_json(),
            "instruction": self.instruction and self.instruction.as_json(),
            "notes": self.notes,
        }


_OTHER_DIGESTS = (
    "no tick within the control period: run again, {} not give the recorded digests up to there (another version of"
    " this program recorded, or input was put in beside a controller)"
)
_NOT_RECORDED = (
    "run again, their states do not differ up to the end of control period {}: what made the difference was not"
    " recorded (another version of this program, or values that were changed)"
)


def compare_runs(
    run: ComparedRun,
    other: ComparedRun,
    rule: CompareRule,
    annotate: tuple[Annotate, Annotate],
    names: tuple[str, str] = WORDS,
    only_firmware: bool = True,
) -> RunDifference:
    """Compares two runs; if they differ, repeats both to find tick, fields and instruction. `annotate`: finds the debug
    files of their images. `only_firmware`: the runs differ in their firmware only, so the first changed instruction is
    searched.
    """
    difference = RunDifference(names, differences(run.periods, other.periods, rule), rule=rule)
    if not difference.differences:
        return difference
    if run.ways:
        scenario = run.ways[0].scenario
        in_time = [replace(each, clock=scenario.clock) for each in difference.differences]
        difference = replace(difference, differences=in_time, alone=isinstance(scenario, BoardScenario))
    if not run.ways or not other.ways:
        return replace(
            difference, notes=("they cannot be run again: what was recorded is no firmware image",)
        )
    try:
        with plain_parameters("the run", "repeated"):
            return _repeated(difference, run, other, annotate if only_firmware else None)
    except BadInput as error:
        return replace(difference, notes=(f"they cannot be run again: {error}",))


def _repeated(
    difference: RunDifference,
    run: ComparedRun,
    other: ComparedRun,
    annotate: tuple[Annotate, Annotate] | None,
) -> RunDifference:
    """`annotate` None: no instruction is looked for."""
    first, unrepeated = _first_period(run, other, difference.period), set(difference.names)
    for way, other_way in zip(run.ways, other.ways, strict=True):
        world, other_world = run.again(way, first), other.again(other_way, first)
        if world is not None and other_world is not None:
            break
        repeated = (
            difference.names[0]
            if world is not None
            else difference.names[1]
            if other_world is not None
            else ""
        )
        unrepeated.discard(repeated)
    else:
        whose = f"{unrepeated.pop()} does" if len(unrepeated) == 1 else "they do"
        return replace(difference, notes=(_OTHER_DIGESTS.format(whose),))
    end_tick = (max(first, difference.period) + 1) * world.period_ticks
    state = first_difference(world, other_world, end_tick, world.period_ticks)
    if state is None:
        return replace(difference, notes=(_NOT_RECORDED.format(difference.period),))
    instruction = None
    if annotate is not None and way.image.code != other_way.image.code:
        instruction = first_instruction(
            other_way.world,
            annotate[0](way.image),
            annotate[1](other_way.image),
            difference.observed_tick + LOOK_TICKS,
        )
    return replace(difference, state=state, instruction=instruction)


def _first_period(run: ComparedRun, other: ComparedRun, period: int) -> int:
    """The control period to search from: the first with different digests, or the one before `period` without them."""
    if not (run.recorded and other.recorded):
        return 0
    for here, there in zip(run.periods, other.periods, strict=False):
        if here.digest != there.digest:
            return here.index
    return max(0, period - 1)
