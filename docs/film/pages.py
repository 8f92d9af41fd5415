"""The pictures of pages: `python -m docs.film.pages` writes `docs/two-runs.png` and `docs/capture.png`.

Two laws on one page, and a capture of which some frames are missing, damaged or sent twice. Needs chromium,
chromedriver and selenium.
"""

from __future__ import annotations

import sys
import tempfile
from io import BytesIO
from pathlib import Path

from msgspec.structs import replace
from PIL import Image

from miro_protocol import stream
from miro_protocol.transmission import DOWN, Transmission
from tests.mirotwin.program import mirotwin
from tests.mirotwin.report.page.browser import chromium, open_page

DOCS = Path(__file__).parents[1]
SIZE = (1240, 780)
COLOURS = 96
"""Of a picture: enough for text and lines, a third of the bytes."""
LAW = "network.robot.controller.law=kanayama"
SILENT_TICKS = range(28_800_000, 36_000_000)


SHOW = "run.show(arguments[0]); document.getElementById(arguments[1]).scrollIntoView({ behavior: 'instant' })"


def two_runs(folder: Path) -> Path:
    """The page of fig7 under two laws."""
    for name, more in (("yang-kim", ()), ("kanayama", ("--set", LAW))):
        mirotwin("run", "fig7", *more, "--out", folder / name, "--no-figure", "-q")
    mirotwin("report", folder / "yang-kim", folder / "kanayama", "-o", folder / "two.html", "-q")
    return folder / "two.html"


def replayed_capture(folder: Path) -> Path:
    """The page of what a robot does with a capture: it is one of fig6, with 0.3 s cut out, and two frames spoiled."""
    mirotwin("run", "fig6", "--set", "duration_s=2", "--out", folder / "fig6", "--no-figure", "-q")
    mirotwin("export", folder / "fig6" / "run.mcap", "--out", folder / "sent.stream", "-q")
    sent = [one for one in stream.read(folder / "sent.stream").transmissions() if _is_sent(one)]
    sent[12] = replace(sent[12], data=sent[11].data)
    sent[20] = replace(
        sent[20], data=sent[20].data[:9] + bytes([sent[20].data[9] ^ 0x55]) + sent[20].data[10:]
    )
    stream.write(folder / "capture.stream", sent)
    mirotwin("export", folder / "capture.stream", "--out", folder / "capture.pcapng", "-q")
    mirotwin("replay", folder / "capture.pcapng", "--out", folder / "replayed", "-q")
    mirotwin("report", folder / "replayed", "-o", folder / "capture.html", "-q")
    return folder / "capture.html"


def _is_sent(one: Transmission) -> bool:
    return one.direction == DOWN and one.tick not in SILENT_TICKS


def draw(target_folder: Path) -> int:
    """Writes both pictures into this folder."""
    with tempfile.TemporaryDirectory() as name, chromium() as driver:
        shots = (
            ("two-runs", two_runs(Path(name)), 22, "errors"),
            ("capture", replayed_capture(Path(name)), 45, "link"),
        )
        for target, page, period, section in shots:
            open_page(driver, page, "light", *SIZE)
            driver.execute_script(SHOW, period, section)
            driver.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
            picture = Image.open(BytesIO(driver.get_screenshot_as_png())).convert("RGB").quantize(COLOURS)
            picture.save(target_folder / f"{target}.png", optimize=True)
            print(f"{target}.png: {(target_folder / f'{target}.png').stat().st_size // 1024} kB")
    return 0


if __name__ == "__main__":
    sys.exit(draw(DOCS))
