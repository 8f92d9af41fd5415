"""The pages that say what is exact and what was chosen: each test that they name is there, and nothing is left out."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LEDGER = ROOT / "docs" / "fidelity.md"
CHIP = ROOT / "robot_fw" / "miro_robot" / "mcs51"
LM629 = ROOT / "robot_fw" / "miro_robot" / "lm629" / "options.py"
DISAGREEMENTS = ROOT / "tests" / "robot" / "ucsim" / "disagreements.csv"
PAGES = (LEDGER, ROOT / "docs/background/theory.md", CHIP / "README.md", DISAGREEMENTS)
NAMED = re.compile(r"`([\w./]*test_\w+\.py)(?:::(\w+))?`")
RULE = re.compile(r"^\* ([A-Z][0-9]+): ", re.M)
OPTION = re.compile(r'^    """([A-Z][0-9]+): ', re.M)
ROW = re.compile(r"^\* \*\*(?P<part>.+?)\*\*: (?P<what>.+)$")
STANDINGS = ("Exact:", "Chosen:", "Thinner:", "Absent:")
LINK = re.compile(r"\]\([^)]+\)")


def functions_of(path):
    """Names of the functions that pytest collects from a file."""
    tree = ast.parse(path.read_text())
    return {
        node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_test_that_a_page_names_is_there(page):
    named = NAMED.findall(page.read_text())
    assert len(named) >= 15
    for file, test in named:
        folders = (ROOT, ROOT / "tests" / "robot" / "mcs51", page.parent)
        path = next((folder / file for folder in folders if (folder / file).exists()), None)
        assert path, file
        assert not test or test in functions_of(path), f"{file}::{test}"


def test_each_row_of_the_ledger_has_a_standing_and_a_test_or_a_page_or_a_reason():
    standing, parts = "", set()
    for line in LEDGER.read_text().splitlines():
        if line.startswith("## ") or line in STANDINGS:
            standing = line
        if line.startswith("* **"):
            row = ROW.match(line)
            assert row, line
            assert standing in STANDINGS, line
            assert NAMED.search(line) or LINK.search(line) or "because" in line.lower(), line
            assert row["part"] not in parts, line
            parts.add(row["part"])
    assert len(parts) > 100


def test_the_ledger_speaks_of_every_group_of_rules():
    """A letter a group: LM629 options (B1, E1, ..) as a group each, and the rules of the AT89C52."""
    ledger = LEDGER.read_text()
    lm629 = {rule[0] for rule in OPTION.findall(LM629.read_text())}
    assert lm629 == set("BEWIRTDPFOX")
    for letter in lm629:
        assert f"({letter})" in ledger, letter
    chip = RULE.findall((CHIP / "README.md").read_text())
    for letter in "CITUX":
        last = max(int(rule[1:]) for rule in chip if rule[0] == letter)
        assert f"{letter}1 to {letter}{last}" in ledger, letter


def test_every_rule_letter_in_the_code_is_on_the_page_of_its_chip():
    """Comments name rules as (C1) or X2; a letter that no page explains helps no reader."""
    known = set(RULE.findall((CHIP / "README.md").read_text()))
    for path in sorted(CHIP.glob("*.py")):
        for rule in re.findall(r"\(([CTUIPX][0-9])[):,]", path.read_text()):
            assert rule in known, f"{path.name}: {rule}"
