"""The debugger beside brute force: last writers, stacks and random walks; `python -m tests.mirotwin.debug.proofs`.

Which bytes an instruction writes is told by executing it twice on a copy of the processor, once with all variables
complemented: a byte is written if one of the two changes it. Stacks are those of the calls, interrupts and returns that
were executed. At each stop of a walk the state has to be that of a run that never stopped. The tests prove a part.
"""

import argparse
import random
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

from miro_exact.clock import CYCLE_TICKS
from miro_exact.state import Flat
from miro_robot.image import load_hex
from miro_robot.image.c_types import value_of
from miro_robot.inspect.frames import Unwinder
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.watcher import Watcher, attach
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.opcodes import LENGTH, ROW, is_call
from mirotwin.debug.expression import content
from mirotwin.debug.timeline import Trap
from mirotwin.runs.inspected_run import InspectedRun
from tests import children
from tests.alone import Alone
from tests.mirotwin.debug.runs import ASM, SECOND, debugger_of, golden_digest, robot_run

JBC = 0x10
MIX = Path(__file__).parents[2] / "robot" / "ucsim" / "programs" / "mix.c"
LIBRARY = Path(__file__).parent / "library.c"


def written_bytes(run, begin_tick, end_tick, first, last):
    """[(cycle, bytes written by the instruction that begins there)] of internal RAM from `first` to `last`."""
    cpu, state = run.cpu, Flat(run.cpu)
    copy = Cpu()
    copy.load(run.image.code)
    copied = Flat(copy)
    run.to(begin_tick)
    run.to(cpu.cycles * CYCLE_TICKS)
    found = []
    while cpu.cycles * CYCLE_TICKS < end_tick:
        if not cpu.idle:
            before, written = state.save(), set()
            for mask in (0x00, 0xFF):
                copied.load(before)
                if mask and ROW[copy.code_at(copy.pc)] == JBC:
                    continue  # whether it writes depends on the bit
                for place in range(first, last):
                    copy.poke_iram(place, copy.peek_iram(place) ^ mask)
                seen = [copy.peek_iram(place) for place in range(first, last)]
                executed = copy.instructions
                copy.step()
                if copy.instructions != executed:
                    written |= {
                        first + at for at, value in enumerate(seen) if copy.peek_iram(first + at) != value
                    }
            found.append((cpu.cycles, written))
        run.to(cpu.cycles * CYCLE_TICKS + 1)
    return found


def wrong_writers(begin_tick, end_tick, count, seed=0):
    """(variable, tick, what was found) where the last writer is not that of brute force; and how many were asked."""
    debugger = debugger_of(robot_run())
    stack = debugger.symbols.image.symbols.stack[0]
    writes = written_bytes(robot_run(), begin_tick, end_tick, 0x20, stack)
    known = [(name, get()) for name, get in debugger.moment().variables("").items()]
    variables = [
        (name, range(one.address, one.address + one.kind.size))
        for name, one in known
        if one.space == "iram" and one.address >= 0x20
    ]
    ever = set().union(*(written for _, written in writes))
    often = [one for one in variables if not ever.isdisjoint(one[1])]
    chance, wrong, asked = random.Random(seed), [], 0
    for _ in range(count):
        name, places = chance.choice(chance.choice((often, often, variables)))
        at = chance.randrange(1, len(writes))
        before = [cycle for cycle, written in writes[:at] if not written.isdisjoint(places)]
        debugger.timeline.go_to(writes[at][0] * CYCLE_TICKS)
        found = debugger.last_writer(debugger.bytes_of(name))
        assert debugger.cpu.cycles == writes[at][0]
        cycle = None if found is None else found[0] // CYCLE_TICKS
        asked += bool(before)
        if (before and cycle != before[-1]) or (not before and cycle is not None and cycle >= writes[0][0]):
            wrong.append((name, writes[at][0], cycle))
    return wrong, asked


