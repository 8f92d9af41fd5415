"""From a template and its values to the bytes of a page.

A page names no address: its policy forbids the browser every request, and the same values give the same bytes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.report.page.bokeh_page import document_json, island, javascript, require_bokeh
from mirotwin.shell.outputs import check_new, whole_file
from mirotwin.shell.program import show_line
from mirotwin.shell.verdicts import DONE

MOST_BYTES = 50_000_000
"""Largest size of a page: browsers take more, people and mail do not."""
ASSETS = Path(__file__).parent / "assets"
GENERATOR = b'<meta name="generator" content="mirotwin report">'
"""In the head of every page."""


def render(template: str, figures: dict[str, Any], data: bytes, values: dict[str, Any]) -> bytes:
    """The page. `data`: JSON for its JavaScript. Raises BadInput where Bokeh is not installed."""
    require_bokeh()
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "seconds": seconds_text}

    def asset(name: str) -> Markup:
        return Markup((ASSETS / name).read_text(encoding="utf-8"))

    text = environment.get_template(template).render(
        **values,
        asset=asset,
        figures=list(figures),
        bokeh=Markup(javascript()),
        document=Markup(island(document_json(figures))),
        data=Markup(island(data)),
    )
    return text.encode("utf-8", "replace")


def is_page(path: Path) -> bool:
    """True if the file is one that `render` made."""
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return GENERATOR in file.read(2000)


def check_size(page: bytes, name: str, remedy: str) -> None:
    """Raises BadInput for a page that is too large."""
    if len(page) > MOST_BYTES:
        reason = f"the page has {len(page) / 1e6:.0f} MB, {MOST_BYTES / 1e6:.0f} are allowed"
        raise BadInput(name, "", reason, remedy)


def place_of_page(out: Path | None, force: bool, *inputs: str | None) -> Path:
    """Path of the page: `out`, else report.html, which replaces an earlier page. Raises BadInput; needs Bokeh."""
    if out is None:
        out = Path("report.html")
        force = force or is_page(out)
    check_new(out, "--out", force, *inputs)
    require_bokeh()
    return out


def write_page(out: Path, page: bytes, quiet: bool = False) -> int:
    """Writes it whole or not at all; the exit code."""
    with whole_file(out, "--out") as part:
        part.write_bytes(page)
    if not quiet:
        show_line(f"{out}: {len(page) / 1e6:.1f} MB")
    return DONE


def number(value: float | None, digits: int = 4) -> str:
    """The number in `digits` significant digits; a dash for None."""
    return "\u2013" if value is None else f"{value:.{digits}g}"


def seconds_text(tick: int, clock: int = TICKS_PER_SECOND) -> str:
    return f"{tick / clock:.3f} s"
