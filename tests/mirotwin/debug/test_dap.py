"""What the adapter answers to clients that ask wrongly, at the wrong time, or not at all."""

import base64
import json
import queue
import socket
import threading

import pytest

from mirotwin.debug import adapter as adapters
from mirotwin.debug import debug_command
from mirotwin.debug.adapter import Adapter
from mirotwin.runs.inspected_run import InspectedRun
from tests import children
from tests.alone import Alone
from tests.mirotwin.boards import files_of_board
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.debug.runs import debugger_of, robot_run
from tests.mirotwin.program import COMMAND
from tests.mirotwin.verify.firmwares import image
from tests.robot.mcs51.asm import assemble

NO_MESSAGE = "mirotwin: error: --dap: the client sends no message of the protocol"


class Client:
    """A client that can also send what is no message."""

    def __init__(self, source, sink):
        self.source = source
        self.sink = sink
        self.seq = 0

    def raw(self, data):
        self.sink.write(data)
        self.sink.flush()

    def send(self, command, **arguments):
        self.seq += 1
        request = {"seq": self.seq, "type": "request", "command": command, "arguments": arguments}
        data = json.dumps(request).encode()
        self.raw(b"Content-Length: %d\r\n\r\n" % len(data) + data)

    def message(self):
        size = int(self.source.readline().split(b":")[1])
        self.source.readline()
        return json.loads(self.source.read(size))

    def until(self, **wanted):
        """The next message with these values."""
        while True:
            found = self.message()
            if all(found.get(key) == value for key, value in wanted.items()):
                return found

    def ask(self, command, **arguments):
        self.send(command, **arguments)
        return self.until(type="response", command=command)

    def begin(self, **configuration):
        self.ask("initialize")
        launched = self.ask("launch", **configuration)
        assert launched["success"], launched
        self.ask("configurationDone")
        return self.until(event="stopped")["body"]


@pytest.fixture
def adapter():
    process = children.start([*COMMAND, "debug", "--dap"], stdin=-1, stdout=-1, stderr=-1)
    yield process, Client(process.stdout, process.stdin)
    process.kill()
    process.communicate()


def ended(process):
    """How it ended by itself: exit code and what it said."""
    _, err = process.communicate(timeout=60)
    return process.returncode, err.decode()


@pytest.mark.parametrize(
    "garbage",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"Content-Length: 3\r\n\r\nabc",
        b"Content-Length: 2\r\n\r\n{}",
        b"Content-Length: 999999999\r\n\r\n",
        b"x" * 10_000,
        b'Content-Length: 60\r\n\r\n{"seq": 1, "type": "request", "command": "x", "arguments": 7}',
    ],
)
def test_garbage_ends_it_with_one_line(adapter, garbage):
    process, client = adapter
    client.raw(garbage)
    code, err = ended(process)
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith(NO_MESSAGE)


@pytest.mark.parametrize("move", ["continue", "evaluate"])
def test_garbage_during_a_run_ends_it_with_one_line(adapter, move):
    process, client = adapter
    client.begin(subject="silent", set=["duration_s=60"])
    client.send(move, threadId=1, expression="continue", context="repl")
    client.raw(b"GET / HTTP/1.1\r\n\r\n")
    code, err = ended(process)
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith(NO_MESSAGE)


def test_a_client_that_dies_leaves_no_process(adapter):
    process, client = adapter
    client.begin(subject="fig6")
    client.send("continue", threadId=1)
    assert ended(process) == (0, "mirotwin: the client has gone\n")


def test_what_comes_during_a_run_gets_an_answer_each(adapter):
    process, client = adapter
    client.begin(subject="silent", set=["duration_s=60"])
    client.send("continue", threadId=1)
    client.send("threads")
    client.send("stackTrace", threadId=1)
    client.send("setFunctionBreakpoints", breakpoints=[])
    client.send("pause", threadId=1)
    answers = [client.until(type="response") for _ in range(5)]
    asked = ["continue", "threads", "stackTrace", "setFunctionBreakpoints", "pause"]
    assert [one["command"] for one in answers] == asked
    assert [one["success"] for one in answers] == [True, True, False, True, True]
    assert answers[2]["message"] == "the run is under way: pause it first"
    assert client.until(event="stopped")["body"]["reason"] == "pause"
    client.ask("disconnect")
    assert ended(process) == (0, "")


