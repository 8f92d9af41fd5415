"""Names of laws: our own, those of other distributions, and what is wrong with those that cannot be used."""

import importlib.metadata
import sys

import pytest

from miro_host.laws.yang_kim import Gains
from miro_host.plugins import PluginError
from miro_host.registries import LAWS
from tests import children
from tests.host.distribution import install

OWN = ["yang_kim", "body_frame", "kanayama", "dynamic_feedback", "epsilon_tracking"]
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


def test_our_own_law_is_found_by_its_name():
    assert LAWS.find("yang_kim") is Gains
    assert LAWS.names() == OWN


def test_our_own_law_is_found_without_a_look_at_other_distributions(monkeypatch):
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


def test_our_own_name_is_not_taken_from_outside(site):
    install(site, "steady-law", "1.2", {"yang_kim": "plug_steady:Parameters"}, plug_steady=GOOD)
    assert LAWS.find("yang_kim") is Gains
    assert LAWS.names() == OWN


def test_an_unknown_name_gets_the_nearest_and_the_list(site):
    install(site, "steady-law", "1.2", {"steady": "plug_steady:Parameters"}, plug_steady=GOOD)
    choices = "use yang_kim, body_frame, kanayama, dynamic_feedback, epsilon_tracking or steady"
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
        (
            "plug_bad:Steady",
            GOOD,
            "is not a struct of parameters; derive it from miro_host.laws.interface:LawParameters",
        ),
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


def test_one_name_in_two_distributions_is_refused(site):
    install(site, "steady-law", "1.2", {"steady": "plug_steady:Parameters"}, plug_steady=GOOD)
    install(site, "other-law", "7", {"steady": "plug_other:Parameters"}, plug_other=GOOD)
    assert reason("steady") == (
        "law 'steady' is in steady-law 1.2 and in other-law 7; uninstall one of them"
    ) or reason("steady") == ("law 'steady' is in other-law 7 and in steady-law 1.2; uninstall one of them")
