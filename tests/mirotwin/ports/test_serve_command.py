"""`mirotwin serve` as a process: everything that ends or hurts a session, and what is left of it."""

import json
import signal
import socket
import time

import pytest

from miro_protocol import stream
from tests.mirotwin import program
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.ports import sessions
from tests.mirotwin.ports.rig import ANSWER_BYTES, CLEAN, question, replays, sent_bytes, served

PARTS = ["case.part.stream", "run.part.mcap", "summary.part.json"]


def talk(session, seq=0):
    """A client that has asked robot 0 and got its answer, and is in the middle of the next frame."""
    client = socket.create_connection(("127.0.0.1", session.number()), timeout=5)
    client.sendall(question(seq) + question(seq + 3)[:9])
    answer = b""
    while len(answer) < ANSWER_BYTES:
        answer += client.recv(ANSWER_BYTES)
    return client


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_leaves_parts_that_replay(mirotwin, number, code, tmp_path):
    with served("fig6", "--tcp", 0, *CLEAN, "--out", tmp_path / "out") as session:
        client = talk(session)
        time.sleep(0.2)
        session.stop(number)
        client.close()
    assert session.code == code
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == PARTS
    assert replays(tmp_path / "out/run.part.mcap") > 3
    assert json.loads((tmp_path / "out/summary.part.json").read_bytes())["complete"] is False
    assert "ms behind the wall clock" in session.err
    done = stream.decode((tmp_path / "out/case.part.stream").read_bytes(), "case")
    assert b"".join(sent.data for sent in done.transmissions()) == sent_bytes(tmp_path / "out/run.part.mcap")
    for file in PARTS[:2]:
        assert mirotwin("replay", tmp_path / "out" / file, "-q")[0] == 0


def test_a_check_that_fails_is_exit_code_1_and_leaves_a_case_that_fails_the_same_way(mirotwin, tmp_path):
    asked = ("--expect", "frames_accepted_min=150", "--duration", "1s")
    with served("fig6", "--tcp", 0, *CLEAN, *asked, "--out", tmp_path / "out") as session:
        talk(session).close()
        session.wait()
    assert session.code == 1
    code, out, err = mirotwin("replay", tmp_path / "out/case.stream", "-q")
    assert (code, "fails as recorded: frames_accepted_min: " in out + err) == (1, True)


def test_a_session_that_is_killed_leaves_all_but_the_last_half_second(tmp_path):
    ports = ("--tcp", 0, "--pty", tmp_path / "radio")
    with served("fig6", *ports, *CLEAN, "--out", tmp_path / "out") as session:
        client = talk(session)
        time.sleep(0.6)
        session.stop(signal.SIGKILL)
        client.close()
    assert question(0) in sent_bytes(tmp_path / "out/run.part.mcap")
    assert replays(tmp_path / "out/run.part.mcap") > 3
    again = ("--pty", tmp_path / "radio", "--duration", "0.1s", "--force", "--out", tmp_path / "out")
    with served("fig6", *again) as session:  # its link leads nowhere and is replaced
        session.wait()
    assert session.code == 0


def test_a_full_disk_ends_it_with_what_was_recorded(tmp_path):
    command = ("fig6", "--tcp", 0, *CLEAN, "--pace", 5, "--out", tmp_path / "out")
    with served(*command, preexec_fn=program.full_disk(100_000)) as session:
        client = talk(session)
        session.wait()
        client.close()
    assert session.code == 2
    assert "File too large; make room, or choose another folder with --out" in session.err
    assert replays(tmp_path / "out/run.part.mcap") > 3


def test_clients_that_vanish_are_followed_by_others_and_what_they_sent_was_sent(tmp_path):
    with served("fig6", "--tcp", 0, *CLEAN, "--pace", 2, "--out", tmp_path / "out") as session:
        for seq in (0, 3, 6):
            client = talk(session, seq)
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            client.close()
            time.sleep(0.4)
        session.stop()
    assert session.code == 130
    sent = b"".join(question(seq) + question(seq + 3)[:9] for seq in (0, 3, 6))
    assert sent_bytes(tmp_path / "out/run.part.mcap") == sent
    assert replays(tmp_path / "out/run.part.mcap") > 3


def test_a_duration_ends_it_whoever_is_there(tmp_path):
    with served("fig6", "--duration", "0.5s", "--pace", 4, "--out", tmp_path / "out") as session:
        session.wait()
    assert session.code == 0
    assert replays(tmp_path / "out/run.mcap") == 15


def test_a_firmware_fault_ends_it_with_exit_code_3(tmp_path):
    image = hex_file(tmp_path / "undefined.ihx", b"\xa5")
    done = program.run("serve", "fig6", "--firmware", image, "--out", tmp_path / "out", timeout=60)
    assert done.returncode == 3
    assert "mirotwin: firmware fault: net0/robot0: " in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nope"], "no such scenario"),
        (["fig6", "--tcp", "70000"], "'70000' is no port, such as 7000, or 7000@1 for network 1."),
        (["fig6", "--tcp", "0@1"], "--tcp: there is no network 1; use 0"),
        (["fig6", "--host", "203.0.113.9", "--tcp", "0"], "--tcp 0: 203.0.113.9: "),
        (["fig6", "--pace", "0"], "--pace"),
        (["fig6", "--duration", "1000000000s"], "--duration"),
        (["fig6", "--pty", "/no/such/folder/radio"], "/no/such/folder/radio: No such file or directory"),
    ],
)
def test_what_cannot_be_served_is_one_line_and_exit_code_2(mirotwin, tmp_path, arguments, said):
    assert said in mirotwin.refuses("serve", *arguments, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_sessions_under_load_replay_to_their_own_digests(tmp_path):
    with sessions.load(1):
        for seed in (0, 1):
            periods, _ = sessions.session(seed, tmp_path)
            assert periods > 10
