"""All rules in the order of their numbers, look-up of a rule, and the rules that each one presupposes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import groupby

from miro_exact.bad_input import BadInput, did_you_mean
from mirotwin.conform.rule import Chapter, Rule
from mirotwin.conform.rules import (
    answers,
    boot,
    chips,
    driving,
    failsafe,
    fresh,
    lost,
    reception,
    service,
    sound,
)

CHAPTERS: tuple[Chapter, ...] = (
    boot.CHAPTER, reception.CHAPTER, fresh.CHAPTER, driving.CHAPTER, failsafe.CHAPTER, service.CHAPTER,
    answers.CHAPTER, sound.CHAPTER, chips.CHAPTER, boot.STRAPS, sound.LONG, lost.CHAPTER,
)  # fmt: skip
ALL: tuple[Rule, ...] = tuple(rule for chapter in CHAPTERS for rule in chapter.rules)
LONG: tuple[Rule, ...] = tuple(sound.LONG.rules)
RULES: tuple[Rule, ...] = tuple(rule for rule in ALL if rule not in LONG)
"""The rules that are tried unless others are requested."""
_BY_ID = {rule.id: rule for rule in ALL}


def chapter_of(rule: Rule) -> Chapter:
    """The chapter of a rule."""
    return next(chapter for chapter in CHAPTERS if rule in chapter.rules)


@cache
def presupposed(rule: Rule) -> tuple[Rule, ...]:
    """All rules that `rule` presupposes, also by way of others: each after those that it presupposes itself."""
    earlier: dict[str, Rule] = {}
    for presupposition in map(find, rule.presupposes):
        earlier |= {other.id: other for other in (*presupposed(presupposition), presupposition)}
    return tuple(earlier.values())


def presupposed_first(rules: Sequence[Rule]) -> list[Rule]:
    """`rules` in an order in which each comes after those of them that it presupposes."""
    tried = {rule.id: rule for rule in rules}
    ordered: dict[str, Rule] = {}
    for rule in rules:
        ordered |= {
            needed.id: tried[needed.id] for needed in (*presupposed(rule), rule) if needed.id in tried
        }
    return list(ordered.values())


def spans(ids: Sequence[str]) -> str:
    """`P01 to P03, P05`, in the order of the rules."""
    places = [place for place, rule in enumerate(ALL) if rule.id in ids]
    parts = []
    for _, numbered in groupby(enumerate(places), key=lambda pair: pair[1] - pair[0]):
        span = [ALL[place].id for _, place in numbered]
        parts.append(" to ".join(dict.fromkeys((span[0], span[-1]))))
    return ", ".join(parts)


def find(id: str) -> Rule:
    """The rule called `id`, in capitals or not. Raises BadInput, with the nearest one that there is."""
    rule = _BY_ID.get(id.upper())
    if rule is not None:
        return rule
    remedy = f"`mirotwin conform --list` shows {ALL[0].id} to {ALL[-1].id}"
    raise BadInput("", "", f"there is no rule {id[:40]!r}", did_you_mean(id.upper(), _BY_ID, remedy))
