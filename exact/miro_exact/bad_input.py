"""The error of unusable input, one line `FILE: PLACE: what; remedy`, and helpers for its text."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from os import PathLike
from typing import Any

LONGEST_END = 300
"""Characters shown of each end of a long text."""


class BadInput(ValueError):
    """Unusable input. `path`: the file or another source.

    `place`: in the file; a line number or (line, column), from 1, follows the path as in a compiler's message; a text
    (a key, an option, `offset 8`) is shown unchanged; 0 and "" are the whole file. `what`: the error, and `remedy`: its
    fix. Each may be "".
    """

    def __init__(
        self, path: str | PathLike[str], place: str | int | tuple[int, int], problem: str, remedy: str = ""
    ) -> None:
        self.path = path
        self.place = place
        self.what = problem
        self.remedy = remedy
        head = f"{path}"
        if isinstance(place, tuple):
            head += f":{place[0]}:{place[1]}"
        elif isinstance(place, int):
            head += f":{place}" if place else ""
        else:
            head = ": ".join(part for part in (head, shortened(place)) if part)
        text = ": ".join(part for part in (head, shortened(problem)) if part)
        super().__init__(one_line(f"{text}; {shortened(remedy)}" if remedy else text))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles as the base class for other processes, because a derived class may have other constructor
        arguments.
        """
        return BadInput, (self.path, self.place, self.what, self.remedy)

    @classmethod
    @contextmanager
    def at(cls, path: str | PathLike[str], place: str = "") -> Iterator[None]:
        """Adds `path` and `place` to BadInput raised in the block, because a parser of a text does not know its file.

        The error becomes one of this class.
        """
        try:
            yield
        except BadInput as error:
            whole = ": ".join(filter(None, dict.fromkeys((f"{path}", f"{error.path}"))))
            below = f"{place}.{error.place}" if place and error.place else place or error.place
            raise cls(whole, below, error.what, error.remedy) from error.__cause__


def did_you_mean(word: str, known: Iterable[str], remedy: str = "") -> str:
    """The remedy for an unknown word: the most similar known word, if there is one, and `remedy`."""
    from difflib import get_close_matches  # only an error needs it

    spelt = {name.lower(): name for name in known}
    close = get_close_matches(word[:LONGEST_END].lower(), spelt, n=1)
    return " ".join([*(f"did you mean {spelt[name]}?" for name in close), *([remedy] if remedy else [])])


def one_line(text: str) -> str:
    """The text with all characters escaped that a terminal would not print unchanged."""
    return "".join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def encodable(text: str) -> str:
    """The text in characters that UTF-8 has: a byte of a file's name that is none is escaped."""
    return text.encode("utf-8", "backslashreplace").decode()


def shortened(text: str) -> str:
    """The text without its middle where it is too long to be read: a value or a key of a megabyte."""
    return text if len(text) <= 2 * LONGEST_END else f"{text[:LONGEST_END]} .. {text[-LONGEST_END:]}"


def amount(number: int | str, singular: str, more: str = "") -> str:
    """`1 frame`, `2 frames`; `more`: the plural that is not `singular` with an s."""
    return f"{number} {singular if number == 1 else more or f'{singular}s'}"
