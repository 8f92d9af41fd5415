"""An HD44780 as slow as it is plain: lines are lists that are turned, half bytes wait in a list.

`step` gets all levels whenever one has changed, once a tick, as a dict of pins. Times are in ticks.
"""

LINE_1, LINE_2 = list(range(0x28)), list(range(0x40, 0x68))


class Lcd:
    def __init__(self, short, long, count, reset, width, cycle, select, data):
        self.short, self.long, self.count = short, long, count
        self.limits = {"width": width, "cycle": cycle, "select": select, "data": data}
        self.memory = dict.fromkeys(range(128), " ")
        self.own = dict.fromkeys(range(64), "\0")
        self.wide, self.two = True, False
        self.shown = self.cursor = self.blink = False
        self.forward, self.follow = True, False
        self.where = ("DD", 0)
        self.register = "\0"
        self.halves = []
        self.turned = 0
        self.busy_until = reset
        self.address_from = (0, 0)  # up to which tick the address of before is read, and which one
        self.moved = {}  # pin -> tick of its last change
        self.rise = None
        self.pins = None
        self.lost = self.broken = 0

    def order(self):
        return LINE_1 + LINE_2 if self.two else list(range(80))

    def after(self, forward):
        kind, address = self.where
        if kind == "CG":
            return kind, (address + (1 if forward else -1)) % 64
        order = self.order()
        if address in order:
            return kind, order[(order.index(address) + (1 if forward else -1)) % len(order)]
        return kind, (address + (1 if forward else -1)) % 128  # nowhere: it just counts

    def content(self):
        kind, address = self.where
        return self.own[address] if kind == "CG" else self.memory[address]

    def rows(self, columns=16):
        lines = [LINE_1, LINE_2] if self.two else [list(range(80)), None]
        rows = []
        for line in lines:
            if line is None or not self.shown:
                rows.append(" " * columns)
                continue
            turned = line[self.turned % len(line) :] + line[: self.turned % len(line)]
            rows.append("".join(self.memory[address] for address in turned[:columns]))
        return rows

    def output(self, tick):
        """Levels of d0 to d7 that it drives, None where it drives nothing."""
        if not (self.pins["e"] and self.pins["rw"]):
            return [None] * 8
        if self.pins["rs"]:
            value = ord(self.register)
        else:
            until, before = self.address_from
            value = (before if tick < until else self.where[1]) + (128 if tick < self.busy_until else 0)
        bits = [value >> bit & 1 for bit in range(8)]
        if self.wide:
            return bits
        return [None] * 4 + (bits[:4] if self.halves else bits[4:])

    def driven(self, tick, before):
        """What it puts on the data wires itself; the busy flag may fall on the tick on which E does, and is first."""
        now, self.pins = self.pins, before
        levels = {f"d{bit}": level for bit, level in enumerate(self.output(tick)) if level is not None}
        self.pins = now
        return levels

    def step(self, tick, pins, touched=()):
        """`touched`: pins that have moved on this tick and may be back where they were."""
        before, self.pins = self.pins, pins
        if before is None:
            return
        changed = [name for name in pins if pins[name] != before[name]]
        rs_rw = {"rs", "rw"} & {*changed}
        if "e" in changed and pins["e"]:
            late = rs_rw or any(self.is_near(tick, name, "select") for name in ("rs", "rw"))
            fast = self.rise is not None and tick - self.rise < self.limits["cycle"]
            self.broken += bool(late or fast)
            self.rise = tick
        elif "e" in changed and (self.rise is not None or tick >= self.busy_until):
            self.rise = -(10**9) if self.rise is None else self.rise  # it was high from power-on on
            self.fall(tick, {**before, **self.driven(tick, before)}, {*changed} - {"e"})
        elif "e" in changed:
            self.rise = -(10**9)
        for name in (*changed, *touched):
            self.moved[name] = tick

    def is_near(self, tick, name, limit):
        return name in self.moved and tick - self.moved[name] < self.limits[limit]

    def fall(self, tick, pins, moving):
        late = moving or any(self.is_near(tick, f"d{bit}", "data") for bit in range(8))
        self.broken += bool((late and not pins["rw"]) or tick - self.rise < self.limits["width"])
        value = sum(pins[f"d{bit}"] << bit for bit in range(8))
        if not self.wide:
            self.halves.append(value >> 4)
            if len(self.halves) == 1:
                return
            value = self.halves[0] * 16 + self.halves[1]
            self.halves = []
        if pins["rw"] and not pins["rs"]:
            return
        if tick < self.busy_until:
            self.lost += not pins["rw"]
        elif pins["rs"]:
            self.exchange(tick, None if pins["rw"] else chr(value))
        else:
            self.instruct(tick, value)

    def exchange(self, tick, written):
        kind, address = self.where
        if written is not None:
            self.register = written
            (self.own if kind == "CG" else self.memory)[address] = written
            if kind == "DD" and self.follow:
                self.turn(1 if self.forward else -1)
        self.where = self.after(self.forward)
        if written is None:
            self.register = self.content()
        self.busy_until = tick + self.short
        self.address_from = self.busy_until + self.count, address

    def turn(self, step):
        self.turned = (self.turned + step) % (40 if self.two else 80)

    def instruct(self, tick, value):
        bits = f"{value:08b}"
        self.busy_until = tick + (self.long if value in (1, 2, 3) else self.short)
        self.address_from = 0, 0
        first = bits.find("1")
        if first == 0:
            self.where = "DD", int(bits[1:], 2)
        elif first == 1:
            self.where = "CG", int(bits[2:], 2)
        elif first == 2:
            self.wide, self.two = bits[3] == "1", bits[4] == "1"
            self.turn(0)
        elif first == 3 and bits[4] == "1":
            self.turn(-1 if bits[5] == "1" else 1)
        elif first == 3:
            self.where = self.after(bits[5] == "1")
        elif first == 4:
            self.shown, self.cursor, self.blink = (bit == "1" for bit in bits[5:])
        elif first == 5:
            self.forward, self.follow = bits[6] == "1", bits[7] == "1"
        elif first in (6, 7):
            self.where, self.turned = ("DD", 0), 0
        if first == 7:
            self.memory = dict.fromkeys(range(128), " ")
            self.forward = True
        if first in (0, 1, 6, 7) or (first == 3 and bits[4] == "0"):
            self.register = self.content()