def test_a_breakpoint_that_is_set_during_a_run_stops_it(adapter):
    _, client = adapter
    client.begin(subject="silent", set=["duration_s=60"])
    client.send("continue", threadId=1)
    client.send("setFunctionBreakpoints", breakpoints=[{"name": "failsafe_tick"}])
    assert client.until(event="stopped")["body"]["reason"] == "function breakpoint"


SLOW = """
LCALL slow
SJMP $
slow:
MOV R5,#4
MOV R6,#0
MOV R7,#0
again:
DJNZ R7,again
DJNZ R6,again
DJNZ R5,again
RET
"""


class ClientDuringARun:
    """A wire in this process; `requests` come during a run, and `events` are what was sent."""

    def __init__(self, *requests):
        self.requests = list(requests)
        self.events = {}

    def next(self, wait):
        return self.requests.pop(0) if self.requests else {}

    def send(self, message):
        self.events[message.get("event")] = message["body"]


@pytest.mark.parametrize(("place", "stops_at"), [(0x1000, 3), (17, 17)])  # elsewhere; before RET
def test_a_step_goes_on_past_a_change_of_breakpoints_and_stops_at_new_ones(place, stops_at):
    places = {"breakpoints": [{"instructionReference": hex(place)}]}
    wire = ClientDuringARun({"seq": 2, "command": "setInstructionBreakpoints", "arguments": places})
    debugger = debugger_of(InspectedRun(Alone(image(SLOW)).world))
    adapter = Adapter(wire)
    adapter.use(debugger)
    adapter.answer({"seq": 1, "command": "next", "arguments": {"threadId": 1}})
    adapter.run_after()
    assert wire.requests == []
    assert debugger.cpu.pc == stops_at
    assert wire.events["stopped"]["reason"] == ("step" if stops_at == 3 else "instruction breakpoint")


@pytest.mark.parametrize(
    ("command", "arguments", "said"),
    [
        ("restartFrame", {"frameId": 1}, "restartFrame: is not answered by this debugger"),
        ("continue", {"threadId": 9}, "there is no such robot"),
        ("continue", {"threadId": 1.5}, "there is no such robot"),
        ("continue", {}, "arguments that cannot be used"),
        ("variables", {"variablesReference": 77}, "is of a moment that is left"),
        ("evaluate", {"expression": "1 +"}, "lacks a name or a number"),
        ("evaluate", {"expression": ""}, "lacks a name or a number"),
        ("evaluate", {"expression": None}, "arguments that cannot be used"),
        ("readMemory", {"memoryReference": "moon:0x0", "count": 1}, "arguments that cannot be used"),
        ("scopes", {"frameId": 2009}, "frame 2009: is of a moment that is left"),
        ("evaluate", {"expression": "age", "frameId": 9001}, "frame 9001: is of a moment that is left"),
    ],
)
def test_a_request_that_cannot_be_done_gets_an_error_and_the_session_goes_on(
    adapter, command, arguments, said
):
    _, client = adapter
    client.begin(subject="fig6")
    answer = client.ask(command, **arguments)
    assert not answer["success"]
    assert said in answer["message"]
    assert client.ask("threads")["success"]


def test_null_stands_for_arguments_that_are_left_out(adapter):
    _, client = adapter
    request = b'{"seq": 1, "type": "request", "command": "initialize", "arguments": null}'
    client.raw(b"Content-Length: %d\r\n\r\n%b" % (len(request), request))
    assert client.until(type="response")["success"]


def test_a_client_gets_the_part_of_the_stack_that_it_asks_for(adapter):
    _, client = adapter
    client.begin(subject="fig6", at="0.5s")
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "take_body"}])
    client.ask("continue", threadId=1)
    client.until(event="stopped")
    whole = client.ask("stackTrace", threadId=1)["body"]
    frames = whole["stackFrames"]
    assert whole["totalFrames"] == len(frames) > 1
    for start, levels in ((0, 1), (1, 0), (1, 1), (9, 5)):
        part = client.ask("stackTrace", threadId=1, startFrame=start, levels=levels)["body"]
        assert part["stackFrames"] == frames[start : start + levels if levels else None]
        assert part["totalFrames"] == len(frames)


