"""The `mirotwin` command: the list of its commands, in groups by what people do.

A command's module is loaded when the command is used, after `--engine` was read (`program.settle_engine`).
"""

import click

from mirotwin.shell.program import Lazy, LazyGroup, MainGroup

CAMERA = {
    "look": Lazy("camera.look_command", "Draws what the camera sees and what the tracker makes of it."),
    "calibrate": Lazy("camera.calibrate_command", "Finds a camera's parameters from control points."),
    "track": Lazy("camera.track_command", "Finds robots in pictures of your own, or in recorded ones."),
}


@click.group(
    cls=LazyGroup,
    sections={"Commands": CAMERA},
    short_help="Camera: look, calibrate, track robots in pictures.",
)
def camera() -> None:
    """Camera: look through it, calibrate it, and track robots in pictures."""


FIRMWARE = {
    "run": Lazy("firmware.fw_run", "Runs IMAGE.ihx on a bare AT89C52."),
    "disasm": Lazy("firmware.fw_image", "Lists an image's instructions."),
    "trace": Lazy("firmware.fw_trace", "Writes each instruction with the registers it changed."),
    "profile": Lazy("firmware.fw_profile", "Shows where the processor spends its time."),
    "coverage": Lazy("firmware.fw_profile", "Shows which lines of the firmware ran."),
    "sanitize": Lazy("firmware.fw_sanitize", "Finds variables torn by interrupts, and such."),
    "vcd": Lazy("firmware.fw_trace", "Writes the wires as a VCD file."),
    "header": Lazy("firmware.fw_image", "Writes protocol.h: the numbers of the wire for C."),
}


@click.group(
    cls=LazyGroup,
    sections={"Commands": FIRMWARE},
    short_help="Firmware: run on the bare processor, disassemble, trace, profile.",
)
def fw() -> None:
    """Firmware: run on the bare processor, disassemble, trace, profile.

    SUBJECT: an IMAGE.ihx on the bare processor, or the robot in a scenario (a built-in name or a .toml), in a recording
    (run.mcap) or on a stream file.
    """


CAMPAIGN = {
    "run": Lazy(
        "campaign.campaign_run", "Makes the runs of FILE.toml; `campaign FILE.toml` is short for it."
    ),
    "show": Lazy("campaign.campaign_show", "Statistics of RESULTS.parquet, alone or against a baseline."),
    "page": Lazy("campaign.page", "Makes one page of RESULTS.parquet."),
}


class CampaignGroup(LazyGroup):
    """A first argument that is no command's name is the FILE of `run`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*CAMPAIGN, *ctx.help_option_names):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(
    cls=CampaignGroup,
    sections={"Commands": CAMPAIGN},
    short_help="Runs a scenario many times, varied, and compares.",
)
def campaign() -> None:
    """Runs a scenario over seeds and values of its keys, and shows the results.

    FILE.toml defines the runs; `mirotwin examples campaign` writes an example.
    """


SECTIONS = {
    "Simulate": {
        "run": Lazy("run.run_command", "Runs a scenario and writes its files."),
        "serve": Lazy("ports.serve_command", "Offers the robot's radio as PTY, TCP and RFC 2217 ports."),
        "campaign": campaign,
        "scenarios": Lazy("run.scenarios_command", "Lists the built-in scenarios, or shows one."),
        "boards": Lazy("run.boards_command", "Lists the built-in boards, or shows a board or a part."),
        "plugins": Lazy("run.plugins_command", "Lists laws, parts, checks and others that are installed."),
    },
    "Test firmware": {
        "init": Lazy("testing.starter", "Begins a project: firmware, tests, scenarios, a workflow for CI."),
        "examples": Lazy("testing.starter", "Lists the examples, or writes one into a folder."),
        "test": Lazy("testing.test_command", "Runs scenario files and cases as tests, a verdict each."),
        "summary": Lazy("testing.summary_command", "Makes a page of JUnit reports, for CI."),
        "conform": Lazy("conform.conform_command", "Tries the protocol's rules on a firmware image."),
        "debug": Lazy("debug.debug_command", "Steps through the firmware, forwards and backwards."),
        "why": Lazy("campaign.why_command", "Finds when the failure of a run became inevitable."),
        "fuzz": Lazy("fuzz.fuzz_command", "Looks for inputs that make a firmware image fail."),
    },
    "Recorded data": {
        "replay": Lazy("replay.replay_command", "Sends recorded bytes again and compares."),
        "diff": Lazy("replay.diff_command", "Compares two recordings, or two firmware images."),
        "report": Lazy("report.report_command", "Makes one page of a run, a case or a failed test."),
        "decode": Lazy("recording.decode_command", "Decodes captured bytes to frames and damage."),
        "export": Lazy("report.export_command", "Writes a run for Foxglove, Wireshark, or as a stream file."),
    },
    "Paper": {
        "reproduce": Lazy(
            "campaign.reproduce.reproduce_command",
            "Runs the paper's figures again and writes one page about them.",
        )
    },
    "Camera, firmware, installation": {
        "camera": camera,
        "fw": fw,
        "info": Lazy("shell.info_command", "Shows versions, engine and firmware."),
    },
}


@click.group(cls=MainGroup, sections=SECTIONS, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="mirotwin", prog_name="mirotwin", help="Show the version.")
def main() -> None:
    """A bit-exact twin of a vision-guided soccer robot.

    Exit codes: 0 done, 1 expectation failed, 2 bad input, 3 firmware fault, 4 divergence,
    5 nothing judged, 42 cycle limit reached; 70 internal error, 130 and 143 ended by Ctrl-C and SIGTERM.
    """
