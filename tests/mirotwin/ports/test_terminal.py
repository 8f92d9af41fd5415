"""A pseudo-terminal, as programs open, fill and leave it."""

import os
import select

import pytest

from miro_exact.bad_input import BadInput
from mirotwin.ports import terminal
from mirotwin.ports.terminal import PtyEndpoint
from tests.mirotwin.ports.ports import soon


def test_a_terminal_passes_all_bytes_unchanged_and_without_echo(rig, tmp_path):
    port = rig.opened(PtyEndpoint(rig.context, tmp_path / "radio"))
    client = os.open(tmp_path / "radio", os.O_RDWR | os.O_NOCTTY)
    soon(port, lambda: port.client)
    everything = bytes(range(256))
    os.write(client, everything)
    assert (
        soon(port, lambda: select.select([port._master], [], [], 0)[0] == []) + port.receive() == everything
    )
    port.deliver(everything)
    port.push()
    assert os.read(client, 1000) == everything
    assert port.receive() == b""
    os.close(client)
    soon(port, lambda: not port.client)


def test_what_a_program_has_not_read_is_gone_when_the_next_one_opens_the_terminal(rig):
    port = rig.opened(PtyEndpoint(rig.context, None))
    client = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    soon(port, lambda: port.client)
    port.deliver(b"stale")
    port.push()
    os.close(client)
    soon(port, lambda: not port.client)
    client = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    soon(port, lambda: port.client)
    with pytest.raises(BlockingIOError):
        os.read(client, 100)
    os.close(client)


def test_a_program_that_writes_and_closes_at_once_is_heard(rig):
    port = rig.opened(PtyEndpoint(rig.context, None))
    client = os.open(port.path, os.O_WRONLY | os.O_NOCTTY)
    os.write(client, b"short visit")
    os.close(client)
    assert soon(port, lambda: port.clients and not port.client) == b"short visit"


def test_a_full_terminal_holds_nothing_up_and_what_is_dropped_is_counted(rig):
    port = rig.opened(PtyEndpoint(rig.context, None))
    client = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    soon(port, lambda: port.client)
    for _ in range(100):
        port.deliver(bytes(4096))
        port.push()
    assert len(port.out) == 65_536
    assert port.plug().dropped > 200_000
    os.close(client)
    soon(port, lambda: not port.client)
    assert port.plug().bytes_out + port.plug().dropped == 100 * 4096


def test_another_baud_rate_is_told_once(rig):
    termios = pytest.importorskip("termios")
    port = rig.opened(PtyEndpoint(rig.context, None))
    client = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    soon(port, lambda: port.client)
    modes = termios.tcgetattr(client)
    modes[4] = modes[5] = termios.B115200
    termios.tcsetattr(client, termios.TCSANOW, modes)
    for _ in range(2):
        os.write(client, b"x")
        soon(port, lambda: select.select([port._master], [], [], 0)[0] == [])
    port.receive()
    os.close(client)
    soon(port, lambda: not port.client)
    assert len([line for line in rig.told if "has set another baud rate; the radio has 9600" in line]) == 1


def test_a_link_is_made_and_removed_and_replaces_only_one_that_leads_nowhere(rig, tmp_path):
    link = tmp_path / "radio"
    link.symlink_to(tmp_path / "gone")
    port = PtyEndpoint(rig.context, link)
    assert os.readlink(link) == port.path
    for force in (False, True):
        with pytest.raises(
            BadInput, match="radio: another session serves it; end that one, or choose another link"
        ):
            PtyEndpoint(rig.context, link, force)
    assert os.readlink(link) == port.path
    port.close()
    assert list(tmp_path.iterdir()) == []
    link.symlink_to(os.ttyname(os.openpty()[1]))  # as a session that was killed leaves it
    with pytest.raises(BadInput, match="radio: is there already; choose another link with --pty"):
        PtyEndpoint(rig.context, link)
    other = PtyEndpoint(rig.context, link, force=True)
    assert os.readlink(link) == other.path
    other.close()
    assert list(tmp_path.iterdir()) == []
    link.write_text("years of work")
    with pytest.raises(BadInput, match="is there already"):
        PtyEndpoint(rig.context, link, force=True)
    assert link.read_text() == "years of work"


def test_a_lock_whose_file_another_session_has_just_removed_is_taken_again(tmp_path, monkeypatch):
    """Two sessions that began while a third ended had both the lock, of two files of one name."""
    fcntl = pytest.importorskip("fcntl")
    path, flock, removed = tmp_path / ".radio.lock", fcntl.flock, []

    def late(descriptor, how):
        if not removed:
            removed.append(path.unlink())
        flock(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", late)
    held = terminal._locked(path)
    with pytest.raises(BlockingIOError):
        terminal._locked(path)
    os.close(held)
