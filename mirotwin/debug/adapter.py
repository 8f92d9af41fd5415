"""The Debug Adapter Protocol: what editors ask, answered from a debugger.

A thread is a robot; all stop together, and the others stand at boundaries of their own. A step back is a line, over
calls. Lines of output stand at their place in the source and begin with the time that `goto` takes in the debug
console, where all verbs of the line console work.
"""

from __future__ import annotations

import base64
import bisect
import re
import secrets
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import partial
from operator import attrgetter
from pathlib import PureWindowsPath as AnyPath
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput, one_line
from miro_exact.clock import CYCLE_TICKS
from miro_robot.faults import DESCRIPTIONS, FaultKind
from miro_robot.image.c_types import CType
from miro_robot.inspect.writes import Bytes
from miro_robot.mcs51.opcodes import SFRS
from mirotwin.debug.board_values import GROUPS, value_on
from mirotwin.debug.debugger import ACCESSES, STEPPED, Breakpoint, Debugger
from mirotwin.debug.expression import Term, Value, children, content, expression
from mirotwin.debug.looking import SHOWN_REGISTERS
from mirotwin.debug.session import Session
from mirotwin.debug.shown import quoted, shown_value, text_in
from mirotwin.debug.subject import launched, open_subject
from mirotwin.debug.symbols import SIZES, Moment
from mirotwin.debug.verbs import completions, do, is_command
from mirotwin.debug.wire import Message, Wire

CAPABILITIES = (
    "ConfigurationDoneRequest", "FunctionBreakpoints", "ConditionalBreakpoints", "HitConditionalBreakpoints",
    "LogPoints", "StepBack", "SteppingGranularity", "InstructionBreakpoints", "DataBreakpoints", "DisassembleRequest",
    "ReadMemoryRequest", "EvaluateForHovers", "TerminateRequest", "CompletionsRequest", "SetVariable",
    "ExceptionInfoRequest", "GotoTargetsRequest", "RestartRequest", "BreakpointLocationsRequest",
)  # fmt: skip
_WITHOUT_A_RUN = ("initialize", "launch", "disconnect", "terminate")
_WHILE_IT_RUNS = (
    "threads", "setBreakpoints", "setFunctionBreakpoints", "setInstructionBreakpoints", "setDataBreakpoints",
    "setExceptionBreakpoints", "dataBreakpointInfo", "disconnect", "terminate",
)  # fmt: skip
_MOVES = {
    "continue": "continue", "reverseContinue": "rcontinue", "next": "next", "stepBack": "rnext", "stepIn": "step",
    "stepOut": "finish",
}  # fmt: skip
_QUIET = (
    "completions", "dataBreakpointInfo", "disassemble", "evaluate", "readMemory", "scopes", "stackTrace", "threads",
    "variables",
)  # fmt: skip
"""Requests that an editor sends on its own, or whose result it shows in place: their failure must not open a window."""
_MOST_FRAMES = 1000
_MOST_LOG, _MOST_TERMS = 4096, 32  # characters and expressions of a message
_IN_BRACES = re.compile(r"\{([^{}]*)\}")
_PLACE = re.compile(r"(iram|sfr|xram|code):([0-9]{1,5}):([0-9]{1,5})(?::([0-9]{1,20}))?")
_PATH = re.compile(r"(?:(\w+):)?([A-Za-z_]\w*)((?:\.\w+|\[[0-9]{1,6}\])*)")
_REASONS = {
    "breakpoint": "breakpoint", "begin": "entry", "case": "exception", "firmware": "exception", "goto": "goto",
    "step": "step",
}  # fmt: skip
"""By the first word of why it stopped; "pause" for any other."""
_PATIENCE_S, _PROGRESS_S = 1.0, 0.5  # before something is said to be under way, and between two updates
_FIXED = "cannot be set: a run is bits, and with another value it would be another run"
_INSTEAD = "values of a board's parts can be put; change the program, or its input, and restart"
_UNUSABLE = (AttributeError, LookupError, TypeError, ValueError)  # what comes of arguments of another form
Shown = Callable[[], Value]


