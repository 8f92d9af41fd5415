"""`mirotwin plugins`: what is installed, with its keys and where it comes from."""

import json
from pathlib import Path

import pytest

from miro_host.registries import LAWS
from miro_sim.scenario.parts import PARTS
from mirotwin.run.plugins_command import BY_KIND, about
from mirotwin.verify.checks.expect import CHECKS
from tests.exact import distribution
from tests.sim.test_board_file import SONAR

LAW = '''"""Drives on. A second sentence."""

from miro_host.laws.interface import LawParameters


class Parameters(LawParameters, frozen=True, kw_only=True, tag="straight_on"):
    gain_per_s: float = 2.5
'''


def listed(mirotwin, *kinds):
    return json.loads(mirotwin.succeeds("plugins", *kinds, "--json"))["plugins"]


def test_all_kinds_are_listed_with_a_line_each(mirotwin):
    rows = {line.split()[0]: line for line in mirotwin.succeeds("plugins").splitlines() if line.strip()}
    assert {*BY_KIND, *LAWS.own, *PARTS.own, *CHECKS.own, "pixels", "miro"} <= set(rows)
    assert rows["relay"].endswith("and a contact that follows some milliseconds later.")
    assert rows["kanayama"].endswith(
        "The tracking law of Y. Kanayama, Y. Kimura, F. Miyazaki, T. Noguchi (IEEE ICRA 1990)."
    )


def test_a_kind_is_listed_with_keys_units_defaults_and_files(mirotwin):
    out = mirotwin.succeeds("plugins", "laws")
    assert "    q1_per_s          a number in 1/s, 0 to 1000000                               0.53\n" in out
    assert f"{Path('laws', 'yang_kim.py')}\n" in out
    assert "inside_pitch" not in out
    assert "    limit_cm*  a number in centimetres" in mirotwin.succeeds("plugins", "checks")


@pytest.mark.parametrize("kind", BY_KIND)
def test_every_plug_in_of_ours_says_what_it_is_and_has_its_source(mirotwin, kind):
    plugins = listed(mirotwin, kind)
    assert plugins
    for plugin in plugins:
        assert plugin["about"].endswith(".")
        assert plugin["distribution"] == "mirotwin"
        assert Path(plugin["file"]).suffix == ".py"
        assert Path(plugin["file"]).is_file()
        assert not plugin["problem"]


def test_the_json_names_the_unit_of_a_key(mirotwin):
    (law,) = (one for one in listed(mirotwin, "laws", "cameras") if one["name"] == "yang_kim")
    key = {"key": "p2_rad_s2", "takes": "a number in radians per second squared, 0 to 1000000"}
    assert key | {"default": "0.69", "unit": "radians per second squared"} in law["keys"]


def test_those_of_others_are_listed_with_their_distribution_or_why_they_cannot_be_used(
    mirotwin, tmp_path, monkeypatch
):
    parts = {"sonar": "sonar_kit:Sonar", "broken": "broken_kit:Part"}
    distribution.install(tmp_path, "sonar-kit", "1.2", parts, "parts", sonar_kit=SONAR, broken_kit="1 // 0")
    distribution.install(
        tmp_path, "straight", "3.4", {"straight_on": "straight_law:Parameters"}, straight_law=LAW
    )
    monkeypatch.syspath_prepend(tmp_path)
    out = mirotwin.succeeds("plugins")
    assert "A part of one's own. (sonar-kit 1.2)" in out
    assert "cannot be imported: ZeroDivisionError" in out
    assert "straight_on       Drives on. (straight 3.4)" in out
    (law,) = (one for one in listed(mirotwin, "laws") if one["name"] == "straight_on")
    assert (law["distribution"], law["version"]) == ("straight", "3.4")
    assert law["file"] == f"{tmp_path / 'straight_law.py'}"
    (broken,) = (one for one in listed(mirotwin, "parts") if one["name"] == "broken")
    assert broken["version"] == "1.2"
    assert "repair or uninstall sonar-kit 1.2" in broken["problem"]


def test_a_class_without_a_docstring_has_not_that_of_its_base():
    from miro_host.laws.interface import LawParameters

    class Bare(LawParameters, frozen=True, kw_only=True, tag="bare"):
        gain_per_s: float = 1.0

    Bare.__module__ = "no_such_module"
    assert about(Bare) == ""


def test_an_unknown_kind_is_refused_with_the_kinds_that_there_are(mirotwin):
    assert "'lawz' is not one of 'laws', 'estimators'" in mirotwin.ends(2, "plugins", "lawz")
