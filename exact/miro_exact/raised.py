"""Locates an error of a plug-in: file, line and function, for the error message.

Our own code calls the plug-in and may be called by it, so neither end of a traceback helps the plug-in's author. The
useful line is the innermost one in the plug-in's first file.
"""

from __future__ import annotations

import os
from types import CodeType, FrameType
from typing import Any

OURS = ("miro_exact", "miro_protocol", "miro_robot", "miro_host", "miro_sim", "mirotwin")
_LOADERS = ("importlib_metadata",)
"""Loads plug-ins instead of `importlib.metadata` in a process that has imported it."""
_STANDARD = os.path.dirname(os.__file__) + os.sep
_INSTALLED = ("site-packages", "dist-packages")


def described(error: BaseException) -> str:
    """Type and message of an exception in one line."""
    text = f"{error}".strip().partition("\n")[0]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def raised(error: BaseException) -> str:
    """Type, message and place of a plug-in's exception, in one line."""
    return at_place(described(error), raised_at(error) or _raised_by_ours(error))


def at_place(text: str, place: str) -> str:
    """`text` with the place, if it is known."""
    return f"{text} ({place})" if place else text


def raised_at(error: BaseException) -> str:
    """`FILE:LINE in FUNCTION` of the plug-in's code that raised it; "" if no such code was running."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{_shown(error.filename)}:{error.lineno}"
    steps = _steps(error)
    file = next((frame.f_code.co_filename for frame, _ in steps if _foreign(frame)), None)
    places = [_place(frame.f_code, line) for frame, line in steps if frame.f_code.co_filename == file]
    return places[-1] if places else ""


def _raised_by_ours(error: BaseException) -> str:
    """The line in our own code that raised it, for a plug-in of this tree."""
    below = _steps(error)[1:]
    ours = bool(below) and _is_ours(below[-1][0].f_globals.get("__name__"))
    return _place(below[-1][0].f_code, below[-1][1]) if ours else ""


def _steps(error: BaseException) -> list[tuple[FrameType, int]]:
    """Frames and lines of a traceback, from the catcher to the raiser."""
    from traceback import walk_tb  # only an error needs it

    return list(walk_tb(error.__traceback__))


def defined_at(function: Any) -> str:
    """`FILE:LINE in FUNCTION` of a plug-in's function or method; "" for ours, and for one that is not Python."""
    function = getattr(function, "__func__", function)
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType) or _is_ours(getattr(function, "__module__", "")):
        return ""
    return _place(code, code.co_firstlineno)


def _foreign(frame: FrameType) -> bool:
    """True if it is neither our code nor Python's."""
    module = frame.f_globals.get("__name__", "")
    if _is_ours(module) or module.partition(".")[0] in _LOADERS:
        return False
    file = frame.f_code.co_filename
    standard = file.startswith(_STANDARD) and not any(part in file for part in _INSTALLED)
    return not standard and not file.startswith("<frozen ")


def _is_ours(module: Any) -> bool:
    return isinstance(module, str) and module.partition(".")[0] in OURS


def _place(code: CodeType, line: int) -> str:
    name = code.co_qualname
    return f"{_shown(code.co_filename)}:{line}" + ("" if name == "<module>" else f" in {name}")


def _shown(file: str) -> str:
    """The path from here, if the file is below."""
    here = os.path.join(os.getcwd(), "")
    return file.removeprefix(here)
