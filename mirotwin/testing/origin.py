"""The source of Mirotwin in a project's requirements: an address or a path, never just a name.

No package index has Mirotwin: pip would install whatever a stranger registers under the name.
"""

from __future__ import annotations

import os
import re
from importlib import metadata
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import msgspec

from miro_exact.bad_input import BadInput, shortened

PACKAGE = "mirotwin[report]"
UNKNOWN = re.compile(r"^Write here where .*$", re.MULTILINE)
"""The placeholder line in the sample project for an unknown source. It is no requirement: pip fails, and prints it."""
PLACEHOLDER = "https://HOST/PATH"
"""Stands for the address of the repository, also in `[project.urls]` until that is set (`docs/site/address.py`)."""
_ADDRESS = re.compile(r"(?:(?:git|hg|svn|bzr)\+\w+|https?)://[!-~]+")
_REMEDY = f"give git+{PLACEHOLDER}@COMMIT, or the path of a wheel, a source archive or a checkout"
_PLAIN = re.compile(r"[\w+-][\w./+-]*", re.ASCII)
"""A path that pip reads without quoting: no spaces or brackets, and not the project's folder itself."""
_ARCHIVES = (".whl", ".tar.gz", ".zip")


class _Version(msgspec.Struct):
    vcs: str
    commit_id: str


class _DirectUrl(msgspec.Struct):
    """`direct_url.json` (PEP 610), which pip writes for an installation that is not from an index."""

    url: str
    vcs_info: _Version | None = None
    subdirectory: str = ""


def given(source: str, project: Path) -> str:
    """The requirement for the address or path `source`. Raises BadInput."""
    if _ADDRESS.fullmatch(source):
        return f"{PACKAGE} @ {source}"
    path = Path(source)
    if not os.path.exists(path):  # unlike Path.exists, it raises nothing for a name that is too long
        raise BadInput(
            shortened(source), "--from", "is no address, and there is no such file or folder", _REMEDY
        )
    if not (path.name.endswith(_ARCHIVES) if path.is_file() else (path / "pyproject.toml").is_file()):
        raise BadInput(source, "--from", "is no wheel, no source archive and no checkout", _REMEDY)
    return _of_path(path, project)


def installed(project: Path) -> str | None:
    """The requirement for the installed Mirotwin; None if its source is unknown or no longer exists."""
    try:
        distribution = metadata.distribution("mirotwin")
        text = distribution.read_text("direct_url.json")
        if text is None:
            return _released(distribution)
        origin = msgspec.json.decode(text, type=_DirectUrl)
    except (metadata.PackageNotFoundError, msgspec.DecodeError):
        return None
    inner = f"#subdirectory={origin.subdirectory}" if origin.subdirectory else ""
    if origin.vcs_info is not None:
        address = f"{origin.vcs_info.vcs}+{origin.url}@{origin.vcs_info.commit_id}{inner}"
    elif origin.url.startswith("file:"):
        path = Path(url2pathname(urlsplit(origin.url).path))
        return _of_path(path, project) if os.path.exists(path) else None
    else:
        address = f"{origin.url}{inner}"
    return f"{PACKAGE} @ {address}" if _ADDRESS.fullmatch(address) else None


def _released(distribution: metadata.Distribution) -> str | None:
    """The requirement for a version that an index gave: its tag in the repository; None if that has no address."""
    urls = dict(line.split(", ", 1) for line in distribution.metadata.get_all("Project-URL", ()))
    address = urls.get("Repository", PLACEHOLDER)
    return None if address == PLACEHOLDER else f"{PACKAGE} @ git+{address}@v{distribution.version}"


def _of_path(path: Path, project: Path) -> str:
    """A path within the project, or beside it, is relative to it, so that it holds on every machine."""
    path, project = path.resolve(), project.resolve()
    for above, start in (project, "./"), (project.parent, "../"):
        inner = path.relative_to(above).as_posix() if path.is_relative_to(above) else ""
        if _PLAIN.fullmatch(inner) and (start == "./" or path.parent == above):
            return f"{start}{inner}{PACKAGE.removeprefix('mirotwin')}"
    return f"{PACKAGE} @ {path.as_uri()}"