def test_a_client_may_say_that_it_breaks_at_no_exception(adapter):
    _, client = adapter
    client.begin(subject="fig6")
    assert client.ask("setExceptionBreakpoints", filters=[])["success"]


def test_breakpoints_that_cannot_be_set_say_why(adapter):
    _, client = adapter
    client.begin(subject="fig6", at="0s")
    source = {"path": "/elsewhere/failsafe.c"}
    lines = [
        {"line": 146, "condition": "age >"},
        {"line": 146, "condition": "agee > 3"},
        {"line": 9999},
        {"line": 146, "hitCondition": "often"},
        {"line": 146},
    ]
    found = client.ask("setBreakpoints", source=source, breakpoints=lines)["body"]["breakpoints"]
    assert [one["verified"] for one in found] == [False, False, False, False, True]
    assert all(one["message"] for one in found[:4])
    places = [{"instructionReference": one} for one in ("0xffffff", "zz", "0x40")]
    found = client.ask("setInstructionBreakpoints", breakpoints=places)["body"]["breakpoints"]
    assert [one["verified"] for one in found] == [False, False, True]
    places = [{"dataId": one} for one in ("iram:9999:1", "iram", "iram:48:1")]
    found = client.ask("setDataBreakpoints", breakpoints=places)["body"]["breakpoints"]
    assert [one["verified"] for one in found] == [False, False, True]
    reads = [{"dataId": "iram:48:1", "accessType": kind} for kind in ("read", "readWrite", "never", "write")]
    found = client.ask("setDataBreakpoints", breakpoints=reads)["body"]["breakpoints"]
    assert [one["verified"] for one in found] == [True, True, False, True]
    info = client.ask("dataBreakpointInfo", name="failsafe:age")["body"]
    assert info["accessTypes"] == ["write", "read", "readWrite"]
    assert client.ask("dataBreakpointInfo", name="A")["body"]["dataId"] is None
    client.send("reverseContinue", threadId=1)
    assert client.until(event="stopped")["body"]["description"] == "the run begins here"


def test_no_more_instructions_are_listed_than_a_program_memory_holds(adapter):
    _, client = adapter
    client.begin(subject="fig6")
    for count, listed in ((3, 3), (10**12, 1 << 16)):
        found = client.ask("disassemble", memoryReference="0x0000", instructionCount=count)["body"]
        assert len(found["instructions"]) == listed
    assert [one["presentationHint"] for one in found["instructions"][-1:]] == ["invalid"]


def test_sources_are_told_by_their_names_and_breakpoints_may_be_none(adapter):
    _, client = adapter
    client.begin(subject="fig6")
    for path in ("C:\\work\\failsafe.c", "file:///work/failsafe.c", "failsafe.c"):
        answer = client.ask("setBreakpoints", source={"path": path}, breakpoints=[{"line": 146}])
        assert answer["body"]["breakpoints"][0]["verified"]
    assert client.ask("setBreakpoints", source={"path": path}, breakpoints=None)["body"]["breakpoints"] == []


def test_the_verbs_of_the_console_work_in_the_debug_console(adapter):
    _, client = adapter
    client.begin(subject="fig6", at="20ms")
    done = (("r stepi", "step: "), ("where", "#0"), ("print tick", "tick = "), ("break act", "breakpoint 1"))
    for text, said in done:
        assert said in client.ask("evaluate", expression=text, context="repl")["body"]["result"]
    for text in ("break failsafe_ti", "print 3+failsafe_ti", "print -failsafe_ti - 1"):
        end = text.index("_ti") + 4
        targets = client.ask("completions", text=text, column=end)["body"]["targets"]
        assert targets == [{"label": "failsafe_tick"}]
    client.send("evaluate", expression="continue", context="repl")
    assert client.until(event="stopped")["body"]["reason"] == "breakpoint"
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "failsafe_tick"}])
    client.send("evaluate", expression="continue", context="repl")
    stopped = client.until(event="stopped")["body"]
    assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("function breakpoint", [2])
    client.send("evaluate", expression="delete", context="repl")
    removed = client.until(event="breakpoint")["body"]
    assert (removed["reason"], removed["breakpoint"]["id"]) == ("removed", 2)
    client.send("evaluate", expression="quit", context="repl")
    client.until(event="terminated")


