"""miro:// as a program sees it that knows pyserial and nothing else: what passes time, comes back, and is refused."""

import threading
import time
import warnings
from itertools import pairwise

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_exact.clock import HOST_CHARACTER_TICKS, ticks
from mirotwin.ports.url import UrlOptions, parse_url
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.ports.rig import ANSWER_BYTES, python, question, replays, sent_bytes
from tests.mirotwin.program import full_disk

URL = "miro://fig6?set=network.radio.bit_error_rate=0"


@pytest.fixture
def miro(monkeypatch):
    """Opens URLs as a program does; all are closed at the end."""
    monkeypatch.setattr(serial, "protocol_handler_packages", ["serial.urlhandler", "mirotwin.ports"])
    opened = []

    def call(url=URL, **named):
        opened.append(serial.serial_for_url(url, **named))
        return opened[-1]

    yield call
    for port in opened:
        port.close()


def asked(port, seq=0):
    port.write(question(seq))
    return port.read(ANSWER_BYTES)


def test_a_read_ends_at_the_tick_at_which_its_last_byte_is_known(miro):
    one, other = miro(timeout=1), miro(timeout=1)
    whole = asked(one)
    assert len(whole) == ANSWER_BYTES
    other.write(question(0))
    ends = []
    for byte in whole:
        assert other.read(1) == bytes([byte])
        ends.append(other.world.tick)
    assert other.world.tick == one.world.tick
    gaps = [second - first for first, second in pairwise(ends)]
    assert all(abs(gap - HOST_CHARACTER_TICKS) <= 60 for gap in gaps)  # the robot's crystal: 0.16 % faster


def test_a_read_that_gets_nothing_takes_its_timeout_to_the_tick(miro):
    port = miro(timeout=0.25)
    assert port.read(1) == b""
    assert port.world.tick == ticks(0.25)


def test_a_read_that_gets_too_little_gives_what_there_is_at_its_timeout(miro):
    port = miro(timeout=0.3)
    port.write(question(0))
    begun = port.world.tick
    assert len(port.read(100)) == ANSWER_BYTES
    assert port.world.tick == begun + ticks(0.3)


def test_a_pause_between_bytes_ends_a_read(miro):
    port = miro(timeout=1, inter_byte_timeout=0.005)
    port.write(question(0))
    assert len(port.read(100)) == ANSWER_BYTES
    assert port.world.tick < ticks(0.1)


def test_looking_sleeping_and_writing_let_no_time_pass(miro):
    port = miro(timeout=0)
    port.write(question(0))
    time.sleep(0.01)
    assert (port.in_waiting, port.out_waiting, port.read(1)) == (0, 24, b"")  # 23 characters and the key-up
    assert port.world.tick == 0


def test_flush_passes_the_time_that_the_characters_take(miro):
    port = miro()
    port.write(b"x" * 96)
    port.flush()
    assert port.out_waiting == 0
    assert abs(port.world.tick - ticks(0.101)) < ticks(0.0002)  # 0.1 s and 1 ms of key-up


def test_a_write_waits_for_room_in_the_buffer_and_no_longer(miro):
    port = miro()
    assert port.write(bytes(4000)) == 4000
    assert port.world.tick == 0
    assert port.write(bytes(1000)) == 1000
    assert port.out_waiting == 4096
    assert 0.9 < port.world.tick / ticks(1) < 1.0


def test_a_write_that_finds_no_room_in_time_says_so(miro):
    port = miro(write_timeout=0.1)
    with pytest.raises(serial.SerialTimeoutException):
        port.write(bytes(5000))
    assert port.world.tick == ticks(0.1)
    port.write_timeout = 0
    assert 0 <= port.write(bytes(5000)) < 100


def test_the_same_calls_give_the_same_digest(miro):
    digests = []
    for _ in range(2):
        port = miro("miro://fig6?seed=3", timeout=0.05)
        for seq in range(6):
            asked(port, seq)
        digests.append(port.world.digest)
    assert digests[0] == digests[1] != ""


def test_each_open_is_a_robot_that_has_just_been_switched_on(miro):
    port = miro(timeout=0.1)
    first = asked(port)
    port.close()
    assert not port.is_open
    port.open()
    assert port.world.tick == 0
    assert asked(port) == first


