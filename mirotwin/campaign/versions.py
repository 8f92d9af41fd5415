"""The versions on which a run's bits depend besides its job: this program's version and sources, and parts of other
distributions.
"""

from __future__ import annotations

import hashlib
from functools import cache, lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import msgspec

from miro_exact.installed import described_once

PACKAGES = ("miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim", "mirotwin")
NOT_OF_RUNS = (
    "camera", "campaign/reproduce", "debug", "desk", "firmware", "fuzz", "ports",
    "recording/capture", "replay", "report", "run", "testing",
)  # fmt: skip
"""Folders of `mirotwin` that no run of a campaign uses."""


class Versions(msgspec.Struct, frozen=True):
    """`mirotwin`: the version; `code`: hash of its sources; `parts`: plug-ins of other distributions that runs use,
    each with version and hash of its sources (`miro_exact.installed.described`).
    """

    mirotwin: str
    code: str
    parts: tuple[str, ...] = ()

    def difference(self, other: Versions) -> str:
        """The differences of `other` from this, in words; "" if there is none."""
        if self.mirotwin != other.mirotwin:
            return f"mirotwin {other.mirotwin} instead of {self.mirotwin}"
        if self.code != other.code:
            return f"other sources of mirotwin {self.mirotwin} ({other.code} instead of {self.code})"
        theirs = dict(part.partition(": ")[::2] for part in other.parts)
        ours = dict(part.partition(": ")[::2] for part in self.parts)
        return "; ".join(
            f"{plugin} of {theirs.get(plugin, 'no distribution')} instead of {ours.get(plugin, 'none')}"
            for plugin in {**ours, **theirs}
            if ours.get(plugin) != theirs.get(plugin)
        )


@cache
def versions() -> Versions:
    """The versions of this process, without plug-ins, because looking for those takes 30 ms."""
    try:
        version = metadata.version("mirotwin")
    except metadata.PackageNotFoundError:
        version = "not installed"
    return Versions(version, _code())


@lru_cache(maxsize=8)
def versions_here(wanted: Versions) -> Versions:
    """The versions of this process, with the plug-ins of `wanted` as they were when it first looked."""
    names = [part.partition(": ")[0].partition(" ") for part in wanted.parts]
    described = (described_once(kind, name) for kind, _, name in names)
    return msgspec.structs.replace(versions(), parts=tuple(part for part in described if part))


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