@pytest.mark.parametrize(
    ("configuration", "said"),
    [
        ({}, "subject: is missing"),
        ({"subject": "no_such_scenario"}, "no_such_scenario"),
        ({"subject": "fig6", "at": "12"}, "it has no unit"),
        ({"subject": "fig6", "slot": "x"}, "its keys are"),
        ({"subject": "fig6", "resume": "gone.world"}, "gone.world: No such file or directory"),
        ({"subject": "/"}, "/: "),
    ],
)
def test_a_launch_that_cannot_be_done_says_why_and_another_one_may_follow(adapter, configuration, said):
    process, client = adapter
    client.ask("initialize")
    assert client.ask("threads")["message"] == "threads: there is no run yet; send launch first"
    answer = client.ask("launch", **configuration)
    assert not answer["success"]
    assert said in answer["message"]
    assert client.begin(subject="fig6")["reason"] == "entry"
    client.ask("disconnect")
    assert ended(process) == (0, "")


def test_it_listens_on_a_port_of_this_machine_alone():
    process = children.start([*COMMAND, "debug", "--listen", "0"], stdout=-1, stderr=-1)
    port = int(process.stderr.readline().rpartition(b":")[2])
    with socket.create_connection(("127.0.0.1", port)) as connection, connection.makefile("rwb") as stream:
        client = Client(stream, stream)
        assert client.begin(subject="fig6", at="20ms")["reason"] == "goto"
        client.ask("disconnect")
    assert ended(process)[0] == 0


def test_an_editor_begins_at_the_first_line_of_c(adapter):
    _, client = adapter
    client.begin(subject="fig6")
    first = client.ask("stackTrace", threadId=1)["body"]["stackFrames"][0]
    assert (first["name"], first["source"]["name"]) == ("main", "main.c")


def test_an_editor_begins_at_reset_where_the_image_has_no_lines(adapter, tmp_path):
    _, client = adapter
    image = hex_file(tmp_path / "bare.ihx", assemble("NOP\nNOP\nSJMP $"))
    client.begin(subject=str(image))
    assert client.ask("evaluate", expression="PC")["body"]["result"] == "0"


def test_an_editor_begins_where_a_saved_world_stands(adapter, tmp_path):
    _, client = adapter
    world = robot_run().world
    world.run_to(1_200_000)
    saved = tmp_path / "at.world"
    saved.write_bytes(world.save())
    client.begin(subject="fig6", seed=7, resume=str(saved))
    found = client.ask("evaluate", expression="cycle")["body"]["result"]
    assert found.split()[0] == str(world.robot().board.cpu.cycles)


def test_an_editor_opens_the_files_of_the_folder_that_is_named_first(adapter, tmp_path):
    _, client = adapter
    mine = tmp_path / "main.c"
    mine.write_text("")
    client.begin(subject="fig6", sources=[str(tmp_path)])
    first = client.ask("stackTrace", threadId=1)["body"]["stackFrames"][0]
    assert first["source"]["path"] == str(mine)


def test_robots_are_threads_that_stop_together(adapter, short):
    _, client = adapter
    client.begin(subject=str(short))
    threads = client.ask("threads")["body"]["threads"]
    assert [one["name"] for one in threads] == ["net0/robot0", "net0/robot2"]
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "failsafe_fresh"}])
    stopped = set()
    for _ in range(2):
        client.send("continue", threadId=1)
        body = client.until(event="stopped")["body"]
        assert body["allThreadsStopped"]
        trace = client.ask("stackTrace", threadId=body["threadId"])["body"]["stackFrames"]
        assert trace[0]["name"] == "failsafe_fresh"
        stopped.add(body["threadId"])
    assert stopped == {1, 2}


@pytest.mark.parametrize("move", ["continue", "next"])
def test_a_move_of_another_thread_does_not_stop_again_where_it_stopped(adapter, short, move):
    _, client = adapter
    client.begin(subject=str(short), at="100ms")
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "uart_interrupt"}])
    stops = []
    for _ in range(6):
        client.send(move, threadId=1)
        thread = client.until(event="stopped")["body"]["threadId"]
        tick = client.ask("evaluate", expression="tick")["body"]["result"]
        stops.append((int(tick.split()[0]), thread))
    assert stops == sorted(set(stops))


