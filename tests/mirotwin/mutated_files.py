"""Damaged files of every kind through the command line: an exit code and a line, never a traceback or a long wait.

    python -m tests.mirotwin.mutated_files --count 20000 --seed 0

prints how many files of each kind ended in which exit code. A case is a pure function of (seed, number): `--only N`
runs one again and leaves its file in the current folder. What belongs here: good files, how they are damaged, and
which command reads them. What does not: what a format means.
"""

import argparse
import contextlib
import random
import re
import signal
import struct
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from click.testing import CliRunner

from miro_robot.firmware import image_path
from miro_sim.scenario.file import builtin_text
from mirotwin.commands import main
from tests.fuzz.mutation import changed
from tests.fuzz.target import Target, with_sums
from tests.mirotwin.conftest import SHORT, hex_text

ALLOWED = (0, 1, 2, 3, 4, 42)
SLOW_S = 5.0
HANGS_S = 300  # of wall time: the machine may be busy
ECHO = bytes.fromhex("7590 00 759852 758920 758DFD D28E 3098FD C298 8599E0 F599 80F4".replace(" ", ""))
ECHO_C = "void main(void)\n{\n    init();\n    for (;;)\n        echo();\n}\n"
ECHO_MAP = """\
Area                                    Addr        Size        Decimal Bytes (Attributes)
DSEG                                00000008    00000002 =           2. bytes (REL,CON)
     00000008  _frames_accepted                   named
CSEG                                00000000    0000001A =          26. bytes (REL,CON,CODE)
C:   00000000  _main                              named
C:   0000000C  A$named$5                          named
C:   0000000E  _loop                              named
CONST                               0000001A    00000000 =           0. bytes (REL,CON,CODE)
named.rel                           [ ]
"""
ECHO_CDB = """\
S:G$main$0_0$0({2}DF,SV:S),C,0,0
S:G$total$0_0$0({1}SC:U),E,0,0
L:G$main$0$0:0
L:G$total$0$0:9
L:C$named.c$1$0$0:0
L:C$named.c$3$1$1:3
L:C$named.c$5$1$1:E
L:XG$main$0$0:17
L:A$named$5:0
"""
ECHO_RST = """\
                                    1 ;\tnamed.c:3: init();
      000000 75 90 00         [24]  2 \tmov P1,#0
      000003 75 98 52         [24]  3 \tmov SCON,#0x52
                                    4 ;\tnamed.c:5: echo();
      00000E 30 98 FD         [24]  5 \tjnb RI,.
"""
_SCENARIO = "".join(f"#: {line}\n" for line in SHORT.replace("[network", "[scenario.network").splitlines())
_FRAME = "55! 55 55 55 55 ff 2d d4 fc e0 11! 22 33"
STREAMS_2 = {
    "stream 2": f"# mirotwin stream 2\n96000 > {_FRAME}\n400000 <@1 {_FRAME}  # more\n900000 >@1 55 55!\n".encode(),
    "stream 2, header": f"# mirotwin stream 2\n#: seed = 7\n#: [scenario]\n{_SCENARIO}96000 > {_FRAME}\n".encode(),
}
SHORT_RUN = ["--set", "duration_s=0.1", "--no-figure", "-q"]
STEPS = b"""
scenario = "silent"
expect.failsafe_stop_ms = 110.0
step = [
  { pause_ms = 5 },
  { stream = "on", left_m_s = 0.1, every_ms = 33.4, frames = 9 },
  { send = "team", slot = 1, left_m_s = 0.2, wrong_bits = [3, 9], bad_stop = [3], note = "drives" },
  { wait_for = "frame", seq = 1, within_ms = 30 },
  { send = "bytes", hex = "55 55! 01" },
  { wait_for = "command", name = "STT", side = "right", within_ms = 9, from_now = true },
  { check = { moves_only_when_fresh = true, answers_within_ms = 25.0 } },
  { hold = "wheels", left_m_s = 0.1, tolerance_m_s = 0.9, for_ms = 1 },
  { radio = "down" }, { reset = 1 }, { silence_for_ms = 1.5 }, { power = "off" }, { save = "a.world" },
]
"""
EVENTS = b"5 *@0/1 reset 1\n6 *@0 radio down\n7 * P1.0 0\n#: set = {}\n#: expect = {no_fault = true}\n"
_NUMBERS = (*b"0 -1 4294967296 99999999999999999999 1e999 nan".split(), b"9" * 5000, b"0x" + b"f" * 5000)
_BRACKETS = (*b"[ { ( a. [[ \\ # : $".split(), b'"', b"'", b"\n", b"\xff", b"\x00", b"\x1b[2J")
DAMAGE = Target(
    "what a damaged file may hold",
    lambda: None,
    most_bytes=1 << 20,
    words=[*_NUMBERS, *(one * count for one in _BRACKETS for count in (1, 1, 300, 20_000))],
)
RESUMMED = "image, sums put right"


