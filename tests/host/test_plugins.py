"""Laws and references by name: our own, those of other distributions, and what is said of those that fail."""

import importlib.metadata
import math
import re
import sys

import msgspec
import pytest

from miro_exact.installed import entries_of
from miro_exact.plugins import PluginError, use_one_of
from miro_exact.raised import raised, raised_at
from miro_host.laws.yang_kim import Gains
from miro_host.references.arc import Arc, ArcRef, LineRef, StraightLine
from miro_host.references.interface import CheckedReference
from miro_host.registries import ESTIMATORS, LAWS, REFERENCES
from miro_protocol.protocol import PROTOCOLS
from miro_sim.scenario.file import parse
from mirotwin.verify.checks.expect import CHECKS
from tests import children
from tests.exact.distribution import install

OWN = list(LAWS.own)
GOOD = """
from miro_host.laws.interface import Law, LawParameters, Velocities

class Parameters(LawParameters, frozen=True, tag="steady"):
    speed_m_s: float = 0.1

    def law(self):
        return Steady(self)

class Steady(Law[Parameters]):
    def step(self, given):
        return Velocities(self.parameters.speed_m_s, 0.0)
"""


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if name.startswith("plug_"):
            del sys.modules[name]


def reason(name):
    with pytest.raises(PluginError) as caught:
        LAWS.find(name)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_where_no_distribution_has_plug_ins_none_is_read(tmp_path, monkeypatch):
    """Reading the metadata of all takes longer than the look whether one of them says anything to us."""
    (tmp_path / "other-1.dist-info").mkdir()
    (tmp_path / "other-1.dist-info" / "entry_points.txt").write_text(
        "[console_scripts]\nother = other:main\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(importlib.metadata, "entry_points", None)
    assert LAWS.find("yang_kim") is Gains


def test_naming_laws_imports_none_of_them():
    code = "import sys, miro_sim.scenario.keys; print([name for name in sys.modules if name.startswith('miro_host')])"
    done = children.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "miro_host.registries" in done.stdout
    for name in ("miro_host.laws.yang_kim", "miro_host.estimators.predict", "miro_host.references.interface"):
        assert f"'{name}'" not in done.stdout


def test_a_law_of_another_distribution_is_found_by_its_entry_point(site):
    install(site, "steady-law", "1.2", {"steady": "plug_steady:Parameters"}, plug_steady=GOOD)
    assert LAWS.find("steady")(speed_m_s=0.5).law().parameters.speed_m_s == 0.5
    assert LAWS.names() == [*OWN, "steady"]


@pytest.mark.parametrize(
    ("registry", "kind", "name", "own"),
    [
        (LAWS, "laws", "yang_kim", "miro_host.laws.yang_kim:Gains"),
        (ESTIMATORS, "estimators", "ekf", "miro_host.estimators.ekf:EkfParameters"),
        (REFERENCES, "references", "sine", "miro_host.references.sine:SineRef"),
        (CHECKS, "checks", "inside_pitch", "mirotwin.verify.checks.course:InsidePitch"),
        (PROTOCOLS, "protocols", "miro", "miro_protocol.miro_wire:Miro"),
    ],
)
def test_another_plug_in_with_the_name_of_our_own_is_an_error_that_names_both(
    site, registry, kind, name, own
):
    install(site, "own-part", "1.2", {name: "plug_own:Parameters"}, kind, plug_own=GOOD)
    places = rf"mirotwin \({own}\) and in own-part 1.2 \(plug_own:Parameters\)"
    remedy = "uninstall own-part 1.2, or give one of them another name"
    with pytest.raises(PluginError, match=f"{registry.word} '{name}' is in {places}; {remedy}"):
        registry.find(name)
    others = [one for one in registry.own if one != name]
    assert all(registry.find(one) for one in others)  # nobody else's trouble
    assert registry.names() == list(registry.own)


def test_a_scenario_that_uses_the_ambiguous_law_by_default_says_where(site):
    install(site, "steady-law", "1.2", {"yang_kim": "plug_steady:Parameters"}, plug_steady=GOOD)
    text = 'name = "a"\nduration_s = 1\n[[network]]\n[[network.robot]]\nreference.kind = "line"\n'
    with pytest.raises(ValueError, match=r"law 'yang_kim' is in mirotwin \(.*\) and in steady-law 1.2"):
        parse(text, "my.toml")
    parse(text + 'controller.law = "body_frame"\n', "my.toml")


def test_an_unknown_name_gets_the_nearest_and_the_list(site):
    install(site, "steady-law", "1.2", {"steady": "plug_steady:Parameters"}, plug_steady=GOOD)
    choices = f"{use_one_of([*OWN, 'steady'])}, or one of your own: --law FILE.py:CLASS"
    assert reason("stedy") == f"'stedy' is not one of the choices; did you mean steady? {choices}"
    assert reason("pid") == f"'pid' is not one of the choices; {choices}"


@pytest.mark.parametrize(
    ("value", "module", "expected"),
    [
        ("plug_bad:Parameters", "import no_such_module", "No module named 'no_such_module'"),
        ("plug_bad:Parameters", "def f(:", "SyntaxError: invalid syntax"),
        ("plug_bad:Parameters", "raise SystemExit(3)", "cannot be imported: SystemExit: 3"),
        ("plug_bad:Parameters", "1 / 0", "cannot be imported: ZeroDivisionError: division by zero"),
        ("plug_bad:Absent", GOOD, "AttributeError: module 'plug_bad' has no attribute 'Absent'"),
        ("plug_bad:Steady", GOOD, "is not a struct of parameters; derive it from miro_host.laws.interface:"),
        ("plug_bad:Parameters", GOOD, "has the tag 'steady'; give the class tag='bad'"),
        (
            "plug_bad:Parameters",
            GOOD.replace("frozen=True", "forbid_unknown_fields=False").replace("steady", "bad"),
            "can change, or takes unknown keys; give the class frozen=True",
        ),
    ],
)
def test_a_part_that_cannot_be_used_names_its_distribution_and_the_reason(site, value, module, expected):
    install(site, "bad-law", "0.3", {"bad": value}, plug_bad=module)
    message = reason("bad")
    assert message.startswith(f"law 'bad' ({value}, from bad-law 0.3) ")
    assert expected in message


@pytest.mark.parametrize("error", [AttributeError, ValueError])
def test_an_entry_point_that_names_no_module_is_one_line_whatever_its_library_raises(
    site, monkeypatch, error
):
    """`importlib.metadata` raises AttributeError; the package `importlib_metadata`, once imported, ValueError."""

    def load(entry):
        raise error("Invalid object reference.\nSee https://packaging.python.org")

    install(site, "bad-law", "0.3", {"bad": "1 + 1"})
    (entry,) = entries_of("mirotwin.laws", "bad")
    monkeypatch.setattr(type(entry), "load", load)
    expected = (
        f"law 'bad' (1 + 1, from bad-law 0.3) cannot be imported: {error.__name__}: Invalid object reference."
    )
    assert reason("bad").startswith(expected)
    assert "\n" not in reason("bad")


def test_one_name_in_two_distributions_is_refused(site):
    install(site, "steady-law", "1.2", {"steady": "plug_steady:Parameters"}, plug_steady=GOOD)
    install(site, "other-law", "7", {"steady": "plug_other:Parameters"}, plug_other=GOOD)
    found = re.fullmatch(
        "law 'steady' is in (.*) and in (.*); uninstall .* or .*, or give one of them another name",
        reason("steady"),
    )
    assert {*found.groups()} == {
        "steady-law 1.2 (plug_steady:Parameters)",
        "other-law 7 (plug_other:Parameters)",
    }


def error_in(module, caller):
    """What a function in a module raises that another module calls."""
    names = {"__name__": module}
    exec(compile("def load():\n    raise AttributeError", f"{module}.py", "exec"), names)
    try:
        exec("load()", {"__name__": caller, "load": names["load"]})
    except AttributeError as error:
        return error.with_traceback(error.__traceback__ and error.__traceback__.tb_next)
    raise AssertionError


OURS = "mirotwin.verify.checks.monitors"


@pytest.mark.parametrize(
    ("module", "place"), [("plugged", "plugged.py:2 in load"), ("importlib_metadata", "")]
)
def test_the_place_is_in_the_plug_ins_code_and_not_in_what_loads_it(module, place):
    assert raised_at(error_in(module, OURS)) == place


@pytest.mark.parametrize(
    ("module", "place"),
    [
        ("mirotwin.verify.checks.course", " (mirotwin.verify.checks.course.py:2 in load)"),
        ("importlib_metadata", ""),
    ],
)
def test_of_a_plug_in_in_this_tree_the_place_is_where_it_raised(module, place):
    assert raised(error_in(module, OURS)) == f"AttributeError{place}"


WAITING = """
from miro_host.references.arc import StraightLine
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
    assert REFERENCES.names() == ["line", "arc", "sine", "waypoints", "timed"]
    for name in REFERENCES.names():
        assert REFERENCES.find(name).name() == name
    assert isinstance(LineRef(heading_deg=90.0).trajectory(2.0), StraightLine)
    arc = ArcRef(heading_deg=90.0, curvature_per_m=0.5).trajectory(2.0)
    assert isinstance(arc, Arc)
    assert (arc.heading_rad, arc.curvature_per_m, arc.ramp.duration_s) == (math.pi / 2, 0.5, 2.0)


def test_a_run_shorter_than_the_ramp_still_has_the_whole_ramp():
    assert LineRef(ramp_s=3.0).trajectory(1.0).ramp.duration_s == 3.0


def test_a_reference_of_another_distribution_is_named_like_our_own(site):
    install(site, "slow", "1", {"waiting": "plug_waiting:Waiting"}, "references", plug_waiting=WAITING)
    text = 'name = "a"\nduration_s = 1\n[[network]]\n[[network.robot]]\nreference = {kind = "waiting", wait_s = 2}'
    reference = parse(text, "my.toml").networks[0].robot[0].reference
    assert reference.trajectory(1.0).at(2.3) == StraightLine().at(2.3 - 2.0)
    with pytest.raises(ValueError, match=r"robot\[0\].reference.wait: unknown key; use wait_s, in seconds"):
        parse(text.replace("wait_s", "wait"), "my.toml")


THERE = StraightLine().at(1.0)
replace = msgspec.structs.replace


class Broken:
    """Answers what it is made with; a class raises."""

    def __init__(self, answer):
        self.answer = answer

    def at(self, t_s):
        if isinstance(self.answer, type):
            raise self.answer
        return self.answer


class Point(msgspec.Struct):
    x: float = 0.0


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (ZeroDivisionError, "ZeroDivisionError"),
        (None, "`at` returned None, which is no Reference"),
        (replace(THERE, v_m_s=math.nan), "it returned Reference.* finite"),
        (replace(THERE, posture=replace(THERE.posture, x_m=0)), "it returned Reference.* finite"),
        (replace(THERE, posture=Point()), r"its posture is Point\(x=0.0\), which is no Posture"),
        (replace(THERE, posture=(0.0,)), r"its posture is \(0.0,\), which is no Posture"),
    ],
)
def test_a_reference_that_fails_is_named(answer, reason):
    where = r".* \(.*test_plugins.py:\d+ in "
    with pytest.raises(PluginError, match=rf"reference 'odd' failed at 1.500000 s: {reason}{where}"):
        CheckedReference(Broken(answer), "odd").at(1.5)


def test_a_good_reference_passes_unchanged():
    assert CheckedReference(StraightLine(), "line").at(1.5) == StraightLine().at(1.5)