def test_each_thread_shows_the_memory_of_its_own_robot(adapter, short):
    _, client = adapter
    client.begin(subject=str(short), at="100ms")
    slots = []
    for thread in (1, 2):
        frame = client.ask("stackTrace", threadId=thread)["body"]["stackFrames"][0]["id"]
        evaluated = client.ask("evaluate", expression="slot", frameId=frame)["body"]
        scopes = client.ask("scopes", frameId=frame)["body"]["scopes"]
        reference = next(one["variablesReference"] for one in scopes if one["name"] == "Globals")
        named = client.ask("variables", variablesReference=reference)["body"]["variables"]
        listed = next(one for one in named if one["name"] == "slot")
        memory = client.ask("readMemory", memoryReference=listed["memoryReference"], count=1)["body"]["data"]
        slots.append((evaluated["result"], listed["value"], base64.b64decode(memory)))
    assert slots == [("0", "0", b"\0"), ("2", "2", b"\2")]


@pytest.mark.parametrize(
    "garbage",
    [
        b"POST / HTTP/1.1\r\nContent-Length: 2\r\n\r\n{}",
        b"Host: localhost\r\nContent-Length: 2\r\n\r\n{}",
        b"Content-Length: 9000\r\n\r\n" + b'{"arguments": {"a": ' + b"[" * 8980,
        b"Content-Length: 200000\r\n\r\n" + b"[" * 200000,
        b'Content-Length: 63\r\n\r\n{"seq": 1, "type": "request", "command": "\xff\xfe", "arguments": {}}',
        b"Content-Length: 6000\r\n\r\n" + b'{"seq": ' + b"9" * 5990 + b" }",
        b"Content-Length: 100\r\n\r\n{",
    ],
)
def test_what_is_no_request_ends_it_and_so_does_the_end_of_input(adapter, garbage):
    process, client = adapter
    client.raw(garbage)
    client.sink.close()
    process.stdin = None
    code, err = ended(process)
    assert code in (0, 2)
    assert err.count("\n") == 1


def test_a_deeply_nested_argument_ends_it_with_one_line(adapter):
    process, client = adapter
    data = b'{"seq": 1, "type": "request", "command": "x", "arguments": {"a": %b1%b}}' % (
        b"[" * 1500,
        b"]" * 1500,
    )
    client.raw(b"Content-Length: %d\r\n\r\n%b" % (len(data), data))
    code, err = ended(process)
    assert (code, err.count("\n")) == (2, 1)


def test_blank_lines_between_messages_do_not_matter(adapter):
    _, client = adapter
    client.raw(b"\r\n\n\r\n")
    assert client.ask("initialize")["success"]
    client.raw(b"\r\n")
    assert client.ask("launch", subject="fig6")["success"]


def test_only_what_a_user_asked_for_raises_a_window(adapter):
    _, client = adapter
    client.begin(subject="fig6")
    for context in ("hover", "watch", "repl"):
        failed = client.ask("evaluate", expression="nothing", context=context)
        assert failed["body"]["error"]["showUser"] is False
    assert client.ask("variables", variablesReference=99)["body"]["error"]["showUser"] is False
    assert client.ask("launch", subject="nothing")["body"]["error"]["showUser"] is True


def test_a_data_breakpoint_keeps_a_name_and_not_a_place(adapter):
    _, client = adapter
    client.begin(subject="fig6", at="100ms")
    info = client.ask("dataBreakpointInfo", name="failsafe:age")["body"]
    assert (info["dataId"], info["canPersist"]) == ("failsafe:age", True)
    frame = client.ask("stackTrace", threadId=1)["body"]["stackFrames"][0]["id"]
    scopes = client.ask("scopes", frameId=frame)["body"]["scopes"]
    reference = next(
        one["variablesReference"] for one in scopes if one["name"] == "Special function registers"
    )
    listed = client.ask("variables", variablesReference=reference)["body"]["variables"]
    inner = next(one["variablesReference"] for one in listed if one["name"] == "TCON")
    info = client.ask("dataBreakpointInfo", variablesReference=inner, name="TR1")["body"]
    assert (info["dataId"], info["canPersist"]) == ("TCON.TR1", True)
    info = client.ask("dataBreakpointInfo", name="iram[0x30]")["body"]
    assert (info["dataId"], info["canPersist"]) == ("iram:48:1", False)
    gone = [{"dataId": "failsafe:gone"}, {"dataId": "TCON.TR1"}]
    found = client.ask("setDataBreakpoints", breakpoints=gone)["body"]["breakpoints"]
    assert [one["verified"] for one in found] == [False, True]


