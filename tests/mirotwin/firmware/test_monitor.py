"""`fw run` with a program that a person would talk to: by script, and over a terminal.

The monitor measures the bit rate of the first character before it switches its receiver on (tests/robot/monitor).
"""

import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from mirotwin.commands import main
from tests.mirotwin import program
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.terminal import terminal
from tests.robot.inspect.programs import build

MONITOR = Path(__file__).parents[2] / "robot" / "monitor" / "monitor.c"
COMMANDS = "= 2+3*4\r= (7-10)*-3/2\rm 1234 5A\rd 1230\rx\rq\r"
DIALOGUE = """
Monitor ready
> = 2+3*4
14
> = (7-10)*-3/2
4
> m 1234 5A

> d 1230
00 00 00 00 5A 00 00 00\x20
> x
?
> q
bye
""".replace("\n", "\r\n")


@pytest.fixture(scope="module")
def monitor(tmp_path_factory):
    """The image, with `space` and `commands` beside it."""
    folder = tmp_path_factory.mktemp("monitor")
    (folder / "space").write_text(" ")
    (folder / "commands").write_text(COMMANDS)
    return build(folder, MONITOR.read_text())


def talk(image, *options):
    """A dialogue by script; stdout as the program sent it."""
    command = ["fw", "run", image, "--stdin", image.with_name("space"), *options]
    done = CliRunner().invoke(main, [*map(str, command)])
    return done.exit_code, done.stdout_bytes.decode(), done.stderr


@pytest.mark.parametrize(
    "options",
    [
        ("--baud", 9600),
        ("--baud", 57_600, "--stdin-wait"),
        ("--baud", 9600, "--crystal", 11_059_200),
        ("--baud", 9600, "--stdin-after", "200ms"),
        ("--baud", 9600, "--stdin-gap", "2ms"),
    ],
    ids=lambda options: " ".join(map(str, options)),
)
def test_a_monitor_that_measures_the_bit_rate_answers_a_script(monitor, options):
    script = ("--stdin-when", "> ", "--stdin", monitor.with_name("commands"), "--stdin-by-line")
    code, out, err = talk(monitor, *options, *script)
    assert (code, out) == (0, DIALOGUE)
    assert err.startswith("mirotwin: the program ended at ")
    assert err.count("\n") == 1


def test_at_a_rate_at_which_it_cannot_echo_the_monitor_loses_characters(monitor):
    script = ("--stdin-when", "> ", "--stdin", monitor.with_name("commands"), "--stdin-by-line")
    code, out, _ = talk(monitor, "--baud", 57_600, *script, "--max-cycles", 2_000_000)
    assert code in (0, 42)
    assert out.startswith(DIALOGUE[:30])
    assert out != DIALOGUE


def test_pairs_of_text_and_file_are_one_conversation(monitor, tmp_path):
    (tmp_path / "ask").write_text("= 6*7\r")
    (tmp_path / "leave").write_text("q\r")
    pairs = ("--stdin-when", "ready\r\n> ", "--stdin", tmp_path / "ask")
    pairs += ("--stdin-when", "42", "--stdin", tmp_path / "leave")
    code, out, _ = talk(monitor, "--baud", 9600, *pairs, "--stdin-wait")
    assert (code, out) == (0, "\r\nMonitor ready\r\n> = 6*7\r\n42\r\n> q\r\nbye\r\n")


def test_a_text_that_never_comes_is_named(monitor):
    script = ("--stdin-when", "READY", "--stdin", monitor.with_name("commands"))
    code, out, err = talk(monitor, "--baud", 9600, *script, "--max-cycles", 100_000)
    assert (code, out) == (42, "\r\nMonitor ready\r\n> ")
    left = len(COMMANDS)
    assert f"mirotwin: --stdin-when: b'READY' was not seen; {left} bytes of --stdin were not sent\n" in err


def test_without_a_rate_the_monitor_hears_nothing(monitor):
    assert talk(monitor, "--max-cycles", 100_000)[:2] == (42, "")


def test_standard_input_is_sent_too(monitor):
    options = ("--baud", 9600, "--stdin", "-", "--stdin-gap", "20ms")
    done = program.run("fw", "run", monitor, *options, input=b" = 1+1\rq\r", text=False)
    assert (done.returncode, done.stdout) == (0, b"\r\nMonitor ready\r\n> = 1+1\r\n2\r\n> q\r\nbye\r\n")


