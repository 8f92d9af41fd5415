"""The error of a computation whose numbers are not finite or outside its domain."""


class DomainError(ValueError, OverflowError):
    """A number is not finite, or beyond what a function takes: with checked parameters far from any robot's."""
