"""What the debugger costs, in processor milliseconds: `python -m benchmarks.debugger`; `--seconds 2` is quicker.

Medians and worst values, beside the targets. What goes through the Debug Adapter Protocol is measured with the adapter
in this process, wire and JSON included; opening a recording is the wall time of a process.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from miro_exact.clock import TICKS_PER_SECOND
from miro_robot.firmware import source_folder
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.debug.adapter import Adapter
from mirotwin.debug.debugger import Debugger
from mirotwin.debug.symbols import Symbols
from mirotwin.debug.timeline import Timeline
from mirotwin.debug.wire import Wire
from mirotwin.runs.inspected_run import InspectedRun
from mirotwin.shell.firmware_image import load_firmware

ROUNDS = 40
SIX = Path(__file__).parents[1] / "examples" / "two_teams.toml"


def run_of(scenario: str, seconds: float) -> InspectedRun:
    """A run at its start; the circle goes on as long as is needed."""
    text = load(scenario, [f"duration_s={seconds + 0.5}"] if scenario == "curve" else [])
    return InspectedRun(World(text.scenario, 0, load_firmware()))


def debugger_of(run: InspectedRun, everyone: bool = True) -> Debugger:
    """At the start of `run`, with the sources of the robot's own firmware."""
    folder = source_folder()
    assert folder is not None
    return Debugger(Timeline(run), Symbols(run.image, [folder]), everyone)


def cpu_ms(call: Callable[[], object]) -> float:
    """Processor milliseconds that a call takes."""
    begin = time.process_time()
    call()
    return 1000.0 * (time.process_time() - begin)


class Editor:
    """A client in this process: its requests go through wire and JSON."""

    def __init__(self, debugger: Debugger) -> None:
        source, self.requests = os.pipe()
        self.answers = io.BytesIO()
        wire = Wire(os.fdopen(source, "rb"), self.answers)
        self.adapter = Adapter(wire)
        self.adapter.use(debugger)
        self.seq = 0

    def ask(self, command: str, **given: Any) -> None:
        """One request, and all that comes of it."""
        self.seq += 1
        data = json.dumps(
            {"seq": self.seq, "type": "request", "command": command, "arguments": given}
        ).encode()
        os.write(self.requests, b"Content-Length: %d\r\n\r\n%b" % (len(data), data))
        request = self.adapter.wire.next()
        assert request is not None
        self.adapter.answer(request)
        if self.adapter.run_after is not None:
            run, self.adapter.run_after = self.adapter.run_after, None
            run()

    def line_back(self) -> None:
        """What an editor asks when its user steps back: the step, then the stack, scopes and locals."""
        self.ask("stepBack", threadId=1)
        self.ask("stackTrace", threadId=1)
        self.ask("scopes", frameId=1)
        self.ask("variables", variablesReference=1)


def steps(debugger: Debugger, seconds: float) -> tuple[list[float], list[float], list[float]]:
    """(line back through the protocol, instruction back, going to a tick) at random moments."""
    editor, chance = Editor(debugger), random.Random(1)
    lines, instructions, places = [], [], []
    for _ in range(ROUNDS):
        tick = chance.randrange(int(0.2 * TICKS_PER_SECOND), int(seconds * TICKS_PER_SECOND))
        places.append(cpu_ms(lambda tick=tick: debugger.timeline.go_to(tick)))  # type: ignore[misc]
        instructions += [cpu_ms(lambda: debugger.move("rstepi")) for _ in range(5)]
        lines += [cpu_ms(editor.line_back) for _ in range(5)]
    return lines, instructions, places


def plain_ratio(scenario: str, seconds: float) -> float:
    """A run under the debugger with a breakpoint that is never hit, over the plain loop: medians, interleaved."""
    plain, debugged = [], []
    for _ in range(5):
        bare, debugger = run_of(scenario, seconds), debugger_of(run_of(scenario, seconds))
        assert bare.end_tick is not None
        plain.append(cpu_ms(partial(bare.to, bare.end_tick)))
        debugger.add("0x1fff")
        debugged.append(cpu_ms(partial(debugger.move, "continue")))
    return median(debugged) / median(plain)


def opened_s() -> float:
    """Wall seconds from the shell to a recording that stands at 2.1 s."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-c", "from mirotwin.commands import main; main()"]
        subprocess.run([*words, "run", "fig6", "--out", f"{folder}/r", "-q"], check=True)
        begin = time.monotonic()
        opens = [*words, "debug", f"{folder}/r", "--at", "2.1s", "-x", "where"]
        subprocess.run(opens, check=True, stdout=subprocess.DEVNULL)
        return time.monotonic() - begin


def show(what: str, measured: Sequence[float], target: str, unit: str = "ms") -> None:
    """One line of the table."""
    worst = f", worst {max(measured):.2f}" if len(measured) > 1 else ""
    print(f"{what:58} {median(measured):8.2f} {unit}{worst:16} target {target}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the searches")
    seconds = parser.parse_args().seconds
    for scenario, robots, factor in (("curve", "one robot", 1), (str(SIX), "six robots", 3)):
        run = run_of(scenario, seconds)
        assert run.end_tick is not None
        length = min(seconds, run.end_tick / TICKS_PER_SECOND - 0.1)
        debugger = debugger_of(run)
        end = int(length * TICKS_PER_SECOND)
        debugger.timeline.go_to(end)
        lines, instructions, places = steps(debugger, length)
        show(f"{robots}: a line back through the protocol", lines, "50 ms")
        show(f"{robots}: an instruction back", instructions, f"{5 * factor} ms")
        show(f"{robots}: to a random tick", places, "-")
        debugger.timeline.go_to(end)
        debugger.add("0x1fff")
        back = [cpu_ms(lambda one=debugger: one.move("rcontinue"))]  # type: ignore[misc]
        show(f"{robots}: reverse-continue over {length:.1f} s without a hit", back, f"{1000 * factor} ms")
        debugger.breakpoints.clear()
        debugger.timeline.go_to(end)
        place = debugger.bytes_of("frames_stale")
        writer = [cpu_ms(lambda one=debugger, it=place: one.last_writer(it))]  # type: ignore[misc]
        show(f"{robots}: the last writer over {length:.1f} s", writer, f"{1000 * factor} ms")
        show(f"{robots}: checkpoints", [debugger.timeline.kept_bytes / (1 << 20)], "16 MB", "MB")
        show(
            f"{robots}: under the debugger over the plain loop", [plain_ratio(scenario, length)], "1.1", "x "
        )
    show("a recording open at 2.1 s, from the shell (wall)", [1000.0 * opened_s()], "2000 ms")


if __name__ == "__main__":
    main()
