"""The maps of the packages against their imports, and how CONTRIBUTING draws the rooms."""

import re
import tomllib
from itertools import pairwise
from xml.etree import ElementTree

import pytest

from docs.site import floors, imports, rooms

CONTRIBUTING = (rooms.ROOT / "CONTRIBUTING.md").read_text("utf-8")
SVG = "{http://www.w3.org/2000/svg}"
ROOMS = [package for package in rooms.packages() if package.startswith("mirotwin.")]


def texts(svg):
    return [
        (text.text, float(text.get("y")), text.get("class"))
        for text in ElementTree.fromstring(svg).iter(f"{SVG}text")
    ]


@pytest.mark.parametrize("package", rooms.packages())
def test_a_map_is_as_the_imports_are(package):
    svg = rooms.file_of(package).read_text("utf-8")
    assert svg == rooms.picture(package), "run `python -m docs.site.rooms`"
    height = {
        name.removesuffix("/"): (y, label)
        for label, y, kind in texts(svg)
        if kind is None
        for name in label.split(" ⇄ ")
    }
    arrows = imports.children(package)
    assert {*height} == {name.rpartition(".")[2] for name in arrows}
    for name, others in arrows.items():
        own = height[name.rpartition(".")[2]]
        assert all(
            own[0] < there[0] or own == there
            for other in others
            for there in [height[other.rpartition(".")[2]]]
        )


@pytest.mark.parametrize("package", ROOMS)
def test_a_rooms_page_shows_its_map_and_draws_what_comes_in_and_goes_out(package):
    page = imports.modules()[package].parent / "README.md"
    text = page.read_text("utf-8")
    shown = re.findall(r"\]\(([^)]+\.svg)\)", text)
    assert [(page.parent / path).resolve() for path in shown] == [rooms.file_of(package).resolve()]
    assert "```text\n" in text


def test_each_map_is_of_a_package_of_today_and_is_shown():
    assert {*rooms.MAPS.glob("*.svg")} == {rooms.file_of(package) for package in rooms.packages()}
    for package in imports.PACKAGES:
        pages = [rooms.MAPS / "ways.md"]
        pages += [
            page
            for page in [imports.PACKAGES[package].parent / "README.md"]
            if package != "mirotwin" and page.is_file()
        ]
        assert all(f"{rooms.file_of(package).name})" in page.read_text("utf-8") for page in pages), package


def test_imports_for_types_alone_are_left_out_and_commands_are_found_by_their_texts():
    source = (
        "from typing import TYPE_CHECKING\n"
        "import miro_exact.clock\n"
        "def later():\n"
        "    from miro_exact import rng, no_module\n"
        "if TYPE_CHECKING:\n"
        "    import miro_exact.times\n"
        "else:\n"
        "    import miro_exact.state\n"
        "COMMAND = Lazy('run.run_command', 'Runs.')\n"
    )
    assert imports.imported(source) == {
        "miro_exact.clock",
        "miro_exact",
        "miro_exact.rng",
        "miro_exact.state",
        "mirotwin.run.run_command",
    }


def test_a_map_leaves_out_what_a_chain_says_and_joins_what_is_in_a_circle():
    uses = {"a": {"b", "c"}, "b": {"c"}, "c": {"d"}, "d": {"c"}}
    assert floors.reduced(floors.merged(uses)) == {
        ("a",): {("b",)},
        ("b",): {("c", "d")},
        ("c", "d"): set(),
    }
    svg = floors.drawing(uses, {"c"}, ["x"], [])
    assert [label for label, _, _ in texts(svg)] == [
        "used by: x",
        "a",
        "b",
        "c ⇄ d",
        "arrow: imports, strong frame: imported from outside",
    ]
    assert svg.count('class="arrow"') == 2
    assert svg.count('class="box door"') == 1


def test_arrows_that_can_be_drawn_without_a_crossing_are_drawn_so():
    uses = {"a": {"y"}, "b": {"x"}, "c": {"x", "z"}, "x": set(), "y": set(), "z": set()}
    boxes = floors.arranged(floors.merged(uses))
    assert floors.crossings(boxes) == 0
    assert all(
        right.x - left.x >= (left.width + right.width) / 2
        for floor in boxes
        for left, right in pairwise(floor)
    )


def test_contributing_draws_the_floors_of_the_contract():
    contracts = tomllib.loads((rooms.ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (floors,) = (one["layers"] for one in contracts if one.get("containers") == ["mirotwin"])
    drawn = "\n".join(floor.replace(" | ", "  ") for floor in floors if floor != "__main__")
    assert f"```text\n{drawn}\n```" in CONTRIBUTING


def test_what_contributing_says_to_open_is_there():
    recipes = CONTRIBUTING.partition("## I want to add ..")[2].partition("\n## ")[0]
    named = re.findall(r"`((?:mirotwin|host|sim|robot_fw|docs|tests)/[\w./]+)`", recipes)
    assert len(named) > 20
    assert [path for path in named if not (rooms.ROOT / path).exists()] == []
