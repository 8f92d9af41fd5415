"""The Debug Adapter Protocol: what editors ask, answered from a debugger.

A thread is a robot; all stop together, and the others stand at boundaries of their own. A step back is a line, over
calls. Lines of output stand at their place in the source and begin with the time that `goto` takes in the debug
console, where all verbs of the line console work.
"""

from __future__ import annotations

import base64
import bisect
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from miro_exact.bad_input import BadInput, one_line
from miro_exact.clock import CYCLE_TICKS
from miro_robot.image.c_types import CType
from miro_robot.inspect.frames import StackFrame
from miro_robot.mcs51.names import BITS, SFRS
from miro_robot.mcs51.opcodes import LENGTH, disassemble
from mirotwin.debug.console import Console, shown_value
from mirotwin.debug.debugger import Breakpoint, Debugger
from mirotwin.debug.expression import Value, children, content, expression
from mirotwin.debug.symbols import SIZES, Moment
from mirotwin.debug.wire import Message, Wire

CAPABILITIES = (
    *(
        "ConfigurationDoneRequest",
        "FunctionBreakpoints",
        "ConditionalBreakpoints",
        "HitConditionalBreakpoints",
    ),
    *(
        "LogPoints",
        "StepBack",
        "SteppingGranularity",
        "InstructionBreakpoints",
        "DataBreakpoints",
        "DisassembleRequest",
    ),
    *("ReadMemoryRequest", "EvaluateForHovers", "TerminateRequest", "CompletionsRequest"),
)
_WHILE_IT_RUNS = (
    *(
        "threads",
        "setBreakpoints",
        "setFunctionBreakpoints",
        "setInstructionBreakpoints",
        "setDataBreakpoints",
    ),
    *("setExceptionBreakpoints", "dataBreakpointInfo"),
)
_MOST_FRAMES = 1000
_REGISTERS = (*(f"R{at}" for at in range(8)), "A", "B", "DPTR", "SP", "PSW", "PC", "tick", "cycle")
_REASONS = {"begin": "entry", "case": "exception", "interrupted": "pause", "goto": "goto", "step": "step"}
Children = Callable[[], Sequence[tuple[str, "Value | str | BadInput"]]]


