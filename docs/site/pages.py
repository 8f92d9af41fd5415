"""Brings documents from outside of `docs/` into the site, and makes their links work there.

Documents link as they lie in the tree, so that they can be read there: `../../../README.md`, `statistics.py`. In the
site

    a document (README.md of a folder, docs/*.md)  is a page, under its path in the tree
    another file of the tree                       is a page that shows it: `source/PATH.md`
    a folder without a README.md                   is a page that shows its files
    README.md of the tree                          is the home page

A link into nowhere stays as it is, and `properdocs build --strict` fails by it.
"""

from __future__ import annotations

import posixpath
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from properdocs.config.defaults import ProperDocsConfig
from properdocs.structure.files import File, Files
from properdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]  # properdocs loads this file by its path
from docs.site import howtos, release, tables  # noqa: E402

DOCS = "docs"
HOME = {"README.md": "index.md"}
HEADS = {"CHANGELOG.md": "---\nsearch:\n  boost: 0.1\n---\n"}
"""What is put before a document: search finds a page before its line in the changelog."""
LANGUAGES = {".py": "python", ".toml": "toml", ".c": "c", ".h": "c", ".lua": "lua", ".yml": "yaml"}
LINK = re.compile(r"(?<!\\)(!?\[(?:[^\[\]`]|`[^`]*`|\[[^\]]*\])*\]\()([^()\s]+)(\))")
FENCE = re.compile(r"^ {0,3}(```+|~~~+)")
INDENTED = re.compile(r"^( {4}|\t)")


def tracked() -> list[str]:
    """All files of the tree, or of an unpacked archive of it."""
    command = ["git", "ls-files", "-coz", "--exclude-standard"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0 and done.stdout:
        return [name for name in done.stdout.split("\0") if name and (ROOT / name).is_file()]
    found = (path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file())
    return sorted(path.as_posix() for path in found if not {".git", ".venv", "build"} & set(path.parts))


def outside(names: list[str]) -> list[str]:
    """Documents that are brought in: READMEs of folders, CHANGELOG and CONTRIBUTING."""
    return [
        name
        for name in names
        if (name.endswith("/README.md") and not name.startswith(f"{DOCS}/"))
        or name in ("CHANGELOG.md", "CONTRIBUTING.md")
    ]


class Tree:
    """Where each path of the tree is in the site. `shown`: files and folders that a document links to, as pages."""

    def __init__(self) -> None:
        self.names = tracked()
        self.documents = {name: name for name in outside(self.names)} | HOME
        self.folders = {parent.as_posix() for name in self.names for parent in Path(name).parents} - {"."}
        self.shown: dict[str, str] = {}
        self.pictures: set[str] = set()

    def place(self, path: str) -> str | None:
        """The site's path of a path of the tree; None if it is not in the tree."""
        if path in self.documents:
            return self.documents[path]
        if path.startswith(f"{DOCS}/") and path in self.names:
            return path.removeprefix(f"{DOCS}/")
        if f"{path}/README.md" in self.documents:
            return self.documents[f"{path}/README.md"]
        if path in self.names and path.endswith((".png", ".svg")):
            self.pictures.add(path)
            return path
        if path in self.names or path in self.folders:
            return self.shown.setdefault(path, f"source/{path}.md")
        return None


_tree = Tree()


def origin(site_path: str) -> str:
    """The path in the tree of a page of the site."""
    if (ROOT / DOCS / site_path).is_file():
        return f"{DOCS}/{site_path}"
    return site_path


def relinked(text: str, here: str) -> str:
    """`text` of the page at `here` in the site, its links as they have to be there. Code is left alone."""
    folder = posixpath.dirname(origin(here))

    def link(found: re.Match[str]) -> str:
        before, target, after = found.groups()
        path, sign, anchor = target.partition("#")
        if not path or ":" in path:
            return found[0]
        place = _tree.place(posixpath.normpath(posixpath.join(folder, path)))
        if place is None:
            return found[0]
        return before + posixpath.relpath(place, posixpath.dirname(here) or ".") + sign + anchor + after

    return "".join(part if code else LINK.sub(link, part) for code, part in parts_of(text))


def parts_of(text: str) -> Iterator[tuple[bool, str]]:
    """The text in pieces: is it code?, lines that belong together."""
    fence, paragraph = "", False
    lines: list[str] = []
    before = False
    for line in text.splitlines(keepends=True):
        mark = FENCE.match(line)
        code = bool(fence or mark) or (not paragraph and INDENTED.match(line) is not None)
        if mark and not fence:
            fence = mark[1]
        elif line.strip() == fence:
            fence = ""
        paragraph = bool(line.strip()) and not code
        if code != before:
            yield before, "".join(lines)
            lines = []
        lines.append(line)
        before = code
    yield before, "".join(lines)


def shown(path: str) -> str:
    """The page of a file, or of a folder's files."""
    names = [path] if path in _tree.names else [name for name in _tree.names if name.startswith(path + "/")]
    parts = [f"---\nsearch:\n  exclude: true\n---\n# {path}\n"]
    for name in names:
        try:
            text = (ROOT / name).read_text("utf-8")
        except UnicodeDecodeError:
            continue
        if len(names) > 1:
            parts.append(f"## {name.removeprefix(path + '/')}\n")
        longest = max((len(run) for run in re.findall(r"`{3,}", text)), default=2)
        fence = "`" * (longest + 1)
        parts.append(f"{fence}{LANGUAGES.get(Path(name).suffix, 'text')}\n{text.rstrip()}\n{fence}\n")
    return "\n".join(parts)


def on_config(config: ProperDocsConfig) -> ProperDocsConfig:
    """Says which version the site is of."""
    release.describe(config)
    return config


def on_files(files: Files, config: ProperDocsConfig) -> Files:
    """Adds the documents, then what they link to."""
    pages = {path.src_uri: path.content_string for path in files.documentation_pages()}
    for name, site_path in _tree.documents.items():
        if name not in HOME:
            pages[site_path] = HEADS.get(name, "") + (ROOT / name).read_text("utf-8")
            files.append(File.generated(config, site_path, content=pages[site_path]))
    for site_path, text in pages.items():
        relinked(text, site_path)
    for path, site_path in _tree.shown.items():
        file = File.generated(config, site_path, content=shown(path))
        file.inclusion = file.inclusion.NOT_IN_NAV
        files.append(file)
    for path in sorted(_tree.pictures):
        files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
    return files


def on_page_content(html: str, **_: Any) -> str:
    """Takes away what the table of a command's options has as the default of an option that has none."""
    return html.replace("<code>Sentinel.UNSET</code>", "").replace("<code>()</code>", "")


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Rewrites the links of one page, and fills in its tables."""
    here = page.file.src_uri
    if here == howtos.INDEX:
        markdown = howtos.with_first_sentences(markdown, ROOT / origin(here))
    return relinked(tables.filled(markdown), here)


def on_post_build(config: ProperDocsConfig, **_: Any) -> None:
    """Puts the source beside the pages, where it has no address."""
    release.write_archive(config)
