"""Which version the site is of, and where its source is.

Where the address of the repository is set (`address.py`), the site leads there. Where not, it carries the source
itself, as an archive of the commit that it was built from. One that was built outside of a repository shows the version
alone.
"""

from __future__ import annotations

import subprocess
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from docs.site import address

if TYPE_CHECKING:
    from properdocs.config.defaults import ProperDocsConfig

ROOT = Path(__file__).parents[2]
NAME = "mirotwin"


def version() -> str:
    with open(ROOT / "pyproject.toml", "rb") as file:
        return str(tomllib.load(file)["project"]["version"])


def commit() -> str:
    """Short name of the commit; "" where this folder is no repository of its own."""
    return _git("rev-parse", "--short=12", "HEAD") if (ROOT / ".git").exists() else ""


def describe(config: ProperDocsConfig) -> None:
    """Puts version and source into the header, version and licence into the footer of each page."""
    now, built_from = version(), commit()
    config.copyright = f"Mirotwin {now}{f', commit {built_from}' if built_from else ''}. MIT licence."
    config.repo_name = now
    config.repo_url = address.known()
    config.extra["source"] = "repository" if config.repo_url else "source archive"
    if not config.repo_url and built_from:
        config.repo_url = config.extra["archive"] = f"{NAME}-{now}.tar.gz"


def write_archive(config: ProperDocsConfig) -> None:
    """The archive that the header leads to, if it leads to one."""
    if name := config.extra.get("archive"):
        target = Path(config.site_dir).absolute() / name
        _git("archive", f"--prefix={NAME}-{version()}/", f"--output={target}", "HEAD")


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""
