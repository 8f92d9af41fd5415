"""What to begin with: rules that failed by themselves, and those that are not judged because of them."""

from __future__ import annotations

from collections.abc import Sequence

from miro_exact.bad_input import amount
from mirotwin.verify.conform.run import Outcome
from mirotwin.verify.conform.table import ALL, find


def hidden_by(outcomes: Sequence[Outcome]) -> dict[str, list[str]]:
    """The rules that are not judged, by the one that failed instead: the one that hides most of them first."""
    hidden: dict[str, list[str]] = {}
    for outcome in outcomes:
        if outcome.cause:
            hidden.setdefault(outcome.cause, []).append(outcome.rule)
    return dict(sorted(hidden.items(), key=lambda one: -len(one[1])))


def causes_first(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Failed rules that hide others, then other failed ones, those not judged, those that are kept, and the rest."""
    places = {id: place for place, id in enumerate(hidden_by(outcomes))}
    verdicts = ("failed", "not judged", "passed", "not observable")
    return sorted(outcomes, key=lambda one: (verdicts.index(one.verdict), places.get(one.rule, len(places))))


def begin_with(outcomes: Sequence[Outcome]) -> str:
    """The sentence that says where to begin; "" where every rule was judged."""
    for id, hidden in hidden_by(outcomes).items():
        (cause,) = (outcome for outcome in outcomes if outcome.rule == id)
        because = f"{find(id).broken}{_where(cause)}"
        first = cause.failures[0]
        hint = cause.hint or f"wanted {first.wanted}, found {first.found}"
        return f"{_rules(hidden)} not judged because {because}; begin with {id}: {hint}"
    return ""


def folded(outcomes: Sequence[Outcome]) -> list[str]:
    """A line for each cause, with the rules that it hides."""
    return [
        f"{_rules(hidden)} not judged because {id} failed: {_spans(hidden)}"
        for id, hidden in hidden_by(outcomes).items()
    ]


def _rules(ids: Sequence[str]) -> str:
    return amount(len(ids), "rule was", "rules were")


def _where(cause: Outcome) -> str:
    """The network size in which alone the rule fails, if it was tried in others too."""
    topologies = find(cause.rule).topologies
    failed = {topologies[one.network].robots for one in cause.failures if not one.fault}
    if len(failed) == 1 and len({topology.robots for topology in topologies}) > 1:
        return f" where N = {failed.pop()}"
    return ""


def _spans(ids: Sequence[str]) -> str:
    """`P01 to P03, P05`, in the order of the table."""
    spans: list[list[int]] = []
    for place, rule in enumerate(ALL):
        if rule.id not in ids:
            continue
        if spans and place == spans[-1][-1] + 1:
            spans[-1].append(place)
        else:
            spans.append([place])
    return ", ".join(" to ".join(dict.fromkeys((ALL[one[0]].id, ALL[one[-1]].id))) for one in spans)
