"""Programs that are no firmware for the robot: each is some bytes of 8051 code, from address 0 on."""

from tests.robot.mcs51.asm import image_of as image_of

HANGS = bytes.fromhex("80 fe")  # SJMP $
FAULTS = bytes.fromhex("a5 80 fd")  # the undefined opcode, again and again
RUNS_OUT = bytes.fromhex("00")  # beyond its own end
BABBLES = bytes.fromhex(
    "75 cb ff 75 ca b2 75 c8 34 75 98 50 75 99 55 30 99 fd c2 99 80 f6"
)  # sends 55h without end
PUSHES = bytes.fromhex("c0 e0 80 fc")  # PUSH ACC without end
POKES = bytes.fromhex("75 a0 e6 75 80 01 b2 a2 80 fc")  # writes to both LM629 without end
READS_BOTH = bytes.fromhex("75 a0 e4 b2 a1 80 fc")
