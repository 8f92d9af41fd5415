"""What is wrong with a stream file, and where."""

from miro_exact.bad_input import BadInput


class StreamError(BadInput):
    """A line that cannot be read: file, line and column (from 1), the reason, and what to do about it."""

    def __init__(self, source: str, line: int, column: int, reason: str, remedy: str) -> None:
        super().__init__(source, (line, column), reason, remedy)
