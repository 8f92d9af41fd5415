"""A target of one's own, derived from the bus: bytes come and go, and the clock may be stretched."""

from miro_robot.parts.i2c import I2C_PINS, I2cTarget
from miro_robot.parts.keys import PartKeys
from tests.robot.parts.wires import MS, US, I2cBus


class Echo(PartKeys, frozen=True, kw_only=True, tag="echo"):
    """Gives back the bytes that were sent to address 20h, last first; takes three at most."""

    PINS = I2C_PINS
    stretch_us: int = 0

    def make(self, place):
        return EchoPart(self, place)


class EchoPart(I2cTarget):
    def __init__(self, keys, place):
        I2cTarget.__init__(self, keys, place)
        self.kept = []
        self.told = []

    def addressed(self, byte, tick):
        return byte >> 1 == 0x20

    def received(self, byte, tick):
        if self.keys.stretch_us:
            self.hold(tick + self.ticks(self.keys.stretch_us))
        if len(self.kept) == 3:
            return False
        self.kept.append(byte)
        return True

    def transmit(self, tick):
        return self.kept.pop() if self.kept else 0x100

    def ended(self, tick):
        self.told.append("ended")
        self.wake(tick + 100)

    def woken(self, tick):
        self.told.append("woken")


def test_bytes_reach_the_part_and_come_back():
    bus = I2cBus(Echo())
    assert bus.write(0x40, 1, 2, 3)
    bus.start()
    assert bus.send(0x41) == [True]
    assert bus.receive(4) == [3, 2, 1, 0]
    bus.stop()


def test_a_byte_it_does_not_want_is_not_acknowledged_and_ends_the_transmission():
    bus = I2cBus(Echo())
    bus.start()
    assert bus.send(0x40, 1, 2, 3, 4, 5) == [True, True, True, True, False, False]
    bus.stop()
    assert bus.named["chip"].told == []


def test_others_addresses_are_none_of_its_business():
    bus = I2cBus(Echo())
    bus.start()
    assert bus.send(0x42, 1, 2) == [False, False, False]
    bus.stop()
    assert bus.named["chip"].kept == []


def test_a_stretched_clock_makes_the_master_wait():
    quick, slow = I2cBus(Echo()), I2cBus(Echo(stretch_us=500))
    for bus in (quick, slow):
        assert bus.write(0x40, 7, 8)
    assert 2 * 450 * US < slow.tick - quick.tick < 2 * 500 * US
    assert slow.named["chip"].kept == [7, 8]
    assert bus.level("scl") == 1


def test_supply_that_is_lost_while_it_stretches_lets_the_clock_go():
    bus = I2cBus(Echo(stretch_us=500))
    bus.start()
    bus.send(0x40)
    for _ in range(8):
        bus.bit(1)
    bus.set(scl=None)
    assert bus.level("scl") == 0
    bus.power(0)
    assert bus.level("scl") == 1
    bus.later(MS)


def test_it_is_told_of_a_stop_and_of_what_it_waits_for():
    bus = I2cBus(Echo())
    bus.write(0x40, 1)
    assert bus.named["chip"].told == ["ended"]
    bus.later(200)
    assert bus.named["chip"].told == ["ended", "woken"]


def test_a_stop_after_reading_ends_nothing_for_it():
    bus = I2cBus(Echo())
    bus.start()
    bus.send(0x41)
    bus.receive(1)
    bus.stop()
    assert bus.named["chip"].told == []