class Adapter:
    """One client. `begin`: opens what `launch` names, and says what there is to say about it first."""

    def __init__(self, wire: Wire, begin: Callable[[Message], tuple[Debugger, list[str], str]]) -> None:
        self.wire = wire
        self.begin = begin
        self.debugger: Debugger | None = None
        self.console: Console | None = None
        self.lines: list[str] = []
        self.first: tuple[list[str], str] = ([], "")
        self.stops_first = True
        self.kinds: dict[str, list[tuple[Breakpoint, str]]] = {}
        self.children: list[Children] = []
        self.paused = self.changed = self.ended = False
        self.run_after: Callable[[], object] | None = None

    def serve(self) -> None:
        """Until the client leaves. Raises BadInput for what is no message, OSError where it has gone."""
        while not self.ended:
            request = self.wire.next()
            if request is None:
                return
            self.answer(request)
            if self.run_after is not None:
                run, self.run_after = self.run_after, None
                run()

    def answer(self, request: Message) -> None:
        command = request["command"]
        handler = getattr(self, f"on_{command}", None)
        try:
            if handler is None:
                raise BadInput("", command, "is not answered by this debugger")
            if self.debugger is None and command not in ("initialize", "launch", "disconnect", "terminate"):
                raise BadInput("", command, "there is no run yet", "send launch first")
            body = handler(request["arguments"])
        except (BadInput, LookupError, TypeError, ValueError) as error:
            what = (
                "" if isinstance(error, BadInput) else f"{command}: arguments that cannot be used: {error!r}"
            )
            self._refuse(request, one_line(what or str(error)))
            return
        self._send(type="response", request_seq=request["seq"], success=True, command=command, body=body)
        if command == "launch":
            self._send(type="event", event="initialized")

    def _refuse(self, request: Message, why: str) -> None:
        body = {"error": {"id": 1, "format": why.replace("{", "(").replace("}", ")"), "showUser": True}}
        known = {"request_seq": request["seq"], "command": request["command"]}
        self._send(type="response", success=False, message=why, body=body, **known)

    def _event(self, event: str, **body: Any) -> None:
        self._send(type="event", event=event, body=_given(body))

    def _send(self, **message: Any) -> None:
        self.wire.send(_given(message))

    @property
    def its(self) -> Debugger:
        assert self.debugger is not None
        return self.debugger

    @property
    def its_console(self) -> Console:
        assert self.console is not None
        return self.console

    # The session

    def on_initialize(self, given: Message) -> Message:
        if given.get("linesStartAt1") is False:
            raise BadInput("", "initialize", "lines begin with 1 here")
        return {f"supports{one}": True for one in CAPABILITIES}

    def on_launch(self, given: Message) -> None:
        self.debugger, said, why = self.begin(given)
        self.first = (said, why)
        self.stops_first = given.get("stopOnEntry", True) is not False
        self.debugger.timeline.interrupted = self._interrupted
        self.console = Console(self.debugger, self.lines.append)

    def on_configurationDone(self, given: Message) -> None:
        self.run_after = self._begin

    def _begin(self) -> None:
        said, why = self.first
        for line in said:
            self._event("output", category="important", output=line + "\n")
        self._stopped(why, "\n".join(said)) if self.stops_first else self._go(lambda: self.its.go_on())

    def on_disconnect(self, given: Message) -> None:
        self.ended = True

    def on_terminate(self, given: Message) -> None:
        self.run_after = partial(self._event, "terminated")

    # Breakpoints

    def on_setBreakpoints(self, given: Message) -> Message:
        path = given["source"].get("path") or given["source"].get("name") or ""
        asked = given.get("breakpoints") or [{"line": line} for line in given.get("lines", ())]

        def make(one: Message) -> tuple[Breakpoint, Message]:
            place = self.its.symbols.at_line(path, one["line"])
            assert place.line is not None
            moved = (
                "the line has no code: the next one that has some" if place.line.line != one["line"] else None
            )
            made = self._add(one, place.addresses)
            return made, {"line": place.line.line, "source": given["source"], "message": moved}

        return self._set(f"breakpoint {path}", "breakpoint", asked, make)

    def on_setFunctionBreakpoints(self, given: Message) -> Message:
        def make(one: Message) -> tuple[Breakpoint, Message]:
            return self._add(one, self.its.symbols.at(one["name"]).addresses), {}

        return self._set("function", "function breakpoint", given["breakpoints"], make)

    def on_setInstructionBreakpoints(self, given: Message) -> Message:
        def make(one: Message) -> tuple[Breakpoint, Message]:
            return self._add(one, [int(one["instructionReference"], 16) + one.get("offset", 0)]), {}

        return self._set("instruction", "instruction breakpoint", given["breakpoints"], make)

    def on_setDataBreakpoints(self, given: Message) -> Message:
        def make(one: Message) -> tuple[Breakpoint, Message]:
            space, address, count = one["dataId"].split(":")
            place = Value(CType("int", int(count)), space, int(address))
            return self.its.watch(
                one["dataId"], one.get("condition", ""), one.get("hitCondition", ""), place
            ), {}

        return self._set("data", "data breakpoint", given["breakpoints"], make)

    def on_setExceptionBreakpoints(self, given: Message) -> Message:
        return {"breakpoints": []}

    def _add(self, one: Message, addresses: Sequence[int]) -> Breakpoint:
        found = self.its.add("", addresses, one.get("condition", ""), one.get("hitCondition", ""))
        if one.get("logMessage"):
            found.log = _logged(one["logMessage"])
        return found

    def _set(
        self,
        key: str,
        reason: str,
        asked: Sequence[Message],
        make: Callable[[Message], tuple[Breakpoint, Message]],
    ) -> Message:
        """All breakpoints of a source or a kind, which replace those before."""
        before = [one for one, _ in self.kinds.get(key, ())]
        self.its.breakpoints[:] = [one for one in self.its.breakpoints if one not in before]
        self.kinds[key] = []
        self.changed = True
        found = []
        for one in asked:
            try:
                made, body = make(one)
            except BadInput as error:
                found.append({"verified": False, "message": str(error)})
                continue
            self.kinds[key].append((made, reason))
            at = min(made.addresses, default=-1) if made.written is None and made.addresses else -1
            where = None if at < 0 else f"{at:#06x}"
            found.append(_given({"verified": True, "id": made.number, "instructionReference": where, **body}))
        return {"breakpoints": found}

    def on_dataBreakpointInfo(self, given: Message) -> Message:
        name = given["name"]
        try:
            value = self._named(given, name)
            written = self.its.bytes_of(name, value)
        except BadInput as error:
            return {"dataId": None, "description": str(error)}
        data, said = (
            f"{written.space}:{written.first}:{written.end - written.first}",
            f"before {name} is written",
        )
        return {"dataId": data, "description": said, "accessTypes": ["write"], "canPersist": True}

    def _named(self, given: Message, name: str) -> Value:
        reference = given.get("variablesReference", 0)
        if reference:
            found = dict(self.children[reference - 1]()).get(name)
            if not isinstance(found, Value):
                raise BadInput("", name, "lies in no memory that can be watched")
            return found
        moment = self._moment(given.get("frameId"))
        return expression(name)(moment)

    # Running

    def on_continue(self, given: Message) -> Message:
        self._focus(given)
        self.run_after = partial(self._go, lambda: self.its.go_on())
        return {"allThreadsContinued": True}

    def on_reverseContinue(self, given: Message) -> None:
        self._focus(given)
        self.run_after = partial(self._go, lambda: self.its.go_on(back=True))

    def _step(self, how: Any, given: Message, back: bool = False) -> None:
        self._focus(given)
        by_instruction = given.get("granularity") == "instruction"
        self.run_after = partial(self._go, lambda: self.its.step(how, back, by_instruction))

    def on_next(self, given: Message) -> None:
        self._step("over", given)

    def on_stepIn(self, given: Message) -> None:
        self._step("into", given)

    def on_stepOut(self, given: Message) -> None:
        self._step("out", given)

    def on_stepBack(self, given: Message) -> None:
        self._step("over", given, back=True)

    def on_pause(self, given: Message) -> None:
        self.paused = True
        self.run_after = self.run_after or partial(self._stopped, "interrupted")

    def _focus(self, given: Message) -> None:
        at = given["threadId"] - 1
        if not 0 <= at < len(self.its.timeline.cores):
            raise BadInput("", f"thread {at + 1}", "there is no such robot")
        if at != self.its.timeline.focus:
            self.its.timeline.focus = at
            self.its.timeline.go_to(self.its.timeline.tick)

    def _go(self, move: Callable[[], str]) -> None:
        self.paused = False
        self.children.clear()
        while True:
            self.changed = False
            try:
                why = move()
            except BadInput as error:
                self._event("output", category="stderr", output=f"{error}\n")
                why = "step"
            for cycle, core, text, address in self.its.told:
                self._output(cycle * CYCLE_TICKS, core, text, address)
            self.its.told.clear()
            if why != "interrupted" or self.paused or not self.changed:
                break
        if not self.ended:
            self._stopped(why)

    def _interrupted(self) -> bool:
        """Answers what comes during a run; true where that ends it."""
        while (request := self.wire.next(wait=False)) != {}:
            if request is None or request["command"] in ("disconnect", "terminate"):
                self.wire.back.append(request)
                self.paused = True
            elif request["command"] == "pause":
                self.paused = True
                known = {"request_seq": request["seq"], "command": request["command"]}
                self._send(type="response", success=True, **known)
            elif request["command"] in _WHILE_IT_RUNS:
                self.answer(request)
            else:
                self._refuse(request, "the run is under way: pause it first")
            if self.paused:
                return True
        return self.changed

    def _stopped(self, why: str, text: str = "") -> None:
        number = int(why.partition(" ")[2]) if why.startswith("breakpoint ") else 0
        kinds = {one.number: reason for each in self.kinds.values() for one, reason in each}
        reason = kinds.get(number) or _REASONS.get(why) or ("exception" if "fault" in why else "pause")
        self.children.clear()
        self._event(
            "stopped",
            reason=reason,
            description=text or why,
            text=text or None,
            threadId=self.its.timeline.focus + 1,
            allThreadsStopped=True,
            hitBreakpointIds=[number] if number in kinds else None,
        )

    def _output(self, tick: int, core: int, text: str, address: int) -> None:
        begin = f"{self.its_console.time(tick)}  {self.its_console.core(core)}"
        self._event("output", category="console", output=f"{begin}{text}\n", **self._place(address, "source"))

    # Looking

    def on_threads(self, given: Message) -> Message:
        return {
            "threads": [{"id": at + 1, "name": core.name} for at, core in enumerate(self.its.timeline.cores)]
        }

    def _frames(self, thread: int) -> list[StackFrame]:
        return self.its.symbols.unwinder.frames(self.its.timeline.cores[thread].cpu)

    def on_stackTrace(self, given: Message) -> Message:
        thread = given["threadId"] - 1
        if not 0 <= thread < len(self.its.timeline.cores):
            raise BadInput("", f"thread {thread + 1}", "there is no such robot")
        frames = self._frames(thread)
        found = [self._frame(thread, at, frames) for at in range(len(frames))]
        if not frames[-1].known:
            label = {"id": 0, "name": "the stack cannot be told from here on", "presentationHint": "label"}
            found.append({**label, "line": 0, "column": 0})
        start = given.get("startFrame") or 0
        return {
            "stackFrames": found[start : start + (given.get("levels") or len(found))],
            "totalFrames": len(found),
        }

    def _frame(self, thread: int, at: int, frames: list[StackFrame]) -> Message:
        symbols, frame = self.its.symbols, frames[at]
        called = at > 0 and not frames[at - 1].by_interrupt
        place = symbols.unwinder.call_before(frame.pc) if called else frame.pc
        name = symbols.function(place) + (" (interrupt)" if frame.by_interrupt else "")
        where = self._place(place, "source")
        where = {**where, "column": 1} if where else {"line": 0, "column": 0, "presentationHint": "subtle"}
        identity = thread * _MOST_FRAMES + at + 1
        return {"id": identity, "name": name, **where, "instructionPointerReference": f"{frame.pc:#06x}"}

    def _place(self, address: int, key: str) -> Message:
        """The source and the line of an instruction; nothing where none is known."""
        line = self.its.symbols.line(address)
        return {} if line is None else {key: self._source(line.file), "line": line.line}

    def _source(self, file: str) -> Message:
        path = self.its.symbols.sources.path(file)
        return {"name": Path(file).name, **({} if path is None else {"path": str(path.resolve())})}

    def _moment(self, frame_id: int | None) -> Moment:
        if not frame_id:
            return self.its.moment()
        thread, at = divmod(frame_id - 1, _MOST_FRAMES)
        frames = self._frames(thread)
        return Moment(self.its.symbols, self.its.timeline.cores[thread], frames[at], at == 0)

    def on_scopes(self, given: Message) -> Message:
        moment = self._moment(given["frameId"])
        line = self.its.symbols.line(moment.pc)
        file = "" if line is None else Path(line.file).stem
        scopes: list[tuple[str, str, Children]] = [("Locals", "locals", lambda: _locals(moment))]
        if file:
            scopes.append((f"Statics of {file}.c", "", lambda: self._variables(moment, file)))
        scopes += [
            ("Globals", "globals", lambda: self._variables(moment, "")),
            ("Registers", "registers", lambda: _those(moment, _REGISTERS)),
            ("Special function registers", "registers", lambda: _those(moment, list(SFRS))),
        ]
        if moment.core.board is not None:
            scopes += [
                (f"LM629 {side}", "", partial(_members, f"lm629.{side}", moment))
                for side in ("left", "right")
            ]
            scopes.append(("Radio", "", self._radio))
        scopes.append(("Pins", "", partial(_members, "pins", moment)))
        return {
            "scopes": [
                _given({"name": name, "presentationHint": hint or None, **kept, "expensive": False})
                for name, hint, get in scopes
                for kept in [{"variablesReference": self._keep(get)}]
            ]
        }

    def _keep(self, get: Children) -> int:
        self.children.append(get)
        return len(self.children)

    def _variables(self, moment: Moment, scope: str) -> list[tuple[str, Value]]:
        return sorted((one.name, moment.placed(one)) for one in self.its.symbols.variables_in(scope))

    def _radio(self) -> list[tuple[str, str]]:
        """The last frames on the air of this robot's network, the latest first."""
        events = self.its.timeline.radio_events()[-8:]
        return [(self.its_console.time(one.tick), str(one).partition(": ")[2]) for one in reversed(events)]

    def on_variables(self, given: Message) -> Message:
        reference = given["variablesReference"]
        if not 0 < reference <= len(self.children):
            raise BadInput("", f"reference {reference}", "is of a moment that is left")
        found = self.children[reference - 1]()
        start = given.get("start") or 0
        part = found[start : start + (given.get("count") or len(found))]
        return {"variables": [{"name": name, **self._shown(name, value)} for name, value in part]}

    def _shown(self, name: str, value: Value | str | BadInput, key: str = "value") -> Message:
        moment = self.its.moment()
        if isinstance(value, str | BadInput):
            return {key: str(value), "variablesReference": 0}
        inner: list[tuple[str, Value]] = children(value)
        bits = [
            (bit, at & 7) for bit, at in BITS.items() if value.space == "sfr" and at & 0xF8 == value.address
        ]
        try:
            if bits:
                whole = content(value, moment)
                inner = [(bit, Value(number=whole >> at & 1)) for bit, at in bits]
                text = shown_value(whole)
            else:
                text = str(value.kind or "") if inner else shown_value(content(value, moment))
        except BadInput as error:
            text, inner = str(error), []
        note = f"   ({value.note})" if value.note else ""
        placed = value.kind is not None and value.space in SIZES
        shown = {
            key: text + note,
            "variablesReference": self._keep(lambda: inner) if inner else 0,
            "type": None if value.kind is None else str(value.kind),
            "memoryReference": f"{value.space}:{value.address:#x}" if placed else None,
        }
        return _given(shown)

    def on_evaluate(self, given: Message) -> Message:
        text = given["expression"].strip()
        if given.get("context") == "repl" and text.partition(" ")[0] in self.its_console.verbs():
            self.lines.clear()
            before, self.paused, self.changed = self.its.timeline.tick, False, False
            self.its_console.do(text)
            if self.its.timeline.tick != before:
                self.run_after = partial(self._stopped, "goto")
            return {"result": "\n".join(self.lines), "variablesReference": 0}
        value = expression(text)(self._moment(given.get("frameId")))
        return self._shown(text, value, "result")

    def on_completions(self, given: Message) -> Message:
        begun = given["text"][: given["column"] - 1].split(" ")[-1]
        words = sorted({*self.its_console.verbs(), *self.its.symbols.known_names()})
        return {"targets": [{"label": word} for word in words if word.startswith(begun)]}

    def on_readMemory(self, given: Message) -> Message:
        space, _, place = given["memoryReference"].rpartition(":")
        space = space or "code"
        size = SIZES[space]
        first = int(place, 16) + (given.get("offset") or 0)
        begin, end = max(first, 0), min(first + given["count"], size)
        moment = self.its.moment()
        data = moment.read(space, begin, end - begin) if begin < end else b""
        text, missing = base64.b64encode(data).decode(), given["count"] - len(data)
        return _given({"address": f"{begin:#x}", "data": text, "unreadableBytes": missing or None})

    def on_disassemble(self, given: Message) -> Message:
        symbols = self.its.symbols
        known = sorted(symbols.instructions)
        address = int(given["memoryReference"], 16) + (given.get("offset") or 0)
        at = bisect.bisect_left(known, address) + (given.get("instructionOffset") or 0)
        wanted = range(at, at + given["instructionCount"])
        return {"instructions": [self._instruction(known, index) for index in wanted]}

    def _instruction(self, known: list[int], index: int) -> Message:
        if not 0 <= index < len(known):
            address = "0x0000" if index < 0 else "0xffff"
            return {"address": address, "instruction": "no code", "presentationHint": "invalid"}
        symbols, at = self.its.symbols, known[index]
        code = symbols.image.code
        place = self._place(at, "location") if at in symbols.begins else {}
        data, text = code[at : at + LENGTH[code[at]]].hex(" "), disassemble(code, at, symbols.names)
        return {"address": f"{at:#06x}", "instructionBytes": data, "instruction": text, **place}