class Shadow(Watcher):
    """Compares the frames at random instructions with the calls that were made."""

    def __init__(self, image, share, seed=0):
        self.unwinder = Unwinder(image, SymbolNames(image))
        self.calls = []  # (address of return, SP when it was pushed, whether by an interrupt)
        self.share, self.chance = share, random.Random(seed)
        self.compared, self.wrong = 0, []

    def compare(self, cpu):
        if self.chance.random() < self.share:
            frames = self.unwinder.frames(cpu)
            self.compared += 1
            found = [(inner.by_interrupt, outer.pc) for inner, outer in pairwise(frames)]
            calls = [(interrupt, back) for back, _, interrupt in reversed(self.calls)]
            if found != calls or not frames[-1].known:
                self.wrong.append(cpu.pc)

    def executed(self, cpu, pc, start):
        opcode = cpu.code_at(pc)
        if is_call(opcode):
            self.calls.append((pc + LENGTH[opcode], cpu.sp, False))
        while self.calls and self.calls[-1][1] > cpu.sp:
            self.calls.pop()  # a RET alone may be a jump: SDCC goes so to what a pointer names
        self.compare(cpu)

    def interrupted(self, cpu, source, pc, start):
        self.calls.append((pc, cpu.sp, True))
        self.compare(cpu)


def stacks(run, end_tick, share):
    """A shadow of the run's stack, compared at a share of its instructions."""
    shadow = Shadow(run.image, share)
    attach(run.cpu, shadow)
    run.to(end_tick)
    return shadow


def assembled(source):
    """A run of a program in assembler on the bare processor."""
    from tests.mirotwin.verify.firmwares import image

    return InspectedRun(Alone(image(source), stop_on_fault=False).world)


def compiled(folder, source, *options):
    """A run of a C program, built by SDCC."""
    target = Path(folder) / f"{source.stem}{''.join(options)}.ihx"
    children.run(["sdcc", "-mmcs51", "--debug", *options, str(source), "-o", str(target)], check=True)
    return InspectedRun(Alone(load_hex(target, limit=65536), stop_on_fault=False).world)


def arguments(run, end_tick):
    """{function and parameter: how many calls}, and [(function, parameter, cycle, value)] where the value of an
    argument at the entry is not that at its home, where the debug file puts it, once the function has brought it there.

    What is passed on from the registers at once has no home.
    """
    debugger = debugger_of(run)
    calls, wrong, due = {}, [], []
    homes = {}
    for function in debugger.symbols.debug.functions:
        places = debugger.symbols.local_places(function)
        for one in places.parameters:
            there = debugger.symbols.variables.by_name.get(one.name, ())
            memory = next((each for each in there if each.scope == places.name), None)
            registers = tuple(int(name[1]) for name in one.registers)
            home = registers or ((memory.address, memory.address + 1)[: one.type.size] if memory else ())
            argument = places.argument
            arrives = argument is not None and argument.name == one.name
            after = argument.prologue[-1] if arrives else function.first
            if home and (not arrives or places.is_brought(argument)):
                homes.setdefault(function.first, []).append((one, home, after))

    def ask(core):
        cpu = core.cpu
        for known in [known for known in due if known[0] == cpu.pc]:
            due.remove(known)
            _, name, one, home, found, cycle = known
            data = bytes(cpu.peek_iram(place) for place in home)
            if value_of(one.type, data, {}) != found:
                wrong.append((name, one.name, cycle, found))
        for one, home, after in homes.get(cpu.pc, ()):
            name = debugger.symbols.function(cpu.pc)
            found = content(debugger.moment().locals()[one.name]())
            calls[name, one.name] = calls.get((name, one.name), 0) + 1
            due.append((after, name, one, home, found, cpu.cycles))
            if after == cpu.pc:
                due.pop()
                data = bytes(cpu.peek_iram(place) for place in home)
                if value_of(one.type, data, {}) != found:
                    wrong.append((name, one.name, cpu.cycles, found))
        return None

    places = {*homes, *(after for each in homes.values() for _, _, after in each)}
    with debugger.timeline.interrupted_by(lambda: debugger.timeline.tick >= end_tick):
        debugger.timeline.find({debugger.timeline.focus: Trap(places, ask)})
    return calls, wrong