def test_purging_forgets_what_was_heard_and_what_waits(miro):
    port = miro(timeout=0.1)
    port.write(question(0))
    port.flush()
    port.read(1)
    port.reset_input_buffer()
    assert port.in_waiting == 0
    port.write(question(1))
    port.reset_output_buffer()
    assert port.out_waiting == 0


def test_a_reading_thread_is_ended_by_cancel_read(miro):
    port = miro(URL + "&realtime=1", timeout=None)
    found = []
    thread = threading.Thread(target=lambda: found.append(port.read(100)))
    thread.start()
    port.write(question(0))
    time.sleep(0.3)
    port.cancel_read()
    thread.join(10)
    assert len(found[0]) == ANSWER_BYTES


def test_in_real_time_a_read_takes_as_long_as_it_says(miro):
    port = miro(URL + "&realtime=2", timeout=1.0)
    begun_s = time.monotonic()
    assert asked(port) != b""
    assert port.read(1) == b""
    assert 0.4 < time.monotonic() - begun_s < 3.0  # 1 s of virtual time, at twice the pace
    time.sleep(0.2)
    assert port.in_waiting == 0
    assert port.world.tick > ticks(1.3)  # time passes between calls too


def test_polling_where_no_time_passes_is_warned_of_once(miro):
    port = miro()
    with pytest.warns(RuntimeWarning, match="use realtime=1 in the URL") as warned:
        assert [port.in_waiting for _ in range(2500)] == [0] * 2500
    assert len(warned) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        port = miro(URL + "&realtime=5")
        for _ in range(1100):
            assert port.in_waiting == 0


def test_lines_that_a_radio_does_not_have_are_there_and_do_nothing(miro):
    port = miro(rtscts=True, dsrdtr=True)
    port.dtr = port.rts = False
    port.break_condition = True
    port.break_condition = False
    assert (port.cts, port.dsr, port.cd, port.ri) == (True, True, True, False)
    assert port.world.networks[0].frames_sent == 0


def test_a_limit_ends_a_read_that_would_wait_for_ever(miro):
    port = miro(URL + "&limit_s=0.5", timeout=None)
    reached = r"the limit of 0.5 s of virtual time is reached \(limit_s\)"
    with pytest.raises(serial.SerialException, match=reached):
        port.read(1)
    with pytest.raises(serial.SerialException, match="limit"):
        port.write(b"x")
    assert port.world.tick == ticks(0.5)


def test_a_firmware_fault_ends_every_call_with_its_name(miro, tmp_path):
    image = hex_file(tmp_path / "undefined.ihx", b"\xa5")
    port = miro(f"miro://fig6?firmware={image}", timeout=1)
    with pytest.raises(serial.SerialException, match="the run has stopped: firmware fault: "):
        port.read(1)


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("miro://nope", "no such scenario"),
        ("miro://fig6?firmware=/no/such.ihx", "there is no such file; build it, or give the path of an .ihx"),
        ("miro://fig6?network=1", "network 1 does not exist; there is 1, numbered from 0"),
        ("miro://fig6?set=duratio_s=3", "duratio_s"),
    ],
)
def test_what_cannot_be_opened_is_a_serial_exception_of_one_line(miro, url, said):
    with pytest.raises(serial.SerialException) as raised:
        miro(url)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "named", [{"baudrate": 115200}, {"parity": "E"}, {"stopbits": 2}, {"bytesize": 7}, {"xonxoff": True}]
)
def test_a_rate_or_format_that_the_radio_does_not_have_is_refused(miro, named):
    with pytest.raises(ValueError, match=r"this radio has|xonxoff"):
        miro(**named)
    port = miro()
    for name, value in named.items():
        with pytest.raises(ValueError, match=r"this radio has|xonxoff"):
            setattr(port, name, value)


def test_a_port_that_is_not_open_says_so(miro):
    port = miro(do_not_open=True)
    for use in (port.read, port.flush, lambda: port.write(b"x"), lambda: port.in_waiting, lambda: port.world):
        with pytest.raises(serial.PortNotOpenError):
            use()
    port.close()


