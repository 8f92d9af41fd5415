"""Programs that are no firmware for the robot: each is some bytes of 8051 code, from address 0 on."""

from pathlib import Path

from miro_robot.image import parse_hex

HANGS = bytes.fromhex("80 fe")  # SJMP $
FAULTS = bytes.fromhex("a5 80 fd")  # the undefined opcode, again and again
RUNS_OUT = bytes.fromhex("00")  # beyond its own end
BABBLES = bytes.fromhex(
    "75 cb ff 75 ca b2 75 c8 34 75 98 50 75 99 55 30 99 fd c2 99 80 f6"
)  # sends 55h without end
PUSHES = bytes.fromhex("c0 e0 80 fc")  # PUSH ACC without end
POKES = bytes.fromhex("75 a0 e6 75 80 01 b2 a2 80 fc")  # writes to both LM629 without end
READS_BOTH = bytes.fromhex("75 a0 e4 b2 a1 80 fc")


def hex_of(code):
    """Intel HEX."""
    records = [_record(at, 0, code[at : at + 16]) for at in range(0, len(code), 16)]
    return "\n".join([*records, _record(0, 1, b"")]) + "\n"


def _record(address, kind, data):
    body = bytes([len(data), address >> 8, address & 0xFF, kind]) + data
    return f":{body.hex().upper()}{-sum(body) & 0xFF:02X}"


def image_of(code):
    return parse_hex(hex_of(code).encode(), Path("program.ihx"))
