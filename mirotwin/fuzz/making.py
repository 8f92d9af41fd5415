"""Makes the target of a specification, on the engine that the specification names: hot modules are imported here only
once that is chosen.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, cast

from miro_exact import engine
from miro_exact.bad_input import BadInput
from mirotwin.fuzz.spec import TargetSpec

if TYPE_CHECKING:
    from mirotwin.fuzz.target import Target

MAKERS = {
    "miro": "mirotwin.fuzz.target:robot_target",
    "bare": "mirotwin.fuzz.board_target:board_target",
    "wired": "mirotwin.fuzz.board_target:wired_target",
}
"""Board -> "module:function"; the function takes the specification and returns its target."""


def make_target(spec: TargetSpec) -> Target:
    """Raises BadInput for a target that cannot be made."""
    if spec.engine:
        engine.select(spec.engine)
    place = spec.maker or MAKERS[spec.board]
    module, _, name = place.partition(":")
    try:
        make = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise BadInput("target", "maker", f"{place}: {error}", "write it as module:function") from None
    return cast("Target", make(spec))