MOVES = ("continue", "rcontinue", "step", "next", "finish", "stepi", "goto", "near", "break")


def walk(debugger, steps, end_tick, seed):
    """(tick, state) of each stop of a walk forward and back, with breakpoints that come and go."""
    chance = random.Random(seed)
    timeline, places = debugger.timeline, sorted(debugger.symbols.line_begins)
    for _ in range(steps):
        move, back = chance.choice(MOVES), chance.random() < 0.6 or timeline.tick >= end_tick
        if move == "break":
            debugger.breakpoints.clear()
            address = chance.choice(places)
            debugger.add(f"{address:#x}", chance.choice(["", "R7 > 3", "tick % 7 == 0"]))
        elif move.endswith("continue"):
            debugger.move(move)
        elif move == "goto":
            debugger.go_to(chance.randrange(end_tick))
        elif move == "near":
            debugger.go_to(min(max(timeline.tick + chance.randrange(-50_000, 50_000), 0), end_tick))
        elif move != "finish" or len(debugger.frames()) > 1:
            over = move == "stepi" and chance.random() < 0.5
            debugger.move(f"{'r' if back else ''}{'next' if over else move}", move == "stepi")
        yield timeline.tick, timeline.state()


RESET_ENDS = range(35_280, 35_592)
"""The chips' HI after their first reset: when the processor is told of it depends on how a run is cut."""


def differences(stops, unbroken):
    """The ticks of stops whose state a run that goes straight on does not have."""
    found = []
    for tick, state in sorted(stop for stop in stops if stop[0] not in RESET_ENDS):
        unbroken.to(tick)
        if unbroken.world.state.save() != state:
            found.append(tick)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--writers", type=int, default=1000)
    parser.add_argument("--stacks", type=int, default=100_000, help="of each firmware")
    parser.add_argument("--steps", type=int, default=10_000, help="of the walk")
    given = parser.parse_args()
    begun = time.process_time()
    wrong, asked = wrong_writers(24_000, 2_400_000, given.writers)
    print(
        f"last writers: {given.writers} asked, {asked} of them with one in the window; {len(wrong)} wrong {wrong[:5]}"
    )
    bad = bool(wrong)
    calls, wrong = arguments(robot_run(), SECOND)
    print(f"arguments: {len(calls)} at {sum(calls.values())} entries, {len(wrong)} wrong {wrong[:5]}")
    bad |= bool(wrong)
    with tempfile.TemporaryDirectory() as folder:
        runs = {
            "the robot's own": robot_run("sine"),
            "SDCC's mix.c": compiled(folder, MIX),
            "SDCC's library": compiled(folder, LIBRARY),
            "SDCC's library with --stack-auto": compiled(folder, LIBRARY, "--stack-auto"),
            "assembler": assembled(ASM),
        }
        for name, run in runs.items():
            shadow = stacks(run, 10_000, 0.0)
            end_tick = 10_000
            shadow.share = 0.5
            while shadow.compared < given.stacks and not run.over:
                end_tick += 2_400_000
                run.to(end_tick)
            print(f"stacks of {name}: {shadow.compared} compared, {len(shadow.wrong)} wrong")
            bad |= bool(shadow.wrong)
    debugger = debugger_of(robot_run())
    wrong = differences(walk(debugger, given.steps, 2 * SECOND, 0), robot_run())
    debugger.go_to(debugger.timeline.run.end_tick)
    golden = debugger.timeline.run.world.digest == golden_digest("fig6 6 s seed 7")
    print(f"{given.steps} steps: {len(wrong)} states differ; the digest at the end is golden: {golden}")
    bad |= bool(wrong) or not golden
    print(f"{time.process_time() - begun:.1f} s of processor time")
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
