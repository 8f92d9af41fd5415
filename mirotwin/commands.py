"""The `mirotwin` command: the list of its commands, in groups by what people do.

A command's module is loaded when the command is used, after `--engine` was read (`program.settle_engine`).
"""

import click

from mirotwin.shell.program import Lazy, MainGroup, print_version

SECTIONS = {
    "Simulate": {
        "run": Lazy("mirotwin.run.run_command", "Runs a scenario and writes its files."),
        "serve": Lazy(
            "mirotwin.ports.serve_command", "Offers the robot's radio as PTY, TCP and RFC 2217 ports."
        ),
        "campaign": Lazy(
            "mirotwin.campaign.campaign_command", "Runs a scenario many times, varied, and compares."
        ),
        "scenarios": Lazy("mirotwin.run.scenarios_command", "Lists the built-in scenarios, or shows one."),
    },
    "Test firmware": {
        "init": Lazy(
            "mirotwin.testing.init_command",
            "Begins a project: firmware, tests, scenarios, a workflow for CI.",
        ),
        "examples": Lazy(
            "mirotwin.testing.examples_command", "Lists the examples, or writes one into a folder."
        ),
        "test": Lazy(
            "mirotwin.testing.test_command", "Runs scenario files and cases as tests, a verdict each."
        ),
        "conform": Lazy(
            "mirotwin.verify.conform.conform_command", "Tries the protocol's rules on a firmware image."
        ),
        "debug": Lazy("mirotwin.debug.debug_command", "Steps through the firmware, forwards and backwards."),
        "fuzz": Lazy("mirotwin.fuzz.fuzz_command", "Looks for inputs that make a firmware image fail."),
    },
    "Recorded data": {
        "replay": Lazy("mirotwin.replay.replay_command", "Sends recorded bytes again and compares."),
        "diff": Lazy("mirotwin.replay.diff_command", "Compares two recordings."),
        "report": Lazy("mirotwin.report.report_command", "Makes one page of a run, a case or a failed test."),
        "decode": Lazy("mirotwin.recording.decode_command", "Decodes captured bytes to frames and damage."),
        "export": Lazy(
            "mirotwin.report.export_command", "Writes a run for Foxglove, Wireshark, or as a stream file."
        ),
    },
    "Camera and firmware": {
        "camera": Lazy(
            "mirotwin.camera.camera_command", "Camera: look, calibrate, track robots in pictures."
        ),
        "fw": Lazy(
            "mirotwin.firmware.fw_command",
            "Firmware: run on the bare processor, disassemble, trace, profile.",
        ),
    },
    "Paper and installation": {
        "reproduce": Lazy(
            "mirotwin.campaign.reproduce.reproduce_command",
            "Runs the paper's figures again and writes one page about them.",
        ),
        "info": Lazy("mirotwin.shell.info_command", "Shows versions, engine and firmware."),
    },
}
COMMANDS = {name: lazy for section in SECTIONS.values() for name, lazy in section.items()}


@click.group(
    cls=MainGroup,
    sections=SECTIONS,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=print_version,
    help="Show the version.",
)
def main() -> None:
    """A bit-exact twin of a vision-guided soccer robot.

    Exit codes: 0 done, 1 expectation failed, 2 bad input, 3 firmware fault, 4 divergence,
    42 cycle limit reached; 70 internal error, 130 and 143 ended by Ctrl-C and SIGTERM.
    """
