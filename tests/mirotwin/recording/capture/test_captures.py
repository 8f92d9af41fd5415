"""Captures of other tools: what each is taken for, the frames in it, and their times."""

import re

import pytest

from miro_protocol import stream
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.input import HEAD_BYTES
from tests.mirotwin.recording.capture.captured import FORMS, FRAMES, SECOND, SESSION


@pytest.fixture
def capture(tmp_path):
    """A file of this form that holds the session."""

    def write(name, sent=SESSION):
        path = tmp_path / name
        path.write_bytes(FORMS[name].write(sent))
        return path

    return write


@pytest.mark.parametrize("name", FORMS)
def test_each_form_is_recognised_and_gives_its_frames_at_their_times(mirotwin, capture, name, tmp_path):
    form, path = FORMS[name], capture(name)
    assert detect(path.read_bytes()[:HEAD_BYTES]).form == form.detected
    code, out, err = mirotwin("decode", path)
    assert code == 0, err
    assert re.search(rf"{re.escape(str(path))}: read as .+, .+\n", err)
    assert f"frames: {len(FRAMES)} accepted, 0 stale, 0 telemetry; 0 damaged" in out
    options = [] if form.step_s else ["--assume-contiguous"]
    assert mirotwin("export", path, "--out", tmp_path / "made.stream", *options)[0] == 0
    made = stream.read(tmp_path / "made.stream").transmissions()
    assert b"".join(one.data for one in made) == b"".join(FRAMES)
    if form.step_s:
        assert [one.data for one in made] == FRAMES
        worst_s = max(abs(one.tick - sent.tick) for one, sent in zip(made, SESSION, strict=True)) / SECOND
        assert worst_s <= form.step_s


@pytest.mark.parametrize("name", [name for name, form in FORMS.items() if form.step_s is None])
def test_what_has_no_times_is_replayed_only_as_if_without_a_pause(mirotwin, capture, name):
    path = capture(name)
    assert "without times; --assume-contiguous takes all characters" in mirotwin.refuses("replay", path)
    assert mirotwin("replay", path, "--assume-contiguous", "-q")[0] == 0
