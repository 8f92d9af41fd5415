"""Bokeh's part of a page: its JavaScript from the wheel, and the figures as reproducible JSON.

Bokeh numbers its models from 1000 on in each process, so a second page in one process would have other numbers: they
are numbered from 1 in the order of the page. Colours are names (`ink`, `truth`): tags like `line_color=truth` on a
model name the colour of a property, and the page sets the colours for its light and dark themes. bokeh is loaded when
it is used; it comes with the extra `report`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any

import msgspec

from miro_exact.bad_input import BadInput

DOCUMENT = "mirotwin"
_MODEL_ID = re.compile(rb'"id":"p([0-9]+)"')


def require_bokeh() -> None:
    """Raises BadInput where Bokeh is not installed; does not load it."""
    if find_spec("bokeh") is None:
        raise BadInput("", "bokeh", "is not installed", "pip install 'mirotwin[report]'")


def javascript() -> str:
    """Bokeh's JavaScript without widgets and tables, escaped for use inside a page."""
    from bokeh.resources import Resources

    return "\n".join(Resources(mode="inline", components=["bokeh"], minified=True).js_raw).replace(
        "</script", "<\\/script"
    )


def document_json(figures: Mapping[str, Any]) -> bytes:
    """All figures as one document. Keys are the ids of the elements that they are put into."""
    from bokeh.core.json_encoder import serialize_json
    from bokeh.document import Document

    document = Document()
    with document.models.freeze():  # else it walks through all that it has at each
        for figure in figures.values():
            document.add_root(figure)
    roots = {figure.id: name for name, figure in figures.items()}
    text = serialize_json(
        {
            "docs": {DOCUMENT: document.to_json(deferred=False)},
            "items": [{"docid": DOCUMENT, "roots": roots, "root_ids": list(roots)}],
        }
    )
    return _numbered_anew(msgspec.json.encode(msgspec.json.decode(text)))


def _numbered_anew(text: bytes) -> bytes:
    numbers: dict[bytes, int] = {}
    for match in _MODEL_ID.finditer(text):
        numbers.setdefault(match[1], len(numbers) + 1)
    return re.sub(
        rb'"p([0-9]+)"', lambda match: b'"m%d"' % numbers[match[1]] if match[1] in numbers else match[0], text
    )


def island(data: bytes) -> str:
    """JSON escaped for use inside a script element."""
    return data.decode().replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
