"""C source as tokens: all of a file's text, cut into pieces that have a kind.

Words of SDCC (`__bit`, `__interrupt`, ..) are names like others; `__asm .. __endasm` is one token. A line of the
preprocessor is one token of kind `directive`, but for the body of a `#define`: that is cut up like code, its tokens
say `macro`, so that constants with names can be changed where they are defined.
"""

import re
from typing import NamedTuple

_KINDS = (
    ("directive", r"^[ \t]*\#[ \t]*(?:define[ \t]+\w+(?:\([^)]*\))?|(?!define)[^\n]*)"),
    ("comment", r"/\*.*?\*/|//[^\n]*"),
    ("assembly", r"__asm\b.*?__endasm\b"),
    ("space", r"(?:\\\n|[ \t\r\f\v])+"),
    ("line", r"\n"),
    ("name", r"[A-Za-z_]\w*"),
    ("number", r"0[xX][0-9A-Fa-f]+[uUlL]*|\d+[uUlL]*"),
    ("text", r'"(?:\\.|[^"\\\n])*"|' + r"'(?:\\.|[^'\\\n])*'"),
    ("mark", r"<<=|>>=|\.\.\.|->|\+\+|--|<<|>>|[<>=!+\-*/%&|^]=|&&|\|\||[-+*/%&|^~!<>=?:;,.(){}\[\]]"),
    ("other", r"."),
)
_TOKEN = re.compile("|".join(f"(?P<{kind}>{form})" for kind, form in _KINDS), re.DOTALL | re.MULTILINE)
_BLANK = ("comment", "space", "line")


class Token(NamedTuple):
    """`text` stands at `start`; `macro`: in the body of a `#define`."""

    kind: str
    text: str
    start: int
    macro: bool

    @property
    def end(self):
        return self.start + len(self.text)


def tokens(source):
    """All of `source`, blanks and comments too: the texts in their order are the source again."""
    macro = False
    for found in _TOKEN.finditer(source):
        kind = found.lastgroup or "other"
        if kind == "directive":
            macro = found[0].lstrip(" \t#").startswith("define")
        elif kind == "line":
            macro = False
        yield Token(kind, found[0], found.start(), macro and kind != "directive")


def words(source):
    """The tokens that mean something. Raises ValueError for a character that no C source has."""
    found = [token for token in tokens(source) if token.kind not in _BLANK]
    for token in found:
        if token.kind == "other":
            line = source.count("\n", 0, token.start) + 1
            raise ValueError(f"line {line}: {token.text!r} begins no token of C")
    return found
