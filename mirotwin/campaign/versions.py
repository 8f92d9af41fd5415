"""What a run's bits depend on besides its job: this program's version and sources, and parts of other distributions."""

from __future__ import annotations

import hashlib
import sys
from functools import cache, lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import msgspec

PACKAGES = ("miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim", "mirotwin")
NOT_OF_RUNS = (
    "camera", "campaign/reproduce", "debug", "desk", "firmware", "fuzz", "ports",
    "recording/capture", "replay", "report/foxglove", "report/page", "run", "testing",
)  # fmt: skip
"""Folders of `mirotwin` that no run of a campaign uses."""
GROUPS = ("mirotwin.laws", "mirotwin.estimators", "mirotwin.references", "mirotwin.checks")


class Versions(msgspec.Struct, frozen=True):
    """`mirotwin`: the version; `code`: hash of its sources; `parts`: distributions that bring laws and so on."""

    mirotwin: str
    code: str
    parts: tuple[str, ...] = ()

    def difference(self, other: Versions) -> str:
        """What another one has else than this, in words; "" where nothing differs."""
        if self.mirotwin != other.mirotwin:
            return f"mirotwin {other.mirotwin} instead of {self.mirotwin}"
        if self.code != other.code:
            return f"other sources of mirotwin {self.mirotwin} ({other.code} instead of {self.code})"
        if self.parts != other.parts:
            return f"{', '.join(other.parts) or 'no'} parts instead of {', '.join(self.parts) or 'none'}"
        return ""


def versions() -> Versions:
    """Those of this process, for what Python finds on its path now: looking takes 30 ms."""
    return _versions(tuple(sys.path))


@lru_cache(maxsize=8)
def _versions(_: tuple[str, ...]) -> Versions:
    try:
        version = metadata.version("mirotwin")
    except metadata.PackageNotFoundError:
        version = "not installed"
    found = {
        f"{entry.dist.name} {entry.dist.version}"
        for group in GROUPS
        for entry in metadata.entry_points(group=group)
        if entry.dist is not None
    }
    return Versions(version, _code(), tuple(sorted(found)))


@cache
def _code() -> str:
    """Twelve digits of the hash over all sources and built-in scenarios that a run may use."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        spec = find_spec(package)
        assert spec is not None
        assert spec.origin is not None
        root = Path(spec.origin).parent
        files = [path for suffix in ("*.py", "*.pxd", "*.pyx", "*.toml") for path in root.rglob(suffix)]
        for path in sorted(files, key=lambda path: path.relative_to(root).as_posix()):
            name = path.relative_to(root).as_posix()
            if package == "mirotwin" and name.startswith(tuple(f"{folder}/" for folder in NOT_OF_RUNS)):
                continue
            digest.update(f"{package}/{name}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