class Adapter:
    """One client. `token`: it has to be in its launch, before which nothing is served; "" where none is needed."""

    def __init__(self, wire: Wire, token: str = "") -> None:
        self.wire = wire
        self.token = token
        self.its: Debugger
        self.session: Session
        self.began = False
        self.children: list[tuple[dict[str, Shown], str]] = []
        self.paused = self.ended = False
        self.run_after: Callable[[], object] | None = None
        self.begin: Callable[[], object] = lambda: None
        self.launched: Message = {}
        self.asked: dict[str, tuple[Message, Callable[[Message], str], list[int | None]]] = {}
        self.why, self.notes = "", list[str]()
        self.shows_progress = False
        self.progress_at_s, self.progress = 0.0, 0

    def serve(self) -> None:
        """Until the client leaves. Raises BadInput for what is no message, OSError where it has gone."""
        while not self.ended and (request := self.wire.next()) is not None:
            self.answer(request)
            while self.run_after is not None:
                # After the response: a `stopped` before the answer to `continue` would be dropped.
                run, self.run_after = self.run_after, None
                run()

    def answer(self, request: Message) -> None:
        command = request["command"]
        handler = getattr(self, f"on_{command}", None)
        if command in _MOVES:
            handler = partial(self._move, command)
        try:
            if handler is None:
                raise BadInput("", command, "is not answered by this debugger")
            if not self.began and command not in _WITHOUT_A_RUN:
                raise BadInput("", command, "there is no run yet", "send launch first")
            body = handler(request["arguments"])
        except BadInput as error:
            self._respond(request, refused=str(error))
        except OSError as error:
            self._respond(request, refused=f"{error.filename or command}: {error.strerror}")
        except _UNUSABLE as error:
            self._respond(request, refused=f"{command}: arguments that cannot be used: {error!r}")
        else:
            self._respond(request, body)
            # The client sends its breakpoints at this event: there has to be a run by then.
            if command == "launch":
                self._event("initialized")

    def _respond(self, request: Message, body: Message | None = None, refused: str = "") -> None:
        message: Message = {"request_seq": request["seq"], "command": request["command"]}
        if refused:
            why = one_line(refused)
            # Braces in a format are the protocol's own: the client would look for variables in them.
            text = why.replace("{", "(").replace("}", ")")
            body = {"error": {"id": 1, "format": text, "showUser": request["command"] not in _QUIET}}
            message["message"] = why
        self.wire.send({"type": "response", "success": not refused, **message, "body": body})

    def _event(self, event: str, **body: Any) -> None:
        self.wire.send({"type": "event", "event": event, "body": body or None})

    # The session

    def on_initialize(self, given: Message) -> Message:
        if given.get("linesStartAt1") is False:
            raise BadInput("", "initialize", "lines begin with 1 here")
        self.shows_progress = bool(given.get("supportsProgressReporting"))
        filters = [
            {
                "filter": kind.name,
                "label": DESCRIPTIONS[kind],
                "default": True,
                "description": "a firmware fault",
            }
            for kind in FaultKind
        ]
        return {f"supports{capability}": True for capability in CAPABILITIES} | {
            "exceptionBreakpointFilters": filters
        }

    def on_launch(self, given: Message) -> None:
        if (
            not secrets.compare_digest(str(given.get("token") or "").encode(), self.token.encode())
            and self.token
        ):
            raise BadInput(
                "", "launch", "the token is not the one that was printed", 'add "token" to launch.json'
            )
        self._open(given)

    def _open(self, given: Message) -> None:
        debugger, notes, why = open_subject(launched(given), everyone=True, interrupted=self._interrupted)
        self.launched = given
        self.use(debugger)

        self.notes = notes

        def begin() -> None:
            for line in notes:
                self._event("output", category="important", output=line + "\n")
            if given.get("stopOnEntry", True) is False:
                self._go("continue", False)
            else:
                self._stopped(self._at_first_line(why), "\n".join(notes))

        self.begin = begin

    def _at_first_line(self, why: str) -> str:
        """Goes on from reset to the first line of C: an editor shows nothing of what is before. Why it stopped."""
        if why != "begin" or self.timeline.tick or not self.symbols.line_begins:
            return why
        reason = self.its.move("step")
        return why if reason == STEPPED else reason

    def use(self, debugger: Debugger) -> None:
        """From now on it answers for this one."""
        self.its = debugger
        self.symbols = debugger.symbols
        self.timeline = debugger.timeline
        self.timeline.interrupted = self._interrupted
        self.session = Session(debugger)
        self.began = True

    def on_configurationDone(self, given: Message) -> None:
        self.run_after = self.begin

    def on_disconnect(self, given: Message) -> None:
        self.paused = self.ended = True

    def on_restart(self, given: Message) -> None:
        """Starts the subject again, with the image as it is now. Breakpoints are set again by their names."""
        asked, kinds = self.asked, self.its.fault_kinds
        self._open(given.get("arguments") or self.launched)
        self.its.fault_kinds = kinds
        for kind, (items, place, numbers) in asked.items():
            replies = self._set(kind, items, place)["breakpoints"]
            made = {point.number: point for point in self.its.breakpoints}
            for reply, number in zip(replies, numbers, strict=True):
                if number is not None and reply["verified"]:
                    made[reply["id"]].number = number  # as the client knows it
                if number is not None:
                    self._event("breakpoint", reason="changed", breakpoint={**reply, "id": number})
            self.asked[kind] = items, place, numbers
        self.its.number_from(
            max((number or 0 for _, _, all_of in asked.values() for number in all_of), default=0)
        )
        self.run_after = self.begin

    def on_terminate(self, given: Message) -> None:
        self.paused = True
        self.run_after = partial(self._event, "terminated")

    # Breakpoints

    def on_setBreakpoints(self, given: Message) -> Message:
        path = given["source"].get("path") or given["source"].get("name") or ""
        return self._set(f"breakpoint in {path}", given, lambda item: f"{path}:{item['line']:d}")

    def on_setFunctionBreakpoints(self, given: Message) -> Message:
        return self._set("function breakpoint", given, lambda item: item["name"])

    def on_setInstructionBreakpoints(self, given: Message) -> Message:
        def place(item: Message) -> str:
            return f"{int(item['instructionReference'], 16) + item.get('offset', 0):#x}"

        return self._set("instruction breakpoint", given, place)

    def on_setDataBreakpoints(self, given: Message) -> Message:
        return self._set("data breakpoint", given, lambda item: item["dataId"])

    def on_setExceptionBreakpoints(self, given: Message) -> Message:
        names = [
            *(given.get("filters") or ()),
            *(option["filterId"] for option in given.get("filterOptions") or ()),
        ]
        known = [name in FaultKind.__members__ for name in names]
        self.its.fault_kinds = {FaultKind[name] for name in names if name in FaultKind.__members__}
        return {"breakpoints": [{"verified": is_known} for is_known in known]}

    def on_exceptionInfo(self, given: Message) -> Message:
        """The firmware fault or the case's failed check at the present moment."""
        if _REASONS.get(self.why.partition(" ")[0]) != "exception":
            raise BadInput("", "exceptionInfo", "it does not stand at a fault or a failed check")
        kind = next((kind.name for kind, words in DESCRIPTIONS.items() if words in self.why), "failed check")
        text = "\n".join(self.notes) if self.why == "case" else self.why
        return {"exceptionId": kind, "description": text, "breakMode": "always"}

    def on_breakpointLocations(self, given: Message) -> Message:
        """The lines with code from `line` to `endLine`."""
        name = AnyPath(given["source"].get("path") or given["source"].get("name") or "").name
        wanted = range(given["line"], (given.get("endLine") or given["line"]) + 1)
        there = {
            begin.line for begin in self.symbols.line_begins.values() if AnyPath(begin.file).name == name
        }
        return {"breakpoints": [{"line": line} for line in sorted(there.intersection(wanted))]}

    def on_gotoTargets(self, given: Message) -> Message:
        """The next execution of a line: the run continues to it, because no instruction can be skipped."""
        path = given["source"].get("path") or given["source"].get("name") or ""
        addresses, line = self.symbols.at_line(path, given["line"])
        return {
            "targets": [
                {"id": address, "label": f"on to {self.symbols.place(address)}", "line": line.line,
                 "instructionPointerReference": f"{address:#06x}"}
                for address in addresses
            ]
        }  # fmt: skip

    def on_goto(self, given: Message) -> None:
        address = int(given["targetId"])
        self.timeline.focus = self._thread(given)

        def run() -> None:
            why = self.its.run_to([address])
            self._stopped("goto" if why == STEPPED else why)

        self.run_after = partial(self._watched_run, run)

    def _set(self, kind: str, given: Message, place: Callable[[Message], str]) -> Message:
        """All breakpoints of a kind, which replace those before."""
        self.its.breakpoints[:] = [item for item in self.its.breakpoints if item.kind != kind]
        self.asked[kind] = given, place, []
        # A run that is under way goes on searching with the new ones.
        self.its.changed = True
        replies: list[Message] = []
        numbers: list[int | None] = []
        for item in given.get("breakpoints") or ():
            # One for each requested, even if it fails: the client matches replies by order.
            numbers.append(None)
            conditions = item.get("condition") or "", item.get("hitCondition") or ""
            try:
                where = place(item)
                log = _logged(item["logMessage"]) if item.get("logMessage") else None
                if kind == "data breakpoint":
                    made = self._watched(where, *conditions, item.get("accessType") or "write")
                else:
                    made = self.its.add(where, *conditions)
            except _UNUSABLE as error:
                replies.append({"verified": False, "message": str(error)})
                continue
            made.kind, made.log = kind, log
            numbers[-1] = made.number
            reply: Message = {"verified": True, "id": made.number, "message": made.note or None}
            if made.watched is None:
                first = min(made.addresses)
                line = self.symbols.line(first)
                reply |= {
                    "instructionReference": f"{first:#06x}",
                    "line": None if line is None else line.line,
                }
            replies.append(reply)
        self.asked[kind] = given, place, numbers
        return {"breakpoints": replies}

    def _watched(self, data: str, condition: str, count: str, access: str) -> Breakpoint:
        """A data breakpoint by its `dataId`: a name, or for what has none the place in this run."""
        if access not in ACCESSES:
            raise ValueError(f"{access} is no access: give {', '.join(ACCESSES)}")
        if place := _PLACE.fullmatch(data):
            value = Value(CType("int", int(place[3])), place[1], int(place[2]))
            whole = self.its.bytes_of(data, value, read=access != "write")
            mask = -1 if place[4] is None else int(place[4])
            return self.its.watch(data, condition, count, whole.bits(mask), access)
        parts = _PATH.fullmatch(data)
        if parts is None or self._moment(None).scope_of(parts[2], parts[1] or "") is None:
            raise BadInput("", data, "is no variable of this firmware")
        return self.its.watch(data, condition, count, access=access)

    def on_dataBreakpointInfo(self, given: Message) -> Message:
        name = given["name"]
        moment = self._moment(given.get("frameId"))
        try:
            if given.get("variablesReference"):
                values, path = self.children[given["variablesReference"] - 1]
                value, path = values[name](), _joined(path, name)
            else:
                value, path = expression(name)(moment), name
            written = self.its.bytes_of(name, value, read=True)
        except BadInput as error:
            return {"dataId": None, "description": str(error)}
        data = self._named(path, moment, written)
        keeps = bool(data)  # a name finds its variable after a build too; a place is another variable's then
        size = written.end - written.first
        bits = "" if written.is_whole else f":{written.mask}"
        data = data or f"{written.space}:{written.first}:{size}{bits}"
        return {
            "dataId": data,
            "description": f"before {name} is accessed",
            "accessTypes": ["read"] if written.space == "code" else [*ACCESSES],
            "canPersist": keeps,
        }

    def _named(self, path: str, moment: Moment, written: Bytes) -> str:
        """A name that is valid in all functions and files; "" if there is none."""
        parts = _PATH.fullmatch(path)
        with suppress(BadInput):
            if parts is not None and (scope := moment.scope_of(parts[2], parts[1] or "")) is not None:
                name = f"{scope}:{parts[2]}{parts[3]}" if scope else parts[2] + parts[3]
                if self.its.bytes_of(name, read=True).same(written):
                    return name
        return ""

    # Running

    def _move(self, command: str, given: Message) -> Message | None:
        thread = self._thread(given)
        # All go on by `continue`; a step is of the robot that was chosen, and begins where that one stands.
        if thread != self.timeline.focus and not _MOVES[command].endswith("continue"):
            self.timeline.focus = thread
            self.timeline.go_to(self.timeline.tick)
        by_instruction = given.get("granularity") == "instruction"
        self.run_after = partial(self._go, _MOVES[command], by_instruction)
        return {"allThreadsContinued": True} if command == "continue" else None

    def on_pause(self, given: Message) -> None:
        self.paused = True
        # A pause between `continue` and its run must not replace the run.
        self.run_after = self.run_after or partial(self._stopped, "interrupted")

    def _thread(self, given: Message) -> int:
        threads, number = range(1, len(self.timeline.cores) + 1), given["threadId"]
        if number not in threads:
            raise BadInput("", f"thread {number}", "there is no such robot")
        return threads.index(number)

    def _watched_run(self, run: Callable[[], object]) -> None:
        """Runs a function that may take long; after a second it is reported as running."""
        self.paused = False
        self.progress_at_s = time.monotonic() + _PATIENCE_S
        try:
            run()
        finally:
            self.progress_at_s = 0.0
            if self.progress > 0:
                self._event("progressEnd", progressId=str(self.progress))
            # Negative: none is shown. The number stays, because the next one needs another.
            self.progress = -abs(self.progress)

    def _tell_progress(self) -> None:
        """Reports the position in the run and its length."""
        now_s = time.monotonic()
        if not self.shows_progress or not self.progress_at_s or now_s < self.progress_at_s:
            return
        end_tick = self.timeline.run.end_tick
        share = min(100.0 * self.timeline.tick / end_tick, 100.0) if end_tick else None
        event = "progressUpdate" if self.progress > 0 else "progressStart"
        self.progress = self.progress if self.progress > 0 else 1 - self.progress
        title = {"title": "running"} if event == "progressStart" else {}
        text = self.session.time(self.timeline.tick, self.timeline.focus).strip()
        self._event(event, progressId=str(self.progress), message=text, percentage=share, **title)
        self.progress_at_s = now_s + _PROGRESS_S

    def _go(self, verb: str, by_instruction: bool) -> None:
        self._watched_run(partial(self._move_and_say, verb, by_instruction))

    def _move_and_say(self, verb: str, by_instruction: bool) -> None:
        try:
            why = self.its.move(verb, by_instruction)
        except BadInput as error:
            self._event("output", category="stderr", output=f"{error}\n")
            why = "step"
        for cycle, core, text, address in self.its.log_outputs:
            begin = self.session.time(cycle * CYCLE_TICKS, core)
            self._event(
                "output", category="console", output=f"{begin}{text}\n", **self._place(address, "source")
            )
        self.its.log_outputs.clear()
        self._stopped(why)

    def _interrupted(self) -> bool:
        """Answers requests that come during a run; True if one ends the run."""
        if self.began:
            self._tell_progress()
        # {}: nothing has come; None: the client has gone, and the run must not go on without it.
        while not self.paused and (request := self.wire.next(wait=False)) != {}:
            if request is None:
                self.paused = True
            elif request["command"] == "pause":
                self.paused = True
                self._respond(request)
            elif request["command"] in _WHILE_IT_RUNS:
                self.answer(request)
            else:
                # What looks at memory or moves would do so in the middle of a search.
                self._respond(request, refused="the run is under way: pause it first")
        return self.paused

    def _stopped(self, why: str, text: str = "") -> None:
        self.why = why
        word, _, digits = why.partition(" ")
        number = int(digits) if word == "breakpoint" else 0
        kind = next(
            (breakpoint.kind for breakpoint in self.its.breakpoints if breakpoint.number == number), ""
        )
        # References of the last stop lead to values of another moment; the protocol lets them end here.
        self.children.clear()
        self._event(
            "stopped",
            reason=kind.partition(" in ")[0] or _REASONS.get(word, "pause"),
            description=text or why,
            text=text or (why if _REASONS.get(word) == "exception" else None),
            threadId=self.timeline.focus + 1,
            allThreadsStopped=True,
            hitBreakpointIds=[number] if kind else None,
        )

    # Looking

    def on_threads(self, given: Message) -> Message:
        cores = enumerate(self.timeline.cores, 1)
        return {"threads": [{"id": at, "name": core.name} for at, core in cores]}

    def on_stackTrace(self, given: Message) -> Message:
        thread = self._thread(given)
        frames = self._moment(thread * _MOST_FRAMES + 1).frames()
        replies: list[Message] = []
        for identity, frame in enumerate(frames, thread * _MOST_FRAMES + 1):
            name = self.symbols.function(frame.place) + (" (interrupt)" if frame.by_interrupt else "")
            nowhere = {"line": 0, "column": 0, "presentationHint": "subtle"}
            where = {"column": 1, **place} if (place := self._place(frame.place, "source")) else nowhere
            next_one = f"{frame.pc:#06x}"
            replies.append({"id": identity, "name": name, **where, "instructionPointerReference": next_one})
        if not frames[-1].known:
            label = {"id": 0, "name": "the stack cannot be told from here on", "presentationHint": "label"}
            replies.append({**label, "line": 0, "column": 0})
        # 0 levels are all of them (protocol, StackTraceArguments).
        first = given.get("startFrame") or 0
        last = first + (given.get("levels") or len(replies))
        return {"stackFrames": replies[first:last], "totalFrames": len(replies)}

    def _place(self, address: int, key: str) -> Message:
        """The source and the line of an instruction; nothing where none is known."""
        line = self.symbols.line(address)
        if line is None:
            return {}
        path = self.symbols.sources.path(line.file)
        source = {"name": AnyPath(line.file).name, "path": None if path is None else f"{path.resolve()}"}
        return {key: source, "line": line.line}

    def _moment(self, frame_id: int | None) -> Moment:
        thread, frame = divmod(frame_id - 1, _MOST_FRAMES) if frame_id else (self.timeline.focus, 0)
        try:
            return Moment(self.symbols, self.timeline.cores[thread], frame)
        except IndexError:
            raise BadInput("", f"frame {frame_id}", "is of a moment that is left") from None

    def on_scopes(self, given: Message) -> Message:
        scopes = []
        for title, hint, values in self._scopes(self._moment(given["frameId"])):
            path = title.lower() if title.lower() in GROUPS else ""
            if title.startswith("Statics"):
                path = f"{title.removeprefix('Statics of ').removesuffix('.c')}:"
            reference = {"variablesReference": self._reference_to(values, path), "expensive": False}
            scopes.append({"name": title, "presentationHint": hint, **reference})
        return {"scopes": scopes}

    def _scopes(self, moment: Moment) -> Iterator[tuple[str, str | None, Iterable[tuple[str, Shown]]]]:
        """Title, hint of the protocol, and values."""
        line = self.symbols.line(moment.pc)
        yield "Locals", "locals", moment.locals().items()
        if line is not None:
            file = AnyPath(line.file).stem
            yield f"Statics of {file}.c", None, moment.variables(file).items()
        yield "Globals", "globals", moment.variables("").items()
        for title, names in (("Registers", SHOWN_REGISTERS), ("Special function registers", SFRS)):
            yield title, "registers", [(name, partial(moment.find, name, "")) for name in names]
        if moment.core.board is not None:
            for side, chip in children(moment.find("lm629", "")):
                yield f"LM629 {side}", None, children(chip())
            yield "Radio", None, self._radio()
        for title in GROUPS:
            if group := value_on(moment.core.device.board, title):
                yield title.capitalize(), None, children(group)
        yield "Pins", None, children(moment.find("pins", ""))

    def _reference_to(self, values: Iterable[tuple[str, Shown]], path: str = "") -> int:
        """The reference by which a client requests these until the next stop. `path`: the expression before a name."""
        self.children.append((dict(values), path))
        return len(self.children)

    def _radio(self) -> Iterator[tuple[str, Shown]]:
        """The last frames on the air of this robot's network, the latest first."""
        for event in self.timeline.radio_events()[:-9:-1]:
            text = str(event).partition(": ")[2]
            yield self.session.time(event.tick, 0).split()[0], partial(Value, number=text)

    def on_variables(self, given: Message) -> Message:
        reference = given["variablesReference"]
        if not 0 < reference <= len(self.children):
            raise BadInput("", f"reference {reference}", "is of a moment that is left")
        there, path = self.children[reference - 1]
        shown = [(name, self._shown(get, _joined(path, name))) for name, get in there.items()]
        return {"variables": [{"name": name, **value} for name, value in shown]}

    def on_setVariable(self, given: Message) -> Message:
        """A value of a part is put; nothing else of a run can be set."""
        whole = _joined(self.children[given["variablesReference"] - 1][1], given["name"])
        path = whole.removeprefix("parts.")
        if path == whole:
            raise BadInput("", given["name"], _FIXED, _INSTEAD)
        value = given["value"]
        with suppress(msgspec.DecodeError):
            value = msgspec.json.decode(value)
        try:
            tick = self.timeline.put(path, value)
        except ValueError as error:
            reason, _, remedy = f"{error}".partition("; ")
            raise BadInput("", "", reason, remedy) from None
        return {"value": f"{given['value']}   (from tick {tick} on)"}

    def on_setExpression(self, given: Message) -> None:
        raise BadInput("", given["expression"], _FIXED, _INSTEAD)

    def on_writeMemory(self, given: Message) -> None:
        raise BadInput("", given["memoryReference"], _FIXED, _INSTEAD)

    def _shown(self, get: Shown, path: str, key: str = "value") -> Message:
        """A value; one that is not live says so in its place."""
        try:
            value = get()
            whole = content(value)
        except BadInput as error:
            return {key: str(error), "variablesReference": 0}
        inner = children(value)
        text = shown_value(whole) if not inner or isinstance(whole, int) else str(value.kind or "")
        if inside := text_in(value):
            text += f" {quoted(inside)}"
        place = None
        if isinstance(value.moment, Moment) and value.space in SIZES:
            thread = self.timeline.cores.index(value.moment.core)
            place = f"{thread}:{value.space}:{value.address:#x}"
        return {
            key: text + (f"   ({value.note})" if value.note else ""),
            "variablesReference": self._reference_to(inner, path) if inner else 0,
            "type": None if value.kind is None else str(value.kind),
            "memoryReference": place,
        }

    def on_evaluate(self, given: Message) -> Message:
        text = given["expression"].strip()
        if given.get("context") != "repl" or not is_command(text, self.symbols.known):
            value = expression(text)(self._moment(given.get("frameId")))
            return self._shown(lambda: value, text, "result")
        # A command of the console may delete what the editor has set: its red dot has to go, too.
        there = self.its.breakpoints[:]
        self._watched_run(partial(do, self.session, text))
        for breakpoint in there:
            if breakpoint.kind and breakpoint not in self.its.breakpoints:
                self._event(
                    "breakpoint", reason="removed", breakpoint={"id": breakpoint.number, "verified": False}
                )
        if self.session.why:
            self.run_after = partial(self._stopped, self.session.why)
        if self.session.ended:
            self.on_terminate(given)
        return {"result": "\n".join(self.session.lines), "variablesReference": 0}

    def on_completions(self, given: Message) -> Message:
        text = given["text"][: given["column"] - 1]
        first, words = completions(self.session, text)
        where = (
            {}
            if text[first:].isidentifier() or first == len(text)
            else {"start": first + 1, "length": len(text) - first}
        )
        return {"targets": [{"label": word, **where} for word in words]}

    def on_readMemory(self, given: Message) -> Message:
        # Instructions have an address alone; variables say thread and memory too.
        thread, space, place = ["0", "code", *given["memoryReference"].split(":")][-3:]
        moment = Moment(self.symbols, self.timeline.cores[int(thread)])
        first = int(place, 16) + (given.get("offset") or 0)
        begin, end = max(first, 0), min(first + given["count"], SIZES[space])
        data = moment.read(space, begin, end - begin) if begin < end else b""
        text, missing = base64.b64encode(data).decode(), given["count"] - len(data)
        return {"address": f"{begin:#x}", "data": text, "unreadableBytes": missing or None}

    def on_disassemble(self, given: Message) -> Message:
        address = int(given["memoryReference"], 16) + (given.get("offset") or 0)
        first = bisect.bisect_left(self.symbols.listing, address, key=attrgetter("address"))
        first += given.get("instructionOffset") or 0
        wanted = range(first, first + min(given["instructionCount"], SIZES["code"]))
        return {"instructions": [self._instruction(index) for index in wanted]}

    def _instruction(self, index: int) -> Message:
        if not 0 <= index < len(self.symbols.listing):
            address = "0x0000" if index < 0 else "0xffff"
            return {"address": address, "instruction": "no code", "presentationHint": "invalid"}
        row = self.symbols.listing[index]
        place = {} if row.line is None else self._place(row.address, "location")
        data = {"instructionBytes": row.data.hex(" "), "instruction": row.text}
        return {"address": f"{row.address:#06x}", **data, **place}


def _joined(path: str, name: str) -> str:
    """The expression for a member or an element of `path`, or for a name after a scope."""
    return f"{path}{name}" if not path or path.endswith(":") or name.startswith("[") else f"{path}.{name}"


def _logged(text: str) -> Callable[[Moment], str]:
    """A message with its `{expressions}` as values. Raises NoValue."""
    names = set(_IN_BRACES.findall(text[: _MOST_LOG + 1]))
    if len(text) > _MOST_LOG or len(names) > _MOST_TERMS:
        most = f"give {_MOST_LOG} characters and {_MOST_TERMS} expressions at most"
        raise BadInput("", "message", "is too long", most)
    terms = {name: expression(name) for name in names}

    def value(term: Term, moment: Moment) -> str:
        try:
            return shown_value(content(term(moment)))
        except BadInput as error:
            return f"<{error}>"

    return lambda moment: _IN_BRACES.sub(lambda match: value(terms[match[1]], moment), text)
