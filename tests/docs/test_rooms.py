"""The maps of the house: each folder's README, and how CONTRIBUTING draws the rooms."""

import re
import tomllib

import pytest

from docs.site import rooms

CONTRIBUTING = (rooms.ROOT / "CONTRIBUTING.md").read_text("utf-8")


@pytest.mark.parametrize("folder", rooms.folders(), ids=lambda folder: str(folder.relative_to(rooms.ROOMS)))
def test_a_folder_says_who_uses_it_and_what_its_files_are(folder):
    text = (folder / "README.md").read_text("utf-8")
    assert rooms.with_map(folder) == text, "run `python -m docs.site.rooms`"
    assert "```text\n" in text.partition(rooms.BEGIN)[0], "draw what comes in and what goes out"


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
