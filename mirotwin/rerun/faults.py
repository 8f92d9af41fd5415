"""What the firmware did wrong, on stderr, and the exit code that follows."""

from miro_sim.world.world import World
from mirotwin.rerun import runner
from mirotwin.shell.program import DONE, FIRMWARE_FAULT, complain


def report_faults(world: World) -> int:
    """Says on stderr what the firmware did wrong; returns the exit code."""
    found = runner.faults_by_robot(world)
    for network, slot, faults in found:
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        complain(f"firmware fault: net{network}/robot{slot}: {faults[0]}{more}")
    return FIRMWARE_FAULT if found else DONE
