"""`mirotwin scenarios`: the built-in ones, and their files to copy from."""

import json
from typing import Annotated, Any

import click

from miro_exact.bad_input import shortened
from miro_sim.scenario import file as scenario_file
from miro_sim.scenario import profiles as scenario_profiles
from miro_sim.scenario.board_scenario import load_any
from mirotwin.shell.command import Argument, Options, command_of
from mirotwin.shell.console import plain_table
from mirotwin.shell.console import show as print_result
from mirotwin.shell.options import SET, ScenarioName
from mirotwin.shell.program import LazyGroup


class ScenariosGroup(LazyGroup):
    """Names the right command if the first argument is a scenario instead of a command."""

    def shows(self, name: str) -> bool:
        """True if `show` takes this name."""
        return name in scenario_file.builtin_names() or name.endswith(".toml")

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if self.shows(name):
            reason = f"No such command {shortened(repr(name))}"
            ctx.fail(f"{reason}; did you mean `{ctx.info_name} show {shortened(name)}`?")
        return super().resolve_command(ctx, args)


@click.group(
    cls=ScenariosGroup, invoke_without_command=True, short_help="Lists the built-in scenarios, or shows one."
)
@click.pass_context
def scenarios(context: click.Context) -> None:
    """Lists the built-in scenarios."""
    if context.invoked_subcommand is not None:
        return
    table = plain_table("scenario", bold=True)
    table.add_column("duration", justify="right")
    table.add_column("robots", justify="right")
    table.add_column("what it shows")
    for name in scenario_file.builtin_names():
        scenario = scenario_file.load(name).scenario
        robots = len([robot for network in scenario.networks for robot in network.robot])
        table.add_row(name, f"{scenario.duration_s:g} s", str(robots), scenario.title)
    print_result(table)
    print_result("write one out, to start from: mirotwin scenarios show NAME")


class ScenarioOptions(Options, frozen=True, kw_only=True):
    COMMAND = "scenarios show"
    name: Annotated[str, Argument("NAME", ScenarioName())]
    settings: Annotated[
        tuple[str, ...],
        SET.saying(
            "A key to set in it, as for `run`; may be repeated. The file is then checked, and its comments are left"
            " out."
        ),
    ] = ()


@command_of(ScenarioOptions)
def show(options: ScenarioOptions) -> None:
    """Prints the file of the built-in scenario NAME, to read or to copy as a start for yours. NAME may be a file, too.

    A file of three lines is that scenario with single keys changed:

    \b
        scenario = "fig6"
        name = "mine"
        set = { network.robot.controller.q1_per_s = 0.3 }
    """
    name, settings = options.name, options.settings
    text = load_any(name, settings).text if settings else scenario_file.source_text(name)
    click.echo(text, nl=False)


scenarios.add_command(show)


@scenarios.command()
def profiles() -> None:
    """Lists the radio profiles and the keys that each sets, for `profile = ".."` in [network.radio]."""
    table = plain_table("profile", "what it does", "keys", bold=True)
    for name, profile in scenario_profiles.tables_of("profile").items():
        table.add_row(name, profile["about"], _keys(scenario_profiles.keys_of(name)))
    print_result(table)


@scenarios.command()
def variants() -> None:
    """Lists the variants, for `--set variant=..` or `variant = ".."` in a file, and the keys that each sets.

    With --set a variant overrides the file and settings before it; in a file, keys that are given override the variant.
    """
    table = plain_table("variant", "what it is", "keys", bold=True)
    for name, variant in scenario_profiles.tables_of("variant").items():
        keys = _keys({key: value for key, value in variant.items() if key != "about"})
        table.add_row(name, variant["about"], keys)
    print_result(table)


def _keys(table: dict[str, Any]) -> str:
    """A table as TOML in one line."""
    return ", ".join(
        f"{key} = {{ {_keys(value)} }}" if isinstance(value, dict) else f"{key} = {json.dumps(value)}"
        for key, value in table.items()
    )
