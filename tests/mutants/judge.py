"""Which rules of `mirotwin conform` an image breaks."""

import time

import msgspec

from miro_robot.image import load_hex
from mirotwin.verify.conform.run import try_rule, with_faults
from mirotwin.verify.conform.table import RULES


class Judged(msgspec.Struct, frozen=True):
    """Ids of the broken rules, in their order, and what judging took (processor time)."""

    rules: tuple[str, ...]
    seconds: float


def judged(image, tried=()):
    """Tries these rules on an image, each by itself, whatever it presupposes; () is all of them."""
    rules = [rule for rule in RULES if not tried or rule.id in tried]
    begun = time.process_time()
    loaded = load_hex(image)
    outcomes = with_faults([try_rule(rule, loaded) for rule in rules], rules)
    broken = tuple(outcome.rule for outcome in outcomes if outcome.failures)
    return Judged(broken, time.process_time() - begun)


def all_rules():
    """Ids of the rules there are."""
    return tuple(rule.id for rule in RULES)