def test_a_long_message_is_refused_at_once(adapter):
    _, client = adapter
    client.begin(subject="fig6")
    messages = ["{" * 200_000, "".join(f"{{{number}}}" for number in range(1000)), "{tick}"]
    lines = [{"line": 146, "logMessage": one} for one in messages]
    found = client.ask("setBreakpoints", source={"path": "failsafe.c"}, breakpoints=lines)["body"][
        "breakpoints"
    ]
    assert [one["verified"] for one in found] == [False, False, True]


def test_a_number_of_many_digits_is_refused():
    from mirotwin.debug.expression import NoValue, expression

    for text in ("9" * 5000, "0x" + "f" * 5000, "iram." + "9" * 5000, "1 +" * 5000):
        with pytest.raises(NoValue):
            expression(text)(None)


def listening(monkeypatch, **patches):
    """What `debug --listen` says, in a thread, and the port."""
    for name, value in patches.items():
        monkeypatch.setattr(debug_command, name, value)
    thread = threading.Thread(target=debug_command._listen, args=(0,), daemon=True)
    said = queue.SimpleQueue()
    monkeypatch.setattr(debug_command, "complain", said.put)
    thread.start()
    return thread, said, said.get(timeout=60)


def test_a_client_of_another_user_is_sent_away(monkeypatch):
    answers = [False, True]
    thread, said, line = listening(monkeypatch, _is_own=lambda client: answers.pop(0))
    address = ("127.0.0.1", int(line.rpartition(":")[2]))
    with socket.create_connection(address) as other:
        assert other.recv(1) == b""
    assert said.get(timeout=60) == "a client of another user was sent away"
    with socket.create_connection(address) as connection, connection.makefile("rwb") as stream:
        client = Client(stream, stream)
        assert client.ask("initialize")["success"]
        client.ask("disconnect")
    thread.join(60)


def test_a_connection_within_this_machine_is_known_to_be_its_users_own():
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()):
        client, _ = server.accept()
        with client:
            assert debug_command._is_own(client)