def test_the_look_commands_take_the_same_dialogue(monitor, mirotwin):
    options = ("--baud", 9600, "--stdin", monitor.with_name("space"))
    script = ("--stdin-when", "> ", "--stdin", monitor.with_name("commands"), "--stdin-by-line")
    code, out, _ = mirotwin("fw", "coverage", monitor, *options, *script)
    assert code == 0
    assert "monitor.c" in out or "program.c" in out


LIVE = (*program.COMMAND, "fw", "run", "--terminal")


def test_a_person_at_a_terminal_is_answered_and_leaves(monitor):
    with terminal(*LIVE, monitor, "--baud", 9600, "--stdin", monitor.with_name("space")) as talk:
        talk.until("Monitor ready\r\n> ")
        talk.type("= 12*12\r")
        talk.until("= 12*12\r\n144\r\n> ")
        talk.type("\x03\r")  # Ctrl-C is a key as any other
        talk.until("?\r\n> ")
        talk.type("\x1d")
    assert talk.process.returncode == 0


def test_the_key_that_is_measured_may_be_typed(monitor):
    with terminal(*LIVE, monitor, "--baud", 9600) as talk:
        time.sleep(1)
        talk.type(" ")
        talk.until("Monitor ready\r\n> ")
        talk.type("q\r")
        talk.until("bye\r\n")
    assert talk.process.returncode == 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_gives_the_terminal_back(monitor, number, code):
    with terminal(*LIVE, monitor, "--baud", 9600, "--stdin", monitor.with_name("space")) as talk:
        talk.until("> ")
        talk.process.send_signal(number)
    assert talk.process.returncode == code


def test_a_fault_gives_the_terminal_back(tmp_path):
    with terminal(*LIVE, hex_file(tmp_path / "a.ihx", b"\xa5")) as talk:
        pass
    assert talk.process.returncode == 3


def test_without_a_terminal_there_is_no_live_one(mirotwin, tmp_path):
    err = mirotwin.refuses("fw", "run", hex_file(tmp_path / "a.ihx", b"\x80\xfe"), "--terminal")
    assert err == ("--terminal: standard input is no terminal; run it in one, or give input with --stdin")


def test_a_program_with_more_than_8_kb_keeps_its_external_ram_apart(mirotwin, tmp_path):
    """SDCC's large model: variables from 0000h of external RAM on, where the code is as well."""
    table = ",".join(str(number * 7 % 251) for number in range(9000))
    program = f"""\
#include <8052.h>
__code const unsigned char table[9000] = {{{table}}};
unsigned char copy[9000];
unsigned int at;
unsigned char good = 1;
void main(void)
{{
    for (at = 0; at < 9000; at++)
        copy[at] = ~table[at];
    for (at = 0; at < 9000; at++)
        if (copy[at] != (unsigned char)~table[at] || table[at] != (unsigned char)(at * 7UL % 251))
            good = 0;
    P1 = good;
    PCON = 2;
}}
"""
    image = build(tmp_path, program, "--model-large")
    assert "does not fit 8192 bytes" in mirotwin("fw", "run", image)[2]
    dump = tmp_path / "dump.json"
    mirotwin.ends(0, "fw", "run", image, "--code-size", "64k", "--dump", dump)
    assert '"90": 1,' in dump.read_text()
    shared = mirotwin("fw", "run", image, "--code-in-xram", "--max-cycles", 2_000_000)
    assert "--code-in-xram: the program has overwritten " in shared[2]


def test_sizes_of_a_program_are_checked(mirotwin, tmp_path):
    image = hex_file(tmp_path / "a.ihx", b"\x00\x80\xfe")
    assert mirotwin("fw", "run", image, "--code-size", "3")[0] == 0
    assert "does not fit 2 bytes" in mirotwin("fw", "run", image, "--code-size", "2")[2]
    for size in ("0", "65k", "65537", "8 k", "-1", ""):
        mirotwin.refuses("fw", "run", image, f"--code-size={size}")
    both = ("--code-size", "64k", "--code-in-xram")
    assert "leave one of the two out" in mirotwin.refuses("fw", "run", image, *both)
