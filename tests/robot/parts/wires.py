"""Masters that tests move by hand: a display's bus, an I2C bus."""

from tests.robot.parts.bench import Bench

HZ = 12_000_000
US = 12
MS = 12_000
DATA = [f"d{bit}" for bit in range(8)]


class Wires(Bench):
    """One part named `chip`, and a master that drives `nets`."""

    def __init__(self, keys, pins, nets, **named):
        super().__init__({"chip": (keys, pins)}, nets, **{"crystal_hz": HZ, **named})

    def set(self, **levels):
        """Drives nets from now on, all at once; None lets go."""
        self.drive_all(levels)

    def later(self, ticks):
        """Lets time pass."""
        self.run(self.tick + ticks)

    def value(self, key):
        return self.read(f"chip.{key}")


class LcdBus(Wires):
    """A display, and a program that talks to it over all its pins or over four wires."""

    def __init__(self, keys, wires=8, reading=True, **named):
        self.data = DATA[8 - wires :]
        nets = ["rs", "e", *self.data] + ["rw"] * reading
        super().__init__(keys, {net: net for net in nets}, nets, **named)
        self.later(US)
        self.set(e=0)
        self.later(US)
        self.set(rs=0, **dict.fromkeys(self.data, 0), **({"rw": 0} if reading else {}))

    def pulse(self, value, rs=0):
        """Puts a byte, or half of one, on the data wires, and E high for a microsecond."""
        bits = 8 - len(self.data)
        self.set(rs=rs, **{net: value >> (index + bits) & 1 for index, net in enumerate(self.data)})
        self.later(US)
        self.set(e=1)
        self.later(US)
        self.set(e=0)
        self.later(US)

    def write(self, value, rs=0, wait=50 * US):
        """A byte: at once or in two halves."""
        self.pulse(value, rs)
        if len(self.data) == 4:
            self.pulse(value << 4, rs)
        self.later(wait)

    def command(self, *values):
        for value in values:
            self.write(value, wait=2 * MS if value < 4 else 50 * US)

    def print(self, text):
        for character in text:
            self.write(ord(character), 1)

    def half(self, rs):
        """What the data wires show while E is high."""
        self.set(rs=rs, rw=1, **dict.fromkeys(self.data))
        self.later(US)
        self.set(e=1)
        self.later(US)
        bits = 8 - len(self.data)
        value = sum(self.level(net) << (index + bits) for index, net in enumerate(self.data))
        self.set(e=0)
        self.later(US)
        self.set(rw=0)
        return value

    def get(self, rs=0):
        """A byte that is read: busy flag and address, or data."""
        value = self.half(rs)
        if len(self.data) == 4:
            value |= self.half(rs) >> 4
        return value

    def begin(self, lines=2):
        """Initializes it by instruction, shows it without a cursor and clears it."""
        self.later(15 * MS)
        for wait in (5 * MS, 200 * US, 50 * US):
            self.pulse(0x30)
            self.later(wait)
        if len(self.data) == 4:
            self.pulse(0x20)
            self.later(50 * US)
        wide = 0x10 if len(self.data) == 8 else 0
        self.command(0x20 | wide | (8 if lines == 2 else 0), 0x0C, 0x01, 0x06)
        return self


class I2cBus(Wires):
    """A target at SCL and SDA, and a master that is moved bit by bit."""

    def __init__(self, keys, half=5 * US, pins=(), **named):
        self.half = half
        wired = {"scl": "scl", "sda": "sda", **{pin: pin for pin in pins}}
        super().__init__(keys, wired, ["scl", "sda", *pins], **named)
        self.later(self.half)

    def wire(self, **levels):
        """An open drain: a 1 lets go."""
        self.set(**{net: None if level else 0 for net, level in levels.items()})
        self.later(self.half)

    def start(self):
        self.wire(sda=1)
        self.wire(scl=1)
        self.wire(sda=0)
        self.wire(scl=0)

    def stop(self):
        self.wire(sda=0)
        self.wire(scl=1)
        self.wire(sda=1)

    def bit(self, level=1):
        self.wire(sda=level)
        self.set(scl=None)
        while not self.level("scl"):  # the target stretches the clock
            self.later(US)
        self.later(self.half)
        seen = self.level("sda")
        self.wire(scl=0)
        return seen

    def send(self, *values):
        """Whether each byte was acknowledged."""
        acks = []
        for value in values:
            for index in range(7, -1, -1):
                self.bit(value >> index & 1)
            acks.append(not self.bit())
        return acks

    def receive(self, count):
        """Bytes that are read, the last one without acknowledge."""
        values = []
        for number in range(count):
            value = 0
            for _ in range(8):
                value = value << 1 | self.bit()
            self.bit(number == count - 1)
            values.append(value)
        return values

    def write(self, *values):
        """Start, bytes, stop; whether all were acknowledged."""
        self.start()
        acks = self.send(*values)
        self.stop()
        return all(acks)

    def read_from(self, address, *word, count):
        """The bytes from a word address on."""
        self.start()
        assert all(self.send(address, *word))
        self.start()
        assert all(self.send(address | 1))
        values = self.receive(count)
        self.stop()
        return values


class OneWireBus(Wires):
    """A thermometer at `dq`, or several by their names, and a master that makes slots of 70 us."""

    def __init__(self, *keys, **named):
        Bench.__init__(
            self,
            {f"chip{number or ''}": (one, {"dq": "dq"}) for number, one in enumerate(keys)},
            ["dq"],
            **{"crystal_hz": HZ, **named},
        )
        self.later(100 * US)

    def low(self, us, then_us):
        self.set(dq=0)
        self.later(int(us * US))
        self.set(dq=None)
        self.later(int(then_us * US))

    def reset(self, us=480):
        """Whether somebody answers."""
        self.low(us, 70)
        present = not self.level("dq")
        self.later(410 * US)
        return present

    def put_bit(self, level):
        self.low(6 if level else 60, 64 if level else 10)

    def get_bit(self):
        self.low(2, 10)
        level = self.level("dq")
        self.later(58 * US)
        return level

    def send(self, *values):
        for value in values:
            for bit in range(8):
                self.put_bit(value >> bit & 1)

    def receive(self, count):
        return [sum(self.get_bit() << bit for bit in range(8)) for _ in range(count)]