def hex_records(code):
    return hex_text(code).encode()


class Seeds:
    """Good files in `folder`. `kinds`: name -> (file name, content, commands of which one is chosen). `pieces`: more
    files to take pieces of.
    """

    def __init__(self, folder):
        self.folder = folder
        self.kinds = {}
        image = image_path()
        self.pieces = [image.with_suffix(suffix).read_bytes() for suffix in (".ihx", ".map", ".cdb", ".rst")]
        for name in ("echo.ihx", "named.ihx"):
            (folder / name).write_bytes(hex_records(ECHO))
        (folder / "named.c").write_text(ECHO_C)
        (folder / "short.toml").write_text(SHORT)
        self._run("run", "short.toml", "--out", "out", "-q")
        recording = (folder / "out" / "run.mcap").read_bytes()
        self._run("export", "out/run.mcap", "--out", "run.pcapng", "-q")
        self._run("export", "out/run.mcap", "--out", "run.stream", "-q")
        self._run("fw", "coverage", "echo.ihx", "--max-cycles", "2000", "--out", "fw.info")
        self._add_texts(image)
        look = [["decode", "@"], ["decode", "@", "--json"], ["export", "@", "--out", "-"]]
        self.kinds["recording"] = ("a.mcap", recording, [*look, ["replay", "@"], ["diff", "@", "@"]])
        self.kinds["recording without sums"] = ("a.mcap", without_sums(recording), [*look, ["replay", "@"]])
        self.kinds["capture"] = ("a.pcapng", (folder / "run.pcapng").read_bytes(), look)
        stream = (folder / "run.stream").read_bytes()
        self.kinds["stream"] = ("a.stream", stream, [*look, ["fw", "profile", "@", "--to", "1ms"]])
        for name, content in STREAMS_2.items():
            self.kinds[name] = ("a.stream", content, [*look, ["fw", "profile", "@", "--to", "1ms"]])
        self.pieces.append(EVENTS)
        self._add_pictures()
        raw = bytes.fromhex("5555555555ff2dd4fc") + bytes(range(40))
        decode = [["decode", "@"], ["decode", "@", "--from-form", "raw", "--json"]]
        self.kinds["raw"] = ("a.bin", raw * 3, decode)
        self.kinds["hex text"] = ("a.txt", raw.hex(" ").encode() + b" # end\n", [["decode", "@"]])

    def _add_pictures(self):
        """What `calibrate` and `track` read. Two pictures are enough: one is searched, in one a robot is followed."""
        brief = ["--set", "duration_s=0.04", "--no-figure", "-q", "--frames", "frames"]
        self._run("run", "short.toml", "--out", "seen", *brief, "--record-frames")
        files = ["--points-out", "points.csv", "--colours-out", "colours.toml"]
        self._run("camera", "calibrate", "--scenario", "short.toml", "--out", "camera.toml", *files)
        track = ["--calibration", "camera.toml", "--colours", "colours.toml", "--numbers", "0"]
        calibrate = [["camera", "calibrate", "--points", "@", "--out", "new.toml", "--force"]]
        reads = {
            "control points": ("points.csv", calibrate),
            "calibration": ("camera.toml", [["camera", "track", "frames", *track, "--json"]]),
            "colours": ("colours.toml", [["camera", "track", "frames", *track]]),
            "picture": ("frames/frame-000001.png", [["camera", "track", "frames", *track]]),
        }
        for kind, (name, commands) in reads.items():
            self.kinds[kind] = (name, (self.folder / name).read_bytes(), commands)
        recording = without_sums((self.folder / "seen" / "run.mcap").read_bytes())
        self.kinds["recorded pictures"] = ("b.mcap", recording, [["camera", "track", "@", *track]])

    def _add_texts(self, image):
        steps = ["--max-cycles", "300"]
        watch = [["fw", "trace", "named.ihx", *steps], ["fw", "profile", "named.ihx", *steps, "--json"]]
        profile = [["fw", "profile", "@", "--to", "100us"]]
        self.kinds["scenario"] = ("a.toml", builtin_text("fig6").encode(), profile)
        run = [["run", "@", "--out", "steps", "--force", *SHORT_RUN]]
        self.kinds["steps"] = ("a.scenario.toml", STEPS, run)
        read = [*[["fw", "run", "@", *steps]] * 5, ["fw", "disasm", "@"], ["info", "--firmware", "@"]]
        self.kinds["image"] = ("a.ihx", image.read_bytes(), read)
        self.kinds[RESUMMED] = self.kinds["image"]
        for suffix, lines in (".map", ECHO_MAP), (".cdb", ECHO_CDB), (".rst", ECHO_RST):
            (self.folder / f"named{suffix}").write_text(lines)
            cover = ["fw", "coverage", "named.ihx", *steps]
            until = ["fw", "run", "named.ihx", "--until", "_loop", *steps]
            commands = [cover, *watch, ["fw", "disasm", "named.ihx"], until]
            self.kinds[suffix] = (f"named{suffix}", lines.encode(), commands)
        append = [["fw", "coverage", "echo.ihx", "--max-cycles", "50", "--out", "@", "--append"]]
        self.kinds["tracefile"] = ("a.info", (self.folder / "fw.info").read_bytes(), append)
        listen = [["fw", "run", "echo.ihx", "--stdin", "@", "--max-cycles", "20000"]]
        self.kinds["serial input"] = ("a.serial", b"some characters\r\n\x00\xff", listen)

    def _run(self, *arguments):
        with contextlib.chdir(self.folder):
            result = CliRunner().invoke(main, list(arguments))
        assert result.exit_code in (0, 42), (arguments, result.output, result.exception)


