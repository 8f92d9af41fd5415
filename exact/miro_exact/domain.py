"""Which numbers can be computed with: the range of seeds, and the error of numbers outside a domain."""


class DomainError(ValueError, OverflowError):
    """A number is not finite, or beyond what a function takes: with checked parameters far from any robot's."""


MAX_SEED = (1 << 63) - 1
"""Seeds are 0 to this."""
