"""A session as many tools write it, after their public documentation."""

import io
import struct
import zipfile
from typing import NamedTuple

from miro_protocol import pcapng
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import Transmission

SECOND = 24_000_000
SPACING = 24_960  # ticks from one start bit to the next
BIT = 2500
UNIX_S = 1_732_800_000
FRAMES = [encode(TeamFrame(3, seq, ((40 * seq, -seq), (0, 1), (seq, 0))), 3) for seq in range(20)]
SESSION = [Transmission(96_000 + index * 800_800, ">", data) for index, data in enumerate(FRAMES)]


class Form(NamedTuple):
    """`detected`: as what it is to be recognised. `step_s`: of its times, None where it has none. `both`: it can tell
    directions.
    """

    write: object
    detected: str
    step_s: float | None
    both: bool = False


def characters(sent):
    """(seconds, byte, transmission) of each character."""
    for one in sent:
        for index, byte in enumerate(one.data):
            yield (one.tick + index * SPACING) / SECOND, byte, one


def lines(texts):
    return "".join(f"{text}\n" for text in texts).encode()


def stamped(form):
    """A line a transmission: `form` with its time (`t`, `unix`), `data`, direction (`d`) or `way`."""

    def write(sent):
        ways = {">": "TX", "<": "RX"}
        return lines(
            form.format(
                t=one.tick / SECOND,
                unix=one.tick / SECOND + UNIX_S,
                data=one.data.hex(" "),
                d=one.direction,
                way=ways[one.direction],
            )
            for one in sent
        )

    return write


def pcap(link, payload, magic=0xA1B2C3D4):
    def write(sent):
        parts = [struct.pack("<IHHiIII", magic, 2, 4, 0, 0, 65535, link)]
        for one in sent:
            micros = one.tick * 10**6 // SECOND + UNIX_S * 10**6
            data = payload(one)
            parts.append(struct.pack("<IIII", micros // 10**6, micros % 10**6, len(data), len(data)) + data)
        return b"".join(parts)

    return write


def rtac(one):
    return pcapng.RTAC.pack(0, 0, pcapng.EVENTS[one.direction], 0, 0) + one.data


def blocks(interfaces, packets):
    """A pcapng file: (link type, exponent of its time unit), and (interface, seconds as a fraction of units, data)."""
    found = [pcapng._block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))]
    for link, exponent in interfaces:
        options = pcapng._option(9, bytes([exponent])) + pcapng._option(0, b"")
        found.append(pcapng._block(1, struct.pack("<HHI", link, 0, 0) + options))
    for number, time, data in packets:
        head = struct.pack("<IIIII", number, time >> 32, time & 0xFFFFFFFF, len(data), len(data))
        found.append(pcapng._block(6, head + data + bytes(-len(data) % 4)))
    return b"".join(found)


def byte_each(sent):
    packets = [(0, round(t * 10**6), rtac(one)[:12] + bytes([byte])) for t, byte, one in characters(sent)]
    return blocks([(250, 6)], packets)