def without_sums(recording):
    """The same with sums of 0, which say nothing: so damage gets past them."""
    data = bytearray(recording)
    place = 8
    while place + 9 <= len(data) - 8:
        opcode, size = struct.unpack_from("<BQ", data, place)
        body = place + 9
        if opcode == 0x06:  # Chunk: times, size, then its CRC
            data[body + 24 : body + 28] = bytes(4)
        elif opcode in (0x02, 0x09, 0x0F):  # Footer, Attachment, DataEnd end in theirs
            data[body + size - 4 : body + size] = bytes(4)
        place = body + size
    return bytes(data)


class Slow(BaseException):
    """A case that takes too long."""


def _slow(number, frame):
    raise Slow


class Case:
    """Case `number` of a campaign: which kind, which content, which command."""

    def __init__(self, seeds, seed, number):
        names = list(seeds.kinds)
        draw = random.Random(f"{seed}/{number}")
        self.kind = names[number % len(names)]
        self.name, content, commands = seeds.kinds[self.kind]
        self.good = content
        others = [*seeds.pieces, *(good for _, good, _ in seeds.kinds.values())]
        if draw.randrange(10) == 0 and (numbers := [*re.finditer(rb"[0-9]+", content[: 1 << 16])]):
            first, end = draw.choice(numbers).span()
            self.content = content[:first] + draw.choice(_NUMBERS) + content[end:]
        else:
            self.content = changed(content, DAMAGE, others, draw)
        if self.kind == RESUMMED:
            self.content = with_sums(self.content)
        self.arguments = [self.name if word == "@" else word for word in draw.choice(commands)]

    def run(self, folder):
        """Exit code (or what was raised) and seconds of CPU time. The good file is put back."""
        path = folder / self.name
        path.write_bytes(self.content)
        began_s = time.process_time()
        signal.signal(signal.SIGALRM, _slow)
        signal.alarm(HANGS_S)
        try:
            with contextlib.chdir(folder):
                result = CliRunner().invoke(main, self.arguments)
            signal.alarm(0)
        except Slow:
            return "hangs", time.process_time() - began_s
        took_s = time.process_time() - began_s
        path.write_bytes(self.good)
        for left in folder.glob("*.lst"):
            left.unlink()
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            return "".join(traceback.format_exception(result.exception)[-4:]), took_s
        if result.exit_code not in ALLOWED or not _fit_for_people(result.stderr):
            return f"exit code {result.exit_code}: {result.stderr[-300:]!r}", took_s
        return result.exit_code, took_s


def _fit_for_people(err):
    return all(line.isprintable() and len(line) < 2000 for line in err.splitlines())


def campaign(folder, seed, numbers):
    """(number, case, exit code or what went wrong, seconds) of each case; good files are made in `folder` first."""
    seeds = Seeds(folder)
    for number in numbers:
        case = Case(seeds, seed, number)
        outcome, took_s = case.run(folder)
        if took_s > SLOW_S and isinstance(outcome, int):
            outcome = f"took {took_s:.1f} s"
        yield number, case, outcome, took_s


def _main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int)
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.count)
    if options.only is not None:
        numbers = range(options.only, options.only + 1)
    counts = Counter()
    slowest_s, bad = 0.0, 0
    with tempfile.TemporaryDirectory() as name, contextlib.suppress(KeyboardInterrupt):  # counts so far
        for number, case, outcome, took_s in campaign(Path(name), options.seed, numbers):
            slowest_s = max(slowest_s, took_s)
            if isinstance(outcome, int):
                counts[case.kind, outcome] += 1
            else:
                bad += 1
                print(f"{number}: {case.kind}: {' '.join(case.arguments)}: {outcome}", flush=True)
            if options.only is not None:
                Path(case.name).write_bytes(case.content)
    for kind in dict.fromkeys(kind for kind, _ in sorted(counts)):
        ends = ", ".join(f"{count} x {code}" for (one, code), count in sorted(counts.items()) if one == kind)
        print(f"{kind:24} {ends}")
    print(f"{sum(counts.values())} files, {bad} of them ended badly, the slowest took {slowest_s:.1f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(_main())
