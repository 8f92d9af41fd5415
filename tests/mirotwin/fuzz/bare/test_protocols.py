"""Wire formats by name and parameters, ours and those of distributions."""

import sys

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol.miro_wire import Miro
from mirotwin.fuzz.bare import protocol_named
from tests.host import distribution

THEIRS = """
from miro_protocol.protocol import Protocol

class Lines(Protocol, frozen=True, tag="lines"):
    end: str = "x"
    def encode(self, body):
        return body + self.end.encode()

class Other:
    pass
"""


def test_ours_by_name_with_parameters():
    assert protocol_named("miro") == Miro(robots=3)
    assert protocol_named("miro:robots=5") == Miro(robots=5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mire", "'mire' is not one of the choices; did you mean miro?"),
        ("miro:robots=4", "miro:robots=4: robots: invalid enum value 4; miro has robots"),
        ("miro:robots", "'robots' are no parameters; write NAME:KEY=VALUE,KEY=VALUE, such as miro:robots=5"),
        ("miro:rate=1", "miro:rate=1: rate: unknown key; miro has robots"),
        ("", "'' is not one of the choices"),
    ],
)
def test_what_is_no_protocol_is_refused(text, said):
    with pytest.raises(BadInput) as caught:
        protocol_named(text)
    assert str(caught.value).startswith(f"--protocol: {said}")


def test_a_distribution_may_bring_one(tmp_path, monkeypatch):
    parts = {"lines": "their_lines:Lines", "other": "their_lines:Other"}
    distribution.install(tmp_path, "theirs", "1.0", parts, "protocols", their_lines=THEIRS)
    monkeypatch.syspath_prepend(tmp_path)
    assert protocol_named('lines:end="\\n"').encode(b"a") == b"a\n"
    with pytest.raises(BadInput, match="is not a struct of parameters; derive it from miro_protocol"):
        protocol_named("other")
    sys.modules.pop("their_lines")
