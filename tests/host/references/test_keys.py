"""References by name: our own, and what is said of one from outside that fails."""

import math
import sys

import msgspec
import pytest

from miro_host.plugins import PluginError
from miro_host.references.arc import Arc, ArcRef
from miro_host.references.interface import CheckedReference
from miro_host.references.line import LineRef, StraightLine
from miro_host.registries import REFERENCES
from miro_sim.scenario.file import parse
from tests.host.distribution import install

TURN = """
from miro_host.references.line import StraightLine
from miro_host.references.interface import ReferenceParameters

class Waiting(ReferenceParameters, frozen=True, kw_only=True, tag="waiting"):
    wait_s: float = 1.0

    def trajectory(self, duration_s):
        return Late(StraightLine(), self.wait_s)

class Late:
    def __init__(self, path, wait_s):
        self.path, self.wait_s = path, wait_s

    def at(self, t_s):
        return self.path.at(t_s - self.wait_s)
"""


def test_our_own_references_are_found_by_their_names():
    assert REFERENCES.names() == ["line", "arc", "sine", "waypoints"]
    for name in REFERENCES.names():
        assert REFERENCES.find(name).name() == name
    assert isinstance(LineRef(heading_deg=90.0).trajectory(2.0), StraightLine)
    arc = ArcRef(heading_deg=90.0, curvature_per_m=0.5).trajectory(2.0)
    assert isinstance(arc, Arc)
    assert (arc.heading_rad, arc.curvature_per_m, arc.ramp.duration_s) == (math.pi / 2, 0.5, 2.0)


def test_a_run_shorter_than_the_ramp_still_has_the_whole_ramp():
    assert LineRef(ramp_s=3.0).trajectory(1.0).ramp.duration_s == 3.0


def test_a_reference_of_another_distribution_is_named_like_our_own(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    install(tmp_path, "slow", "1", {"waiting": "plug_waiting:Waiting"}, "references", plug_waiting=TURN)
    text = 'name = "a"\nduration_s = 1\n[[network]]\n[[network.robot]]\nreference = {kind = "waiting", wait_s = 2}'
    reference = parse(text, "my.toml").networks[0].robot[0].reference
    assert reference.trajectory(1.0).at(2.3) == StraightLine().at(2.3 - 2.0)
    with pytest.raises(ValueError, match=r"robot\[0\].reference.wait: unknown key; use wait_s, in seconds"):
        parse(text.replace("wait_s", "wait"), "my.toml")
    del sys.modules["plug_waiting"]


class Broken:
    def __init__(self, answer):
        self.answer = answer

    def at(self, t_s):
        return self.answer(t_s)


GOOD = StraightLine().at(1.0)


class Point(msgspec.Struct):
    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (lambda t_s: 1.0 / 0.0, "ZeroDivisionError"),
        (lambda t_s: None, "`at` returned None, which is no Reference"),
        (lambda t_s: msgspec.structs.replace(GOOD, v_m_s=math.nan), "it returned Reference.* finite"),
        (
            lambda t_s: msgspec.structs.replace(GOOD, posture=msgspec.structs.replace(GOOD.posture, x_m=0)),
            "it returned Reference.* finite",
        ),
        (
            lambda t_s: msgspec.structs.replace(GOOD, posture=Point()),
            r"its posture is Point\(x=0.0, y=0.0, theta=0.0\), which is no Posture",
        ),
        (
            lambda t_s: msgspec.structs.replace(GOOD, posture=(0.0, 0.0, 0.0)),
            r"its posture is \(0.0, 0.0, 0.0\), which is no Posture",
        ),
    ],
)
def test_a_reference_that_fails_is_named(answer, reason):
    with pytest.raises(
        PluginError, match=rf"reference 'odd' failed at 1.500000 s: {reason}.* \(.*test_keys.py:\d+ in "
    ):
        CheckedReference(Broken(answer), "odd").at(1.5)


def test_a_good_reference_passes_unchanged():
    assert CheckedReference(StraightLine(), "line").at(1.5) == StraightLine().at(1.5)
