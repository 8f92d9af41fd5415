"""The radio on a real UART: a bare CPU that stores what it receives, and the robot with its firmware."""

from miro_exact.rng import Stream
from miro_sim.radio.downlink import Downlink
from tests.robot.firmware.rig import BOOTED, MS, Rig
from tests.robot.mcs51.rig import cpu_with
from tests.robot.mcs51.test_uart import RECEIVER, TIMER2_9600

SLOW = """
loop:
JNB RI,loop
MOV R7,#{tens}
wait:
MOV R6,#250
DJNZ R6,$
DJNZ R7,wait
MOV @R0,SBUF
INC R0
CLR RI
SJMP loop
"""


def receiver():
    """Stores pairs (SBUF, RB8) from 30h on."""
    return cpu_with("MOV R0,#30h\n" + TIMER2_9600 + RECEIVER.format(scon="50h"))


def slow_receiver(tens):
    """Stores SBUF from 30h on, about tens * 500 machine cycles (a character has 2080) after RI."""
    return cpu_with("MOV R0,#30h\n" + TIMER2_9600 + "MOV SCON,#50h\n" + SLOW.format(tens=tens))


def hears(cpu, radio, seed, sent, until):
    """The CPU after listening to these transmissions up to a tick; stream names begin with net/robot0."""
    downlink = Downlink(radio, seed, "net")
    downlink.listen(0, cpu.rxd)
    for one in sent:
        downlink.send(*one)
    downlink.settle(until + MS)
    cpu.run(until // 12)
    return cpu


def stored(cpu):
    """What the receiver has put into its memory."""
    return bytes(cpu.peek_iram(place) for place in range(0x30, cpu.peek_iram(0)))


def seed_where(radio, start, bits, wanted):
    """The first seed whose errors in a transmission of so many bits from tick `start` on are as wanted."""
    for seed in range(1_000_000):
        errors = Stream(seed, "net/robot0/errors")
        first = start // 2500
        if wanted([bit for bit in range(bits) if errors.below(first + bit, radio.error_threshold)]):
            return seed
    raise AssertionError("no seed among a million")


class RadioRig(Rig):
    """A robot whose RXD hangs on a downlink, `self.downlink`; send there, then `run_to`."""

    def __init__(self, radio, seed=0, n=3):
        super().__init__(n=n, boot=False)
        self.downlink = Downlink(radio, seed, "net")
        self.downlink.listen(0, self.cpu.rxd)
        self.run_to(BOOTED)

    def run_to(self, tick):
        while self.now < tick:
            until = min(tick, self.now + 50 * MS)
            self.downlink.settle(until + 120)
            self.board.run(until)
            self.now = until
        assert self.board.faults == [], self.board.faults