def epoch(sent):
    return blocks([(250, 9)], [(0, (one.tick * 125 // 3) + UNIX_S * 10**9, rtac(one)) for one in sent])


def with_foreign(sent):
    return blocks(
        [(1, 6), (250, 9)], [(0, 5, bytes(60)), *((1, one.tick * 125 // 3, rtac(one)) for one in sent)]
    )


def dump(row):
    def write(sent):
        data = b"".join(one.data for one in sent)
        rows = [row(offset, data[offset : offset + 16]) for offset in range(0, len(data), 16)]
        return lines(rows)

    return write


def shown(data):
    return "".join(chr(byte) if 32 <= byte < 127 else "." for byte in data)


def hexdump(offset, data):
    first, second = data[:8].hex(" "), data[8:].hex(" ")
    return f"{offset:08x}  {first:23}  {second:23}  |{shown(data)}|"


def xxd(offset, data):
    return f"{offset:08x}: {data.hex(' ', -2):39}  {shown(data)}"


def od(offset, data):
    return f"{offset:06x} {data.hex(' '):47}  >{shown(data)}<"


def saleae1(sent):
    rows = (f"{t:.9f},0x{byte:02X},," for t, byte, _ in characters(sent))
    return lines(["Time [s],Value,Parity Error,Framing Error", *rows])


def saleae2(sent):
    rows = (f'"Async Serial","data",{t:.9f},0.000989583,0x{byte:02X},' for t, byte, _ in characters(sent))
    return lines(["name,type,start_time,duration,data,error", *rows])


def edges(sent, bit=BIT, spacing=SPACING):
    """(tick, level) of a line on which these are sent, from tick 0."""
    found = [(0, 1)]
    for one in sent:
        for index, byte in enumerate(one.data):
            start = one.tick + index * spacing
            for place, level in enumerate([0, *(byte >> bit_number & 1 for bit_number in range(8)), 1]):
                if level != found[-1][1]:
                    found.append((start + place * bit, level))
    return found


def digital(sent):
    return lines(["Time [s],Channel 0", *(f"{tick / SECOND:.9f},{level}" for tick, level in edges(sent))])


def samples(sent, rate=250_000):
    """The level at each sample of a line."""
    found, changes = bytearray(), edges(sent)
    end = changes[-1][0] + SECOND // 100
    for (tick, level), (after, _) in zip(changes, [*changes[1:], (end, 1)], strict=True):
        found += bytes([level]) * (after * rate // SECOND - tick * rate // SECOND)
    return bytes(found)


def session(sent, rate=250_000):
    made = io.BytesIO()
    data = samples(sent, rate)
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("version", "2")
        head = "[global]\nsigrok version=0.5.2\n\n[device 1]\ncapturefile=logic-1\ntotal probes=1\n"
        file.writestr("metadata", f"{head}samplerate={rate // 1000} kHz\nprobe1=TX\nunitsize=1\n")
        file.writestr("logic-1-1", data[:100_001])
        file.writestr("logic-1-2", data[100_001:])
    return made.getvalue()


def sigrok_csv(sent, rate=250_000):
    head = [
        "; CSV, generated by libsigrok 0.5.2",
        "; Channels (2/2): TX, RX",
        f"; Samplerate: {rate // 1000} kHz",
    ]
    return lines([*head, "TX,RX", *(f"{level},1" for level in samples(sent, rate))])


def vcd(sent):
    rows = [f"#{tick * 125 // 3}\n{level}!" for tick, level in edges(sent)]
    head = [
        "$date today $end",
        "$timescale 1 ns $end",
        "$scope module logic $end",
        "$var wire 1 ! TX $end",
        '$var wire 8 " BUS $end',
        "$upscope $end",
        "$enddefinitions $end",
    ]
    return lines([*head, *rows, f"#{(edges(sent)[-1][0] + SECOND) * 125 // 3}"])


def annotations(sent):
    return lines(f"uart-1: {byte:02X}" for _, byte, _ in characters(sent))


def block(head, row, end=""):
    """Lines of 16 characters under a head with time and direction."""

    def write(sent):
        texts = []
        for one in sent:
            second, micros = divmod(one.tick // 24, 10**6)
            clock = f"{12 + second // 3600:02}:{second // 60 % 60:02}:{second % 60:02}.{micros:06}"
            texts.append(head(clock, one))
            texts += [row(one.data[place : place + 16]) for place in range(0, len(one.data), 16)]
            texts += [end] if end else []
        return lines(texts)

    return write


socat = block(
    lambda clock, one: (
        f"{one.direction} 2024/11/28 {clock}  length={len(one.data)} from=0 to={len(one.data) - 1}"
    ),
    lambda data: f" {data.hex(' '):48} {shown(data)}",
    "--",
)
jpnevulator = block(
    lambda clock, one: f"2024-11-28 {clock}: {'SENDING' if one.direction == '>' else 'RECEIVING'}",
    lambda data: f"{data.hex(' ').upper():47} {shown(data)}",
)


def sscom(sent):
    texts = []
    for one in sent:
        ms = one.tick // 24_000
        clock = f"23:59:{58 + ms // 1000:02}" if ms < 2000 else f"00:00:{ms // 1000 - 2:02}"
        way = "发→◇" if one.direction == ">" else "收←◆"
        texts.append(f"[{clock}.{ms % 1000:03}]{way}{one.data.hex(' ').upper()} ")
    return "\r\n".join(texts).encode("gb18030")


def candump(sent):
    """Eight characters a frame, each with the time of its first."""
    texts = []
    for one in sent:
        for place in range(0, len(one.data), 8):
            time_s = (one.tick + place * SPACING) / SECOND + UNIX_S
            texts.append(f"({time_s:.6f}) can0 123#{one.data[place : place + 8].hex().upper()}")
    return lines(texts)


def logic2(version):
    """One channel; version 1 in two parts."""

    def write(sent):
        changes = edges(sent)
        half = len(changes) // 2
        parts = [changes[:half], changes[half - 1 :]] if version and half > 1 else [changes]
        made = struct.pack("<8sii", b"<SALEAE>", version, 0)
        made += struct.pack("<Q", len(parts)) if version else b""
        for part in parts:
            rate = (1e6,) if version else ()
            head = [part[0][1], *rate, part[0][0] / SECOND, part[-1][0] / SECOND, len(part) - 1]
            made += struct.pack("<IdddQ" if version else "<IddQ", *head)
            made += b"".join(struct.pack("<d", tick / SECOND) for tick, _ in part[1:])
        return made

    return write


MICROSECOND, SAMPLE = 1e-6, 4e-6
FORMS = {
    "byte_each_us.pcapng": Form(byte_each, "pcapng", MICROSECOND, True),
    "epoch.pcapng": Form(epoch, "pcapng", 1e-7, True),
    "eth_packets.pcapng": Form(with_foreign, "pcapng", 1e-7, True),
    "rtac.pcap": Form(pcap(250, rtac), "pcap", MICROSECOND, True),
    "user0.pcap": Form(pcap(147, lambda one: one.data), "pcap", MICROSECOND),
    "candump.log": Form(stamped("({unix:.6f}) ttyUSB0 {way} {data}"), "stamped", MICROSECOND, True),
    "stamped.txt": Form(stamped("{t:.6f} {d} {data}"), "stamped", MICROSECOND, True),
    "stamped2.txt": Form(stamped("{t:.6f}: {data}"), "stamped", MICROSECOND),
    "hexdumpC.txt": Form(dump(hexdump), "hexdump", None),
    "xxd.txt": Form(dump(xxd), "xxd", None),
    "od.txt": Form(dump(od), "od", None),
    "sigrok_ann.txt": Form(annotations, "annotations", None),
    "saleae1.csv": Form(saleae1, "saleae", 1e-8),
    "saleae2.csv": Form(saleae2, "saleae", 1e-8),
    "saleae_digital.csv": Form(digital, "edges", 1e-8),
    "line.sr": Form(session, "sigrok", SAMPLE),
    "line.vcd": Form(vcd, "vcd", 1e-7),
    "socat.log": Form(socat, "stamped", MICROSECOND, True),
    "jpnevulator.log": Form(jpnevulator, "stamped", MICROSECOND, True),
    "sscom.txt": Form(sscom, "stamped", 1e-3, True),
    "candump-L.log": Form(candump, "stamped", MICROSECOND),
    "digital_0.bin": Form(logic2(0), "logic2", 1e-7),
    "digital_1.bin": Form(logic2(1), "logic2", 1e-7),
    "sigrok.csv": Form(sigrok_csv, "samples", SAMPLE),
}  # fmt: skip
