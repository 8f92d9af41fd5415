"""The documentation site builds without a warning, has every command and every public name, and needs no network."""

from __future__ import annotations

import html
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests import children
from tests.docs import sandbox

import mirotwin
from mirotwin.cli import COMMANDS
from mirotwin.cli.campaign import COMMANDS as CAMPAIGN
from mirotwin.cli.fw import COMMANDS as FW

ROOT = sandbox.ROOT
FETCHED = re.compile(r"""<(?:script|img|iframe|link)\b[^>]*?(?:src|href)=["']?(https?:)?//[^"'\s>]+""")
LINK = re.compile(r"\]\(([^()\s#:]+)(?:#[^()\s]*)?\)")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="needs the extra docs")
    folder = tmp_path_factory.mktemp("site")
    path = os.pathsep.join([str(ROOT), *(str(ROOT / name) for name in sandbox.PACKAGES)])
    done = children.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": path, "NO_MKDOCS_2_WARNING": "1", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert not [line for line in done.stderr.splitlines() if not line.startswith("INFO")]
    return folder


def pages(site: Path) -> Iterator[tuple[str, str]]:
    for path in sorted(site.rglob("*.html")):
        yield path.relative_to(site).as_posix(), path.read_text("utf-8")


def test_every_command_has_its_heading(site: Path) -> None:
    text = (site / "reference/cli.html").read_text("utf-8")
    headings = set(re.findall(r'<h\d id="([\w-]+)"', text))
    wanted = {f"mirotwin-{name}" for name in COMMANDS}
    wanted |= {f"mirotwin-campaign-{name}" for name in CAMPAIGN} | {f"mirotwin-fw-{name}" for name in FW}
    assert not wanted - headings
    assert "--save-at" in text


def test_every_public_name_is_in_the_reference(site: Path) -> None:
    text = html.unescape((site / "reference/mirotwin.html").read_text("utf-8"))
    anchors = set(re.findall(r'id="([\w.]+)"', text))
    modules = {"campaign", "conditions", "frames", "recording", "replay", "testing"}
    missing = [
        name
        for name in mirotwin.__all__
        if f"mirotwin.{name}" not in anchors and not (name in modules and f"mirotwin.{name}" in text)
    ]
    assert not missing


def test_keys_channels_and_columns_are_the_codes(site: Path) -> None:
    keys = (site / "formats/scenario.html").read_text("utf-8")
    for key in (
        "bit_error_rate",
        "window_px",
        "gamma1_per_s",
        "compute_s",
        "busy_clocks",
        "torque_constant_nm_a",
    ):
        assert f"<code>{key}</code>" in keys, key
    assert "exposed_tick" in (site / "formats/recording.html").read_text("utf-8")
    assert "rms_position_cm" in (site / "formats/parquet.html").read_text("utf-8")


def test_no_page_fetches_anything_from_elsewhere(site: Path) -> None:
    assert not [(name, found[0]) for name, text in pages(site) for found in FETCHED.finditer(text)]


def test_no_markdown_is_left_in_a_page(site: Path) -> None:
    """What Python-Markdown takes otherwise than GitHub does: a list behind a line of text, a table behind one."""
    left = []
    for name, text in pages(site):
        if name.startswith("source/"):
            continue
        plain = re.sub(r"<(pre|code|title)\b.*?</\1>", "", text, flags=re.DOTALL)
        left += [
            (name, found[0])
            for found in re.finditer(r"^(\* |- |\|-).{,60}|\]\([^)\s]{,60}\)|^```.{,60}", plain, re.M)
        ]
    assert not left


@pytest.mark.parametrize("document", sandbox.documents())
def test_links_lead_to_files_of_the_tree(document: str) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", (ROOT / document).read_text("utf-8"), flags=re.DOTALL)
    folder = (ROOT / document).parent
    assert not [target for target in LINK.findall(text) if not (folder / target).exists()]
