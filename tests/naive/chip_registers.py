"""The AT89S52's and STC89C52's own registers, counted cycle by cycle: a program is a list of steps.

Steps: ("write", address, value), ("read", address, slot), ("wait", cycles), ("dptr", value), ("log dptr", slot).
A reset begins the list again; at its end the program waits.
"""

CYCLES = {"write": 2, "read": 2, "dptr": 2, "log dptr": 4}
WAITS = {  # WT -> read, program, erase
    0: (43, 240, 43769),
    1: (22, 120, 21885),
    2: (11, 60, 10942),
    3: (6, 30, 5741),
}


class Twin:
    def __init__(self, chip):
        self.chip = chip
        self.flash = [0xFF] * 5120
        self.slots = {}
        self.now = 0
        self.flag = 0
        self.resets = 0
        self.reset()

    def reset(self):
        self.registers = {0x8E: 0, 0xA2: 0}
        if self.chip == "stc89c52":
            names = dict.fromkeys([0xE1, 0xE3, 0xE4, 0xE5, 0xE7, 0xB7], 0) | {0xE2: 0xFF, 0xE8: 0xFF}
            self.registers |= names | {0xE1: 0x80 * self.flag}
        self.dptrs = [0, 0]
        self.counter = None  # of the watchdog, None: off
        self.before = None
        self.stands = 0
        self.soft = False

    def period(self):
        return 16383 if self.chip == "at89s52" else 32768 * 2 ** ((self.registers[0xE1] & 7) + 1)

    def pass_cycles(self, count):
        self.now += count
        if self.counter is not None:
            self.counter += count

    def run(self, steps, until):
        at = 0
        while self.now < until:
            if self.soft or (self.counter is not None and self.counter >= self.period()):
                if not self.soft:
                    self.flag = 1
                self.resets += 1
                self.reset()
                at = 0
                self.pass_cycles(min(9, until - self.now))
                continue
            if self.stands:
                pause = min(self.stands, until - self.now)
                self.pass_cycles(pause)
                self.stands -= pause
                continue
            if at == len(steps):  # SJMP to itself
                self.pass_cycles(2)
                continue
            kind, *what = steps[at]
            at += 1
            if kind == "wait":
                for _ in range(what[0]):
                    if self.now >= until or (self.counter is not None and self.counter >= self.period()):
                        break
                    self.pass_cycles(1)
                continue
            if kind == "log dptr":
                dptr = self.dptrs[self.registers[0xA2] & 1]
                for offset, byte in enumerate((dptr & 0xFF, dptr >> 8)):
                    if self.now < until and not (self.counter is not None and self.counter >= self.period()):
                        self.pass_cycles(2)
                        self.slots[what[0] + offset] = byte
                continue
            self.pass_cycles(CYCLES[kind])
            if kind == "write":
                self.write(*what)
            elif kind == "read":
                self.slots[what[1]] = self.read(what[0])
            else:
                self.dptrs[self.registers[0xA2] & 1] = what[0]

    def read(self, address):
        if self.chip == "at89s52" and address in (0x84, 0x85):
            return self.dptrs[1] >> 8 * (address - 0x84) & 0xFF
        if address in (0xA6, 0xE6):
            return 0xFF
        return self.registers.get(address, 0xFF)

    def write(self, address, value):
        before, self.before = self.before, None
        if address == 0xA2:
            self.before = before
            self.registers[0xA2] = value & (0x01 if self.chip == "at89s52" else 0x09)
        elif self.chip == "at89s52":
            if address in (0x84, 0x85):
                self.before = before
                low, high = self.dptrs[1] & 0xFF, self.dptrs[1] >> 8
                self.dptrs[1] = high << 8 | value if address == 0x84 else value << 8 | low
            elif address == 0xA6:
                if before == 0x1E and value == 0xE1:
                    self.counter = 0
                self.before = value
            elif address == 0x8E:
                self.before = before
                self.registers[0x8E] = value & 0x19
        else:
            self.write_stc(before, address, value)

    def write_stc(self, before, address, value):
        registers = self.registers
        if address == 0xE6:
            self.before = value
            if before == 0x46 and value == 0xB9 and registers[0xE7] & 0x80:
                self.command()
            return
        self.before = before
        if address == 0xE1:
            registers[0xE1] = value & 0xAF
            self.flag = value >> 7
            if value & 0x20:
                if self.counter is None or value & 0x10:
                    self.counter = 0
            else:
                self.counter = None
        elif address in registers:
            mask = {0x8E: 0x03, 0xE5: 0x07, 0xE7: 0xE7}.get(address, 0xFF)
            registers[address] = value & mask
            self.soft = bool(registers[0xE7] & 0x20)

    def command(self):
        registers = self.registers
        place = (registers[0xE3] << 8 | registers[0xE4]) - 0x2000
        command = registers[0xE5]
        if not 0 <= place < 5120 or command not in (1, 2, 3):
            return
        if command == 1:
            registers[0xE2] = self.flash[place]
        elif command == 2:
            self.flash[place] &= registers[0xE2]
        else:
            sector = place // 512
            self.flash[512 * sector : 512 * sector + 512] = [0xFF] * 512
        self.stands = WAITS[registers[0xE7] & 3][command - 1]
