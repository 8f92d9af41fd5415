"""`mirotwin campaign`: `FILE.toml` makes the runs of a campaign, `show RESULTS.parquet` shows the results."""

from __future__ import annotations

import click

from mirotwin.shell.program import Lazy, LazyGroup

COMMANDS = {
    "run": Lazy(
        "mirotwin.campaign.campaign_run", "Makes the runs of FILE.toml; `campaign FILE.toml` is short for it."
    ),
    "show": Lazy(
        "mirotwin.campaign.campaign_show", "Statistics of RESULTS.parquet, alone or against a baseline."
    ),
    "page": Lazy("mirotwin.campaign.campaign_page", "Makes one page of RESULTS.parquet."),
}


class CampaignGroup(LazyGroup):
    """What is no command's name is the file of `run`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*COMMANDS, *ctx.help_option_names):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(
    cls=CampaignGroup,
    sections={"Commands": COMMANDS},
    short_help="Runs a scenario many times, varied, and compares.",
)
def campaign() -> None:
    """Runs a scenario over seeds and values of its keys, and shows the results.

    FILE.toml says which runs; `mirotwin examples campaign` writes one.
    """
