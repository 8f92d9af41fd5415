"""`mirotwin run --live`: viewers get what the export holds, and change nothing."""

from __future__ import annotations

import io
import os
import signal
import socket
import sys
import time
from collections import Counter

import pytest
from mcap.reader import make_reader

from miro_exact.clock import CONTROL_PERIOD_TICKS, nanoseconds
from mirotwin.report.foxglove import derived
from mirotwin.report.foxglove.messages import ALWAYS, INFO, Log
from mirotwin.report.foxglove.server import Server
from mirotwin.run import run_command as run_module  # noqa: F401  loaded before the SDK is hidden
from tests.mirotwin.conftest import SHORT
from tests.mirotwin.report.foxglove import rig
from tests.mirotwin.report.foxglove.client import Viewer, live


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Six control periods."""
    path = tmp_path_factory.mktemp("short") / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="module")
def unwatched(mirotwin, short):
    """What a run with seed 3 records, with frames, without --live."""
    out = short.parent / "out"
    done = mirotwin("run", short, "--seed", 3, "--out", out, "--record-frames", "--no-figure", "-q")
    assert done == (0, "", "")
    return (out / "run.mcap").read_bytes()


def contents(data: bytes) -> Counter[tuple[str, int, bytes]]:
    """Topic, time and bytes of all messages in a file."""
    rows = make_reader(io.BytesIO(data)).iter_messages()
    return Counter((channel.topic, message.log_time, message.data) for _, channel, message in rows)


def test_a_viewer_gets_every_message_of_the_export_and_changes_no_byte_of_the_recording(
    unwatched, short, tmp_path
):
    out = tmp_path / "out"
    arguments = (short, "--seed", 3, "--out", out, "--record-frames", "--pace", 1, "--live-wait", "-q")
    with live(*arguments) as (process, url):
        viewer = Viewer(url)
        viewer.done()
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert (out / "run.mcap").read_bytes() == unwatched
    wanted = contents(rig.exported(unwatched)[0])
    assert Counter(viewer.messages) == wanted
    assert viewer.times_ns == [nanoseconds(index * CONTROL_PERIOD_TICKS) for index in range(6)]
    assert (viewer.info["capabilities"], viewer.info["sessionId"]) == (["time"], "short-3")
    schemas = {one.topic: one.name for one in rig.read(rig.exported(unwatched)[0])}
    told = {one["topic"]: one["schemaName"] for one in viewer.channels.values()}
    assert schemas.items() <= told.items()


def test_what_was_sent_last_has_time_to_get_to_a_viewer():
    with Server("127.0.0.1", 0, "short-3") as server:
        server.open([derived.log(0, Log(ALWAYS, INFO, "first", ""))])
        viewer = Viewer(server.url)
        server.wait_for_viewer()
        server.send(derived.log(0, Log(ALWAYS, INFO, "last", "")))
    assert any(b"last" in message for _, _, message in viewer.done().messages)


def test_viewers_that_come_late_and_go_early_change_no_byte_either(unwatched, short, tmp_path):
    out = tmp_path / "out"
    with live(short, "--seed", 3, "--out", out, "--record-frames", "--pace", 0.1, "-q") as (process, url):
        first, second = Viewer(url, stop_after=20), Viewer(url)
        first.done()
        second.done()
        assert process.wait(60) == 0
    assert (out / "run.mcap").read_bytes() == unwatched
    late = Counter(second.messages)
    assert late <= contents(rig.exported(unwatched)[0])
    assert any(topic == "/foxglove/transforms" for topic, _, _ in late)


def test_without_a_viewer_the_recording_is_the_same_too(unwatched, short, tmp_path):
    out = tmp_path / "out"
    with live(short, "--seed", 3, "--out", out, "--record-frames", "--pace", "max") as (process, _):
        assert process.stdout is not None
        assert "x real time" in process.stdout.read()  # the table, as always
        assert process.wait(60) == 0
    assert (out / "run.mcap").read_bytes() == unwatched


def test_a_failed_check_is_an_error_in_the_log(short, tmp_path):
    out = tmp_path / "out"
    expected = ("--expect", "tracks_within_cm=0.001", "--pace", 1, "--live-wait", "-q")
    with live(short, "--out", out, *expected) as (process, url):
        viewer = Viewer(url)
        viewer.done()
        assert process.wait(60) == 1
    lines = [data for topic, _, data in viewer.messages if topic == "/foxglove/log"]
    assert any(b'"level":4' in line and b"tracks_within_cm: net0/robot" in line for line in lines)


def test_a_run_keeps_the_pace_that_it_is_told(short, tmp_path):
    with live(short, "--out", tmp_path / "out", "--pace", 0.2, "-q") as (process, url):
        began_s = time.monotonic()
        Viewer(url).done()
        assert process.wait(60) == 0
    assert time.monotonic() - began_s > 0.7  # 0.2 s of virtual time take one second


def test_ctrl_c_leaves_the_parts_of_the_run_and_closes_the_server(short, tmp_path):
    out = tmp_path / "out"
    with live(short, "--out", out, "--pace", 0.05) as (process, url):
        viewer = Viewer(url, stop_after=30)
        viewer.done()
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "mirotwin: interrupted"
    assert sorted(os.listdir(out)) == ["run.part.mcap", "summary.part.json"]
    with pytest.raises(ConnectionRefusedError):
        Viewer(url)


def test_a_port_that_is_taken_is_refused_before_anything_is_written(mirotwin, short, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, out, err = mirotwin("run", short, "--out", tmp_path / "out", "--live", port)
    assert (code, out, (tmp_path / "out").exists()) == (2, "", False)
    assert err.startswith(f"mirotwin: error: --live: cannot listen at 127.0.0.1:{port}: ")
    assert err.endswith("choose another place, --live=HOST:PORT; port 0 is any that is free\n")
    assert err.count("\n") == 1


def test_without_the_library_one_line_says_what_to_install(mirotwin, short, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "websockets.asyncio.server", None)
    code, out, err = mirotwin("run", short, "--out", tmp_path / "out", "--live")
    assert (code, out, (tmp_path / "out").exists()) == (2, "", False)
    assert err == "mirotwin: error: --live: websockets is not installed; pip install 'mirotwin[live]'\n"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--pace", "2"), "--pace needs --live."),
        (("--live-wait",), "--live-wait needs --live."),
        (
            ("--live", "fig6"),
            "Invalid value for '--live': 'fig6' is no HOST:PORT; write --live=127.0.0.1:8765, or",
        ),
        (("--live", "localhost:65536"), "Invalid value for '--live': 'localhost:65536' is no HOST:PORT"),
        (("--live", "--pace", "0"), "Invalid value for '--pace': "),
        (("--live", "--pace", "fast"), "Invalid value for '--pace': "),
        (("--live", "nowhere.invalid:0"), "--live: cannot listen at nowhere.invalid:0: "),
    ],
)
def test_options_that_cannot_be_meant_are_refused(mirotwin, short, tmp_path, options, expected):
    code, _, err = mirotwin("run", short, "--out", tmp_path / "out", *options)
    assert (code, (tmp_path / "out").exists()) == (2, False)
    assert err.startswith(f"mirotwin: error: {expected}")
    assert err.count("\n") == 1
