"""The options of `mirotwin run` for viewers: where, how fast, and whether to wait for one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from miro_exact.bad_input import shortened
from mirotwin.rerun.pacing import FASTEST
from mirotwin.shell.options import Number

Command = TypeVar("Command", bound=Callable[..., Any])
HERE = "127.0.0.1"
PORT = 8765
"""Where Foxglove looks first."""
HIGHEST_PORT = 65_535
DEFAULT = f"{HERE}:{PORT}"


class Address(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """HOST:PORT, or PORT."""

    name = "host:port"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        host, _, port = f"{value}".rpartition(":")
        if not (port.isascii() and port.isdecimal() and len(port) <= 5) or int(port) > HIGHEST_PORT:
            self.fail(
                f"{shortened(repr(value))} is no HOST:PORT; write --live={DEFAULT}, or --live alone at the end."
            )
        return host.strip("[]") or HERE, int(port)


class PaceFactor(click.ParamType):  # type: ignore[type-arg, unused-ignore]
    """A positive number, or "max" (0.0)."""

    name = "factor"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "max":
            return 0.0
        return Number(0.0, FASTEST, min_open=True).convert(value, param, ctx)


def live_options(command: Command) -> Command:
    """--live, --pace and --live-wait."""
    command = click.option(
        "--live-wait",
        "wait",
        is_flag=True,
        help="With --live: begin when a viewer is there and has asked for topics.",
    )(command)
    command = click.option(
        "--pace",
        type=PaceFactor(),
        help="With --live: virtual seconds in a second of the wall clock, or max. Default: 1.",
    )(command)
    return click.option(
        "--live",
        type=Address(),
        is_flag=False,
        flag_value=DEFAULT,
        metavar="[HOST:PORT]",
        help=f"Let Foxglove watch. Default place: {DEFAULT}; port 0 is any that is free.",
    )(command)