def test_a_client_that_has_gone_is_nobodys_own():
    """Linux says that the connection of a socket that was closed belongs to root."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        socket.create_connection(server.getsockname()).close()
        client, _ = server.accept()
        with client:
            assert not debug_command._is_own(client)


def test_where_the_system_does_not_tell_nothing_is_served_without_the_token(monkeypatch, tmp_path):
    thread, _, line = listening(monkeypatch, _TCP=tmp_path / "none")
    place, _, token = line.partition(", token ")
    assert len(token) == 32
    address = ("127.0.0.1", int(place.rpartition(":")[2]))
    with socket.create_connection(address) as connection, connection.makefile("rwb") as stream:
        client = Client(stream, stream)
        client.ask("initialize")
        for given in ({}, {"token": "0" * 32}, {"token": 7}):
            refused = client.ask("launch", subject="fig6", **given)
            assert "token" in refused["message"]
            assert not client.ask("threads")["success"]
        assert client.ask("launch", subject="fig6", token=token)["success"]
        client.ask("disconnect")
    thread.join(60)


def test_a_stop_at_a_firmware_fault_says_which(adapter, tmp_path):
    _, client = adapter
    image = hex_file(
        tmp_path / "bad.ihx", assemble("NOP\nMOV SP,#0FEh\nPUSH ACC\nPUSH ACC\nPUSH ACC\nSJMP $")
    )
    client.begin(subject=str(image))
    client.send("continue", threadId=1)
    stopped = client.until(event="stopped")["body"]
    assert stopped["reason"] == "exception"
    assert stopped["text"].startswith("firmware fault: ")


def test_a_board_has_scopes_of_its_parts_and_nets_whose_values_can_be_asked_for(adapter, tmp_path):
    _, client = adapter
    board, image = files_of_board(tmp_path)
    client.begin(subject=f"{board}", firmware=f"{image}", at="10ms")
    frame = client.ask("stackTrace", threadId=1)["body"]["stackFrames"][0]["id"]
    scopes = client.ask("scopes", frameId=frame)["body"]["scopes"]
    references = {one["name"]: one["variablesReference"] for one in scopes}
    parts = client.ask("variables", variablesReference=references["Parts"])["body"]["variables"]
    assert [one["name"] for one in parts] == ["key", "lamp"]
    nets = client.ask("variables", variablesReference=references["Nets"])["body"]["variables"]
    assert (nets[0]["name"], nets[0]["value"]) == ("KEY", "1")
    assert client.ask("evaluate", expression="lamp.flashes", frameId=frame)["body"]["result"] == "0"


def test_a_value_of_a_part_that_is_set_is_put_and_stays_put_where_one_goes_back_and_on(adapter, tmp_path):
    _, client = adapter
    board, image = files_of_board(tmp_path)
    client.begin(subject=f"{board}", firmware=f"{image}", at="10ms")

    def part(name):
        frame = client.ask("stackTrace", threadId=1)["body"]["stackFrames"][0]["id"]
        scopes = {one["name"]: one for one in client.ask("scopes", frameId=frame)["body"]["scopes"]}
        reference = scopes["Parts"]["variablesReference"]
        parts = client.ask("variables", variablesReference=reference)["body"]["variables"]
        return next(one["variablesReference"] for one in parts if one["name"] == name)

    def lit_at(time):
        client.ask("evaluate", expression=f"goto {time}", context="repl")
        client.until(event="stopped")
        return client.ask("evaluate", expression="lamp.on")["body"]["result"]

    said = client.ask("setVariable", variablesReference=part("key"), name="pressed", value="true")
    assert said["success"], said
    assert said["body"]["value"].startswith("true   (from tick 110")
    assert [lit_at(time) for time in ("9ms", "20ms", "1ms", "11ms", "10ms", "400ms", "20ms")] == list(
        "0101011"
    )
    lit_at("30ms")
    assert client.ask("setVariable", variablesReference=part("key"), name="pressed", value="false")["success"]
    assert [lit_at(time) for time in ("20ms", "40ms", "5ms", "500ms")] == ["1", "0", "0", "0"]
    for name, value, why in (
        ("pressed", "7", "key.pressed = 7: expected `bool`, got `int`"),
        ("closed", "true", "nothing can be put at 'closed' of part 'key'"),
    ):
        refused = client.ask("setVariable", variablesReference=part("key"), name=name, value=value)
        assert not refused["success"]
        assert why.split(":")[0] in refused["message"]


FAULTS_TWICE = """
NOP
again:
DB 0A5h
MOV R7,#200
wait:
DJNZ R7,wait
SJMP again
"""


def test_a_fault_of_a_chosen_kind_stops_a_run_that_goes_on_past_it_and_says_which():
    """Without its filter the run goes on."""
    wire = ClientDuringARun()
    run = InspectedRun(Alone(image(FAULTS_TWICE), stop_on_fault=False).world)
    run.end_tick = 24_000_000 // 500
    adapter = Adapter(wire)
    adapter.use(debugger_of(run))

    def goes_on():
        adapter.answer({"seq": 1, "command": "continue", "arguments": {"threadId": 1}})
        adapter.run_after()
        return wire.events["stopped"]

    filters = {"filters": ["UNDEFINED_OPCODE", "STACK_OVERFLOW"]}
    adapter.answer({"seq": 1, "command": "setExceptionBreakpoints", "arguments": filters})
    ticks = []
    for _ in range(3):
        stopped = goes_on()
        assert stopped["reason"] == "exception"
        info = adapter.on_exceptionInfo({"threadId": 1})
        assert info["exceptionId"] == "UNDEFINED_OPCODE"
        assert "executed the undefined opcode A5 at 0x0001" in info["description"]
        ticks.append(adapter.timeline.tick)
    assert ticks == sorted(set(ticks))
    adapter.answer(
        {"seq": 1, "command": "setExceptionBreakpoints", "arguments": {"filters": ["STACK_OVERFLOW"]}}
    )
    goes_on()
    assert adapter.timeline.run.over


def test_the_failed_check_of_a_case_is_an_exception_that_says_what_failed(adapter, tmp_path):
    _, client = adapter
    scenario = tmp_path / "steps.scenario.toml"
    step = '[[step]]\nwait_for = "command"\nname = "RDSIGS"\nwithin_ms = 50\n'
    scenario.write_text(f'scenario = "fig6"\nname = "steps"\nset.duration_s = 0.3\n{step}')
    assert client.begin(subject=str(scenario))["reason"] == "exception"
    info = client.ask("exceptionInfo", threadId=1)["body"]
    assert info["exceptionId"] == "failed check"
    assert "fails as recorded: happens: net0/robot0: tick " in info["description"]


def test_a_session_ends_at_once_while_it_opens(adapter):
    process, client = adapter
    client.ask("initialize")
    client.send("launch", subject="silent", set=["duration_s=600"], at="590s")
    client.send("disconnect")
    client.until(type="response", command="disconnect")
    assert ended(process) == (0, "")


def test_what_takes_longer_than_a_second_says_how_far_it_is(monkeypatch):
    monkeypatch.setattr(adapters, "_PATIENCE_S", 0.0)
    monkeypatch.setattr(adapters, "_PROGRESS_S", 0.0)
    wire = ClientDuringARun()
    all_events = []
    wire.send = lambda message: all_events.append((message.get("event"), message.get("body")))
    own = Adapter(wire)
    own.on_initialize({"supportsProgressReporting": True})
    own.use(debugger_of(robot_run()))
    for expected in ("1", "2"):
        own.its.go_to(0)
        own.answer({"seq": 1, "command": "continue", "arguments": {"threadId": 1}})
        all_events.clear()
        own.run_after()
        told = [(event, body) for event, body in all_events if event and event.startswith("progress")]
        assert [told[0][0], told[1][0], told[-1][0]] == ["progressStart", "progressUpdate", "progressEnd"]
        assert {body["progressId"] for _, body in told} == {expected}
        shares = [body["percentage"] for event, body in told[:-1]]
        assert shares == sorted(shares)
        assert 0 < shares[0] < shares[-1] <= 100
    all_events.clear()
    own.on_initialize({})
    own.its.go_to(0)
    own.answer({"seq": 1, "command": "continue", "arguments": {"threadId": 1}})
    own.run_after()
    assert not [event for event, _ in all_events if event and event.startswith("progress")]


def test_nothing_of_a_run_can_be_set_and_the_answer_says_why(adapter):
    _, client = adapter
    client.begin(subject="fig6", at="100ms")
    frame = client.ask("stackTrace", threadId=1)["body"]["stackFrames"][0]["id"]
    scopes = {one["name"]: one for one in client.ask("scopes", frameId=frame)["body"]["scopes"]}
    reference = scopes["Globals"]["variablesReference"]
    for refused in (
        client.ask("setVariable", variablesReference=reference, name="slot", value="1"),
        client.ask("setExpression", expression="slot", value="1"),
        client.ask("writeMemory", memoryReference="0:iram:0x30", data="AA=="),
    ):
        assert "a run is bits, and with another value it would be another run" in refused["message"]


def test_a_restart_reads_the_image_again_and_finds_breakpoints_by_their_names(adapter, tmp_path):
    _, client = adapter
    firmware = tmp_path / "own.ihx"
    hex_file(firmware, assemble("main:\nINC 30h\nSJMP main"))
    client.begin(subject=str(firmware))
    client.ask("setInstructionBreakpoints", breakpoints=[{"instructionReference": "0x2"}])
    data = [{"dataId": "iram:48:1"}]
    number = client.ask("setDataBreakpoints", breakpoints=data)["body"]["breakpoints"][0]["id"]
    hex_file(firmware, assemble("main:\nNOP\nINC 30h\nSJMP main"))
    client.send("restart")
    events = [client.until(event="breakpoint")["body"]["breakpoint"] for _ in range(2)]
    assert [one["verified"] for one in events] == [True, True]
    assert events[1]["id"] == number
    client.until(event="stopped")
    client.send("continue", threadId=1)
    stopped = client.until(event="stopped")["body"]
    assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("data breakpoint", [number])
    assert client.ask("evaluate", expression="PC")["body"]["result"].split()[0] == "1"
