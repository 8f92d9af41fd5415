"""The file of `conform --baseline`: rules that unfinished firmware is known to fail, one line a rule, kept in git.

# Rules that this firmware is known not to keep yet: mirotwin conform IMAGE --baseline known.toml
P42 = "no telemetry yet"
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput, one_line
from miro_exact.inputs import decode, read_input
from miro_protocol.toml_text import tables
from mirotwin.conform.rules import ALL, find
from mirotwin.conform.run import Outcome
from mirotwin.shell.outputs import reason_of, whole_file

_HEAD = "# Rules that this firmware is known not to keep yet: mirotwin conform IMAGE.ihx --baseline {name}\n"


def read(path: Path, may_be_new: bool = False) -> dict[str, str]:
    """Rule -> reason why it is known to fail. Raises BadInput; for a missing file only if not `may_be_new`."""
    try:
        text = decode(read_input(path))
    except FileNotFoundError:
        if may_be_new:
            return {}
        raise BadInput(path, "", "there is no such file", "--write-baseline writes it") from None
    except OSError as error:
        raise BadInput(path, "", reason_of(error), "name another file with --baseline") from None
    with BadInput.at(path):
        known = tables(text)
        for id, why in known.items():
            with BadInput.at("", id):
                rule = find(id)
                if id != rule.id or not isinstance(why, str):
                    raise BadInput("", "", "is not a rule with its reason", f'write {rule.id} = "reason"')
    return known


def write(path: Path, known: Mapping[str, str], outcomes: Sequence[Outcome]) -> dict[str, str]:
    """Writes the rules that failed, and those of `known` that were not judged, with the reasons from `known`; returns
    them.

    Raises OutputError.
    """
    by_id = {outcome.rule: outcome for outcome in outcomes}
    reasons = {}
    for rule in ALL:
        outcome = by_id.get(rule.id)
        if outcome is not None and outcome.failures:
            reasons[rule.id] = known.get(rule.id) or rule.broken or rule.name
        elif rule.id in known and (outcome is None or outcome.verdict != "passed"):
            reasons[rule.id] = known[rule.id]
    lines = [f"{id} = {msgspec.json.encode(one_line(why)).decode()}\n" for id, why in reasons.items()]
    with whole_file(path, "--baseline") as part:
        part.write_text(_HEAD.format(name=path.name) + "".join(lines), encoding="utf-8")
    return reasons
