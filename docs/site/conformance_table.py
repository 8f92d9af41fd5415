"""The table of rules that the site puts into docs/conformance.md: `python -m docs.site.conformance_table` prints it."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from miro_robot.lm629.options import DEFAULT_OPTIONS, Lm629Options
from mirotwin.conform.by_answers import NOT_OBSERVABLE
from mirotwin.conform.rule import Rule, Topology
from mirotwin.conform.rules import CHAPTERS

LEFT_OUT = {
    "bad stop bits": ("P04", "P13", "P43", "P49"),
    "pauses within a frame of less than 5 ms": ("P04", "P13", "P49"),
    "the flags of power-on": ("P45",),
    "a delay that all answers share": ("P41", "P44"),
}
"""What no PC can do of a trial -> rules whose other parts can be seen."""


def render() -> str:
    """All rules by chapter, ending in a newline."""
    return "\n".join(line for chapter in CHAPTERS for line in _chapter(chapter.title, chapter.rules))


def _chapter(title: str, rules: list[Rule]) -> Iterator[str]:
    yield f"### {title}\n"
    yield "| rule | name | a robot must | from | tried with | presupposes | by answers |"
    yield "|---|---|---|---|---|---|---|"
    for rule in rules:
        topologies = "; ".join(dict.fromkeys(map(_topology, rule.topologies))) + _chips(rule.lm629)
        text, before = rule.text.replace("|", chr(92) + "|"), ", ".join(rule.presupposes)
        cells = (rule.id, rule.name, text, _source(rule.source), topologies, before, _by_answers(rule))
        yield f"| {' | '.join(cells)} |"
    yield ""


def _by_answers(rule: Rule) -> str:
    """Whether a port shows it, and what of its trial no PC can do."""
    if rule.id in NOT_OBSERVABLE:
        return f"no: {NOT_OBSERVABLE[rule.id]}"
    left_out = [what for what, ids in LEFT_OUT.items() if rule.id in ids]
    return "yes" + (f", without {' and '.join(left_out)}" if left_out else "")


def _source(source: str) -> str:
    page, _, section = source.partition(", ")
    anchor = "".join(one for one in section.lower().replace(" ", "-") if one.isalnum() or one == "-")
    return f"[{section}](../{page}#{anchor})"


def _chips(lm629: Lm629Options) -> str:
    changed = [
        f"{name} {str(getattr(lm629, name)).lower()}"
        for name in ("busy_clocks", "reset_clocks", "reset_breakpoint")
        if getattr(lm629, name) != getattr(DEFAULT_OPTIONS, name)
    ]
    return "".join(f", {one}" for one in changed)


def _topology(topology: Topology) -> str:
    slots = ", ".join(map(str, topology.slots))
    more = ", keyed carrier with noise" if topology.keyed else ""
    if topology.strap is not None:
        more += f", its pins say {topology.strap}"
    if topology.baud_offset_ppm:
        more += f", host {topology.baud_offset_ppm / 10_000:+g} %"
    return f"N = {topology.robots}, slot {slots}{more}"


if __name__ == "__main__":
    sys.stdout.write(render())
