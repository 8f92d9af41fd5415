"""Which numbers can be computed with: the range of seeds, and the error of numbers outside a domain."""


class DomainError(ValueError, OverflowError):
    """A number is not finite, or outside the range of a function. Checked parameters are far from this on any robot."""


MAX_SEED = (1 << 63) - 1
"""Seeds are 0 to this."""
