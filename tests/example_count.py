"""How many examples a property test draws."""

from hypothesis import settings

NORM = 100
"""`max_examples` of Hypothesis' default profile."""


def examples(count):
    """Decorator: draw `count` examples; a profile with n times `NORM` as `max_examples` draws n times as many."""
    return settings(deadline=None, max_examples=max(1, count * settings.default.max_examples // NORM))
