"""What is wrong with a stream file, and where.

What belongs here: the error. What does not: what may stand in a line (`stream_line.py`) or header (`stream_header.py`).
"""


class StreamError(Exception):
    """A line that cannot be read: file, line and column (from 1), the reason, and what to do about it."""

    def __init__(self, source: str, line: int, column: int, reason: str, remedy: str) -> None:
        super().__init__(f"{source}:{line}:{column}: {reason}; {remedy}")
        self.source = source
        self.line = line
        self.column = column
        self.reason = reason
        self.remedy = remedy