def test_a_recording_of_the_port_replays_to_the_same_digests(miro, tmp_path):
    port = miro(f"miro://fig6?seed=5&out={tmp_path / 'out'}", timeout=0.05)
    for seq in range(5):
        asked(port, seq)
    port.write(b"not read any more")
    port.close()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["run.mcap"]
    assert replays(tmp_path / "out" / "run.mcap") > 5
    assert sent_bytes(tmp_path / "out" / "run.mcap").endswith(b"not read any more")
    with pytest.raises(serial.SerialException, match="the folder is not empty"):
        miro(f"miro://fig6?out={tmp_path / 'out'}")


def test_a_full_disk_is_an_error_of_the_port_and_what_was_recorded_stays(tmp_path):
    code = (
        "import sys, serial\n"
        "serial.protocol_handler_packages.append('mirotwin.ports')\n"
        "port = serial.serial_for_url(sys.argv[1], timeout=30)\n"
        "try:\n"
        "    port.read(1)\n"
        "    port.close()\n"  # all of a quick run may be written here
        "except serial.SerialException as error:\n"
        "    print(error)\n"
        "port.close()\n"
    )
    done = python(code, f"miro://fig6?out={tmp_path / 'out'}", preexec_fn=full_disk(100_000))
    assert (done.returncode, done.stderr) == (0, "")
    said = f"{tmp_path / 'out'}: File too large; make room, or choose another folder with --out"
    assert done.stdout == f"{said}\n"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["run.part.mcap"]
    assert replays(tmp_path / "out" / "run.part.mcap") > 3


@pytest.mark.parametrize(
    ("url", "target"),
    [
        ("miro://fig6", UrlOptions("fig6")),
        ("miro://fig6/", UrlOptions("fig6")),
        ("MIRO://fig6?seed=7", UrlOptions("fig6", seed=7)),
        ("miro://my/own.toml?network=1", UrlOptions("my/own.toml", network=1)),
        ("miro:///tmp/a%20b.toml", UrlOptions("/tmp/a b.toml")),
        ("miro://fig6?set=a.b=1&set=c=%22x+y%22", UrlOptions("fig6", settings=("a.b=1", 'c="x+y"'))),
        ("miro://fig6?firmware=C:%5Cx.ihx&realtime=0.5", UrlOptions("fig6", firmware="C:\\x.ihx", realtime=0.5)),
        ("miro://fig6?limit_s=10&out=runs/x", UrlOptions("fig6", limit_s=10.0, out="runs/x")),
    ],
)  # fmt: skip
def test_a_url_says_what_to_open(url, target):
    assert parse_url(url) == target


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("miro://", "names no scenario; give miro://fig6, for example"),
        ("loop://", "is no miro:// URL"),
        ("miro://fig6?sed=7", "sed: is no option of the URL; there are set, seed, firmware, network"),
        ("miro://fig6?seed=7&seed=8", "seed: stands twice"),
        ("miro://fig6?seed=-1", "seed: '-1' is no whole number from 0 to 9223372036854775807"),
        ("miro://fig6?seed=1e3", "seed: '1e3' is no whole number"),
        ("miro://fig6?network=32", "network: '32' is no whole number from 0 to 31"),
        ("miro://fig6?realtime=0", "realtime: '0' is no number above 0 and up to 1000"),
        ("miro://fig6?realtime=nan", "realtime: 'nan' is no number"),
        ("miro://fig6?limit_s=86401", "limit_s: '86401' is no number above 0 and up to 86400"),
        ("miro://fig6?out=", "out: '' is empty"),
    ],
)
def test_one_that_cannot_be_used_is_named_with_the_place_and_a_remedy(url, said):
    with pytest.raises(BadInput) as raised:
        parse_url(url)
    assert f"{url}: " in str(raised.value)
    assert said in str(raised.value)


@given(st.text(max_size=40))
def test_any_text_is_a_target_or_bad_input(text):
    for url in (text, f"miro://{text}", f"miro://fig6?{text}"):
        try:
            assert parse_url(url).scenario
        except BadInput as error:
            assert "\n" not in str(error)  # noqa: PT017
