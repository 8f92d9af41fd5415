"""The error of a computation whose numbers are not finite or outside its domain.

What belongs here: this one error, which the host and the physical world raise where they notice it. What does not:
parameters that are checked when they are given (ValueError).
"""


class DomainError(ValueError, OverflowError):
    """A number is not finite, or beyond what a function takes: with checked parameters far from any robot's."""
