"""A folder for an archive: the description of its files as an RO-Crate, and the rows of all runs as Parquet.

The same files and the same date give the same bytes.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from mirotwin.campaign.reproduce.rows import RunRow
from mirotwin.campaign.versions import versions

METADATA = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/crate/1.1"
CONTEXT = [f"{PROFILE}/context", {"sha256": "https://schema.org/sha256"}]
"""The context of 1.1 has no `sha256`; a context may be extended so (section "Extending RO-Crate")."""
LICENSE = "https://spdx.org/licenses/MIT"
PAPER = "https://doi.org/10.1109/70.768190"
PROGRAM = "#mirotwin"
FORMATS = {
    ".md": ("text/markdown", "the page: each claim of the paper, what was measured, and a verdict"),
    ".svg": ("image/svg+xml", "a figure of the paper again, the runs with the median error"),
    ".csv": ("text/csv", "one row a run"),
    ".parquet": ("application/vnd.apache.parquet", "one row a run, with types"),
    ".mcap": (
        "application/octet-stream",
        "a recording: every channel, the scenario, the firmware and the seed",
    ),
}
"""By suffix: media type, and what such a file is."""


def write_rows(rows: Sequence[RunRow], path: Path) -> None:
    """All runs as Parquet, columns as in `RunRow`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    types = {"str": pa.string(), "int": pa.int64(), "bool": pa.bool_(), "float": pa.float64()}
    schema = pa.schema([(field.name, types[_kind(field.type)]) for field in msgspec.structs.fields(RunRow)])
    table = pa.Table.from_pylist([msgspec.structs.asdict(row) for row in rows], schema=schema)
    pq.write_table(table, path, compression="zstd")


def _kind(hint: Any) -> str:
    return f"{getattr(hint, '__name__', hint)}".partition(" ")[0]


def metadata(folder: Path, paths: Iterable[Path], seeds: str, day: str) -> str:
    """The description of files in `folder`. `day`: the date of publication, YYYY-MM-DD."""
    files = [_file(folder, path) for path in sorted(paths)]
    parts = [{"@id": file["@id"]} for file in files]
    about = {
        "@id": "./",
        "@type": "Dataset",
        "name": "The figures of Yang and Kim (1999), run again by Mirotwin",
        "description": f"Runs of Figs. 6 to 10 and of the comparison of controllers with seeds {seeds}: the page, the "
        "rows of all runs, pictures, and recordings that `mirotwin replay` runs again, bit for bit.",
        "datePublished": day,
        "license": {"@id": LICENSE},
        "citation": {"@id": PAPER},
        "hasPart": parts,
        "mentions": {"@id": "#runs"},
    }
    descriptor = {
        "@id": METADATA,
        "@type": "CreativeWork",
        "conformsTo": {"@id": PROFILE},
        "about": {"@id": "./"},
    }
    graph = [descriptor, about, *files, *_around(parts)]
    return json.dumps({"@context": CONTEXT, "@graph": graph}, indent=2, ensure_ascii=False) + "\n"


def _file(folder: Path, path: Path) -> dict[str, Any]:
    content = path.read_bytes()
    media, what = FORMATS[path.suffix]
    return {
        "@id": path.relative_to(folder).as_posix(),
        "@type": "File",
        "name": path.name,
        "description": what,
        "encodingFormat": media,
        "contentSize": f"{len(content)}",
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def _around(parts: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """What made the files, and the work that they are about."""
    here = versions()
    return [
        {
            "@id": "#runs",
            "@type": "CreateAction",
            "name": "mirotwin reproduce",
            "instrument": {"@id": PROGRAM},
            "object": {"@id": PAPER},
            "result": list(parts),
        },
        {
            "@id": PROGRAM,
            "@type": "SoftwareApplication",
            "name": "Mirotwin",
            "softwareVersion": here.mirotwin,
            "identifier": f"sources {here.code}",
            "license": {"@id": LICENSE},
        },
        {
            "@id": PAPER,
            "@type": "ScholarlyArticle",
            "name": "Sliding Mode Control for Trajectory Tracking of Nonholonomic Wheeled Mobile Robots",
            "author": [{"@id": "#yang"}, {"@id": "#kim"}],
            "datePublished": "1999-06",
            "isPartOf": "IEEE Transactions on Robotics and Automation 15(3), 578-587",
        },
        {"@id": "#yang", "@type": "Person", "name": "Jong-Min Yang"},
        {"@id": "#kim", "@type": "Person", "name": "Jong-Hwan Kim"},
        {"@id": LICENSE, "@type": "CreativeWork", "name": "MIT License"},
    ]
