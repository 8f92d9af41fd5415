"""The documentation site builds without a warning, has all commands and public names, needs no network, no server."""

import html
import os
import re
import sys
import tarfile
import tomllib

import pytest

import mirotwin
from docs.site import address
from mirotwin.commands import CAMERA, CAMPAIGN, FIRMWARE, SECTIONS
from mirotwin.conform.rules import CHAPTERS
from tests import children
from tests.docs import sandbox
from tests.mirotwin.report.page import browser

pytestmark = pytest.mark.slow

ROOT = sandbox.ROOT
FETCHED = re.compile(r"""<(?:script|img|iframe|link)\b[^>]*?(?:src|href)=["']?(https?:)?//[^"'\s>]+""")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
LINK = re.compile(r"\]\(([^()\s#:]+)(?:#[^()\s]*)?\)")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("properdocs", reason="needs the extra docs")
    folder = tmp_path_factory.mktemp("site")
    path = os.pathsep.join([str(ROOT), *(str(ROOT / name) for name in sandbox.PACKAGES)])
    done = children.run(
        [sys.executable, "-m", "properdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert not [line for line in done.stderr.splitlines() if not line.startswith("INFO")]
    return folder


def pages(site):
    for path in sorted(site.rglob("*.html")):
        yield path.relative_to(site).as_posix(), path.read_text("utf-8")


def test_every_command_has_its_heading(site):
    text = (site / "reference/cli.html").read_text("utf-8")
    headings = set(re.findall(r'<h\d id="([\w-]+)"', text))
    wanted = {f"mirotwin-{name}" for section in SECTIONS.values() for name in section}
    for group, names in (("campaign", CAMPAIGN), ("camera", CAMERA), ("fw", FIRMWARE)):
        wanted |= {f"mirotwin-{group}-{name}" for name in names}
    assert not wanted - headings
    assert "--save-at" in text


def test_every_public_name_is_in_the_reference(site):
    text = html.unescape((site / "reference/mirotwin.html").read_text("utf-8"))
    anchors = set(re.findall(r'id="([\w.]+)"', text))
    modules = {"campaign", "conditions", "frames", "recording", "replay", "testing"}
    missing = [
        name
        for name in mirotwin.__all__
        if f"mirotwin.{name}" not in anchors and not (name in modules and f"mirotwin.{name}" in text)
    ]
    assert not missing


def test_keys_channels_columns_and_rules_are_the_codes(site):
    keys = (site / "formats/scenario.html").read_text("utf-8")
    some = {"bit_error_rate", "window_px", "gamma1_per_s", "compute_s", "busy_clocks", "torque_constant_nm_a"}
    assert some <= set(re.findall(r"<code>(\w+)</code>", keys))
    for key, span in (
        ("wheel_radius_m", "number (&gt;= 0.001, &lt;= 1)"),
        ("baud_offset_ppm", "whole number (&gt;= -50000, &lt;= 50000)"),
    ):
        assert f"<td><code>{key}</code></td>\n<td>{span}</td>" in keys
    assert "exposed_tick" in (site / "formats/recording.html").read_text("utf-8")
    assert "rms_position_cm" in (site / "formats/parquet.html").read_text("utf-8")
    rules = re.findall(r"<tr>\n<td>(P\d\d)</td>", (site / "conformance.html").read_text("utf-8"))
    assert rules == [rule.id for chapter in CHAPTERS for rule in chapter.rules]
    assert "<td>timer-1-beside-mode-3</td>" in (site / "tests/vectors/index.html").read_text("utf-8")


def test_no_page_fetches_anything_from_elsewhere(site):
    assert not [(name, found[0]) for name, text in pages(site) for found in FETCHED.finditer(text)]


def test_no_markdown_is_left_in_a_page(site):
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
def test_links_lead_to_files_of_the_tree(document):
    text = re.sub(r"```.*?```|`[^`\n]*`", "", (ROOT / document).read_text("utf-8"), flags=re.DOTALL)
    folder = (ROOT / document).parent
    assert not [target for target in LINK.findall(text) if not (folder / target).exists()]


def words(markup):
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", markup)).split())


def test_every_page_says_its_version_and_licence(site):
    for name, text in pages(site):
        footer = re.search(r'<div class="md-copyright">.*?</div>', text, re.DOTALL)
        header = re.search(r'<div class="md-header__source">.*?</a>', text, re.DOTALL)
        assert footer, name
        assert words(footer[0]).startswith(f"Mirotwin {VERSION}"), name
        assert "MIT licence" in footer[0], name
        assert header is None or VERSION in words(header[0]), name


@pytest.mark.skipif(bool(address.known()), reason="the address of the repository is set")
@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="an archive of the source is made of a commit")
def test_without_an_address_the_source_is_an_archive_beside_the_pages(site):
    with tarfile.open(site / f"mirotwin-{VERSION}.tar.gz") as archive:
        names = set(archive.getnames())
    assert {f"mirotwin-{VERSION}/README.md", f"mirotwin-{VERSION}/setup.py"} <= names
    for page, archive_link in (
        ("index", ""),
        ("howto/ci", "../"),
        ("mirotwin/report/page/index", "../../../"),
    ):
        text = (site / f"{page}.html").read_text("utf-8")
        assert f'<a href="{archive_link}mirotwin-{VERSION}.tar.gz"' in text


def test_programs_that_make_documents_are_not_published(site):
    assert not (site / "film").exists()
    assert not list(site.rglob("*.py"))
    assert not (site / "site/theme").exists()


def test_the_index_of_how_tos_has_each_with_its_first_sentence(site):
    nav = (
        (ROOT / "properdocs.yml").read_text("utf-8").partition("- How to:\n")[2].partition("  - Files:\n")[0]
    )
    leaves = [leaf for leaf in re.findall(r": (\S+)\.md$", nav, re.MULTILINE) if leaf != "howto/index"]
    table = re.search(r"<tbody>.*?</tbody>", (site / "howto/index.html").read_text("utf-8"), re.DOTALL)
    assert table
    rows = [re.findall(r"<td>(.*?)</td>", row, re.DOTALL) for row in table[0].split("</tr>") if "<td>" in row]
    wanted = {f"{os.path.relpath(leaf, 'howto')}.html".replace("README", "index") for leaf in leaves}
    targets = [re.search(r'href="([^"]+)"', row[1]) for row in rows]
    assert {found[1] for found in targets if found} == wanted
    for row, found in zip(rows, targets, strict=True):
        assert found
        sentence = words(row[2])
        assert re.fullmatch(r"[A-Z].*\.", sentence), sentence
        page = words((site / "howto" / found[1]).read_text("utf-8"))
        assert re.sub(r"\W", "", sentence) in re.sub(r"\W", "", page)


@pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)
def test_search_works_in_a_page_that_is_opened_from_a_disk(site):
    from selenium.webdriver.support.ui import WebDriverWait

    with browser.chromium() as driver:
        driver.get((site / "howto/index.html").as_uri())
        driver.execute_script("document.querySelector('input[name=query]').focus()")
        driver.find_element("css selector", "input[name=query]").send_keys("Wireshark dissector")
        found = WebDriverWait(driver, browser.PATIENCE_S, 0.1).until(
            lambda one: one.find_elements("css selector", ".md-search-result__link")
        )
        assert "/protocol/index.html" in found[0].get_attribute("href")
        assert [one for one in driver.get_log("browser") if one["level"] not in ("INFO", "DEBUG")] == []


@pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)
@pytest.mark.parametrize("width", [360, 1280])
def test_pages_of_the_site_are_no_wider_than_their_window(site, width):
    metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    with browser.chromium() as driver:
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        wide = []
        for page in ("index", "howto/index", "reference/cli", "formats/scenario", "fidelity"):
            driver.get((site / f"{page}.html").as_uri())
            if driver.execute_script("return document.documentElement.scrollWidth") > width:
                wide.append(page)
    assert not wide
