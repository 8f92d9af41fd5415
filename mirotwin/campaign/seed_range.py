"""`--seeds FIRST-LAST` of the commands that make many runs."""

from __future__ import annotations

from typing import Any

import click

from mirotwin.campaign.seeds import MOST_SEEDS, seeds_of
from mirotwin.shell.command import Option


class SeedRange(click.ParamType[range]):
    """Seeds from a first one to a last one: 0-49, or one alone; at most `most` of them."""

    name = "seeds"

    def __init__(self, most: int = MOST_SEEDS) -> None:
        self.most = most

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> range:
        if isinstance(value, range):
            return value
        try:
            return seeds_of(str(value), self.most)
        except ValueError as error:
            self.fail(str(error), param, ctx)

    def written(self, value: range) -> str:
        return f"{value[0]}-{value[-1]}"


SEEDS = Option("--seeds", type=SeedRange(), help="First and last seed.")
