"""`mirotwin camera`: the list of commands for the camera; each is loaded when it is used."""

import click

from mirotwin.shell.program import Lazy, LazyGroup

COMMANDS = {
    "look": Lazy(
        "mirotwin.camera.look_command", "Draws what the camera sees and what the tracker makes of it."
    ),
    "calibrate": Lazy(
        "mirotwin.camera.calibrate_command", "Finds a camera's parameters from control points."
    ),
    "track": Lazy(
        "mirotwin.camera.track_command", "Finds robots in pictures of your own, or in recorded ones."
    ),
}


@click.group(
    cls=LazyGroup,
    sections={"Commands": COMMANDS},
    short_help="Camera: look, calibrate, track robots in pictures.",
)
def camera() -> None:
    """Camera: look through it, calibrate it, and track robots in pictures."""