def _given(message: Message) -> Message:
    """Without what is None."""
    return {key: value for key, value in message.items() if value is not None}


def _members(text: str, moment: Moment) -> list[tuple[str, Value]]:
    return children(expression(text)(moment))


def _locals(moment: Moment) -> list[tuple[str, Value | BadInput]]:
    """One that is not live says so in the place of its value."""
    found: list[tuple[str, Value | BadInput]] = []
    for name, get in moment.locals():
        try:
            found.append((name, get() if callable(get) else get))
        except BadInput as error:
            found.append((name, error))
    return found


def _those(moment: Moment, names: Sequence[str]) -> list[tuple[str, Value]]:
    return [(name, moment.special(name)) for name in names]


def _logged(text: str) -> Callable[[Moment], str]:
    """A message with its `{expressions}` as values. Raises NoValue."""
    pieces = [(piece, at % 2 == 1) for at, piece in enumerate(text.replace("}", "{").split("{"))]
    terms = [(expression(piece), piece) if inside else (None, piece) for piece, inside in pieces]

    def said(moment: Moment) -> str:
        parts = []
        for term, piece in terms:
            try:
                parts.append(piece if term is None else shown_value(content(term(moment), moment)))
            except BadInput as error:
                parts.append(f"<{error}>")
        return "".join(parts)

    return said
