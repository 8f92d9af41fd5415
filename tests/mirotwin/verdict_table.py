"""What goes wrong in one way, through every command that takes it: `python -m tests.mirotwin.verdict_table`.

A kind is one thing that fails; a row is what a command makes of it. All rows of a kind have to give the same verdict,
and the words of the failure itself: check, place, tick, what was wanted, what was found.
"""

import contextlib
import html
import re
import tempfile
from itertools import chain
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import pyarrow.parquet

from mirotwin.shell.verdicts import VERDICTS
from mirotwin.verify.checks.interface import at
from tests.mirotwin.program import mirotwin
from tests.mirotwin.testing.sessions import session
from tests.mirotwin.verify.checks.rig import planted
from tests.mutants.build import compiler
from tests.vectors.paths import CASES

PORT = "miro://fig6?set=network.radio.bit_error_rate=0"
SCENARIO = """
scenario = "silent"
duration_s = 0.5
[[step]]
send = "ping"
"""
FEW = f"{SCENARIO}[expect]\nframes_accepted_min = 5\n"
"""One frame is sent."""
POLL = f"""{SCENARIO}[[step]]
send = "poll"
[[step]]
wait_for = "answer"
within_ms = 80
accepted = 9
"""
IN_PYTHON = """
@pytest.mark.mirotwin(expect={"frames_accepted_min": 5}, boot=False)
def test_few(link, world):
    link.ping()
    world.run_for(ms(500))
"""
CAMPAIGN = 'scenario = "few.scenario.toml"\nseeds = "0"\n'
FAILED = r"frames_accepted_min: net0/robot0: tick .*"
KINDS = {
    "check": FAILED,
    "fault": r"firmware executed outside .*",
    "bare processor": r"no_fault: tick .*",
    "port": r"step 3: wait_for answer: tick .*, found",
    "row of a campaign": FAILED,
    "pytest": FAILED,
    "rule": r"wanted silence: no question to this robot",
}
"""What the words of each kind of failure are. At a port they hold what no two runs have alike: the rest is left out."""


class Row(NamedTuple):
    """`verdict`: of the exit code, of the page's badge, or of JUnit; "" for none; `words`: of the failure."""

    kind: str
    command: str
    verdict: str
    words: str

    def __str__(self):
        return f"{self.kind:18}{self.verdict:9}{self.command:.60}\n{'':27}{self.words}"


def table():
    """Rows, in a folder that is the current one."""
    Path("few.scenario.toml").write_text(FEW)
    Path("poll.scenario.toml").write_text(POLL)
    Path("few.toml").write_text(CAMPAIGN)
    jumps = ("--firmware", CASES / "jumps-out.ihx")
    yield from of_scenario("check")
    yield from of_scenario("fault", *jumps)
    yield from of_case("bare processor", CASES / "bare-with-end.stream", *jumps, page=False)
    yield said("port", "test", "poll.scenario.toml", "--port", PORT)
    yield in_pytest("port", "poll.scenario.toml", f"--mirotwin-port={PORT}")
    yield said("row of a campaign", "campaign", "run", "few.toml", "--out", "few.parquet", "-q", "--jobs", 1)
    (row,) = pyarrow.parquet.read_table("few.parquet").to_pylist()
    yield Row("row of a campaign", "row of few.parquet", row["verdict"], failure_in("check", row["failure"]))
    yield said("row of a campaign", "test", "few.scenario.toml", "--seed", row["seed"])
    yield in_pytest("pytest", "test_mine.py", "--mirotwin-artifacts=py", tests=IN_PYTHON)
    (case,) = Path("py").glob("*/case.stream")
    yield from of_case("pytest", case)


def rule():
    """Those of a rule of the protocol, which is broken by firmware that answers frames that ask nobody."""
    image = planted("answers frames that ask nobody").path
    yield said("rule", "conform", image, "--rule", "P43", "--json", "--artifacts", "rules")
    yield said("rule", "conform", "--port", f"{PORT}&firmware={image}", "--rule", "P43", "--json")
    yield from of_case("rule", "rules/P43.stream", "--firmware", image)


def of_scenario(kind, *options):
    yield said(kind, "test", "few.scenario.toml", "--artifacts", "left", *options)
    yield said(kind, "run", "few.scenario.toml", "--out", "run", "--force", "-q", "--no-figure", *options)
    yield said(kind, "replay", "run", "-q")
    yield on_page(kind, "run")
    yield in_pytest(
        kind,
        "few.scenario.toml",
        *(f"--mirotwin{word[1:]}" if word == "--firmware" else word for word in options),
    )
    yield from of_case(kind, "left/few/case.stream", *options)


def of_case(kind, case, *options, page=True):
    yield said(kind, "test", case, *options)
    yield said(kind, "replay", case, "-q", *options)
    yield said(kind, "debug", case, *options, input="quit\n")
    if page:
        yield on_page(kind, case)


def said(kind, command, *words, **more):
    code, out, err = mirotwin(command, *words, **more)
    verdict = next(name for name, told in VERDICTS.items() if told.code == code)
    what = " ".join([command, *(Path(f"{word}").name if "://" not in f"{word}" else "URL" for word in words)])
    return Row(kind, what, "" if command == "debug" else verdict, failure_in(kind, out + err))


def failure_in(kind, text):
    found = re.search(KINDS[kind], text)
    assert found, f"{kind}: nothing like {KINDS[kind]!r} in:\n{text}"
    return found[0]


FAILURE_ON_PAGE = r'data-tick="(\d+)">[^<]*</button> <span><strong>([^<]+)</strong> ([^:]+): ([^<]+)<'


def on_page(kind, subject):
    """The badge of its page, and its failures as a line has them."""
    code, out, err = mirotwin("report", subject, "--out", "page.html", "--force")
    assert code == 0, out + err
    text = Path("page.html").read_text()
    badge = re.search(r'<p class="badge [\w-]+"><strong>([\w ]+)', text)
    failures = [
        html.unescape(f"{name}: {place}: {at(int(tick))}: {what}")
        for tick, name, place, what in re.findall(FAILURE_ON_PAGE, text)
    ]
    return Row(kind, f"report {Path(subject).name}", badge[1], failure_in(kind, "\n".join(failures)))


def in_pytest(kind, *words, **more):
    """The kind of failure that JUnit knows: pytest has one exit code for all."""
    done = session(Path.cwd(), *words, "--junitxml=junit.xml", **more)
    (case,) = ElementTree.parse("junit.xml").iter("testcase")
    tag = next((one.tag for one in case if one.tag in ("failure", "error", "skipped")), "passed")
    return Row(kind, f"pytest {words[0]}", tag, failure_in(kind, done.stdout))


def main():
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for row in chain(table(), rule() if compiler() else ()):
            print(row)


if __name__ == "__main__":
    main()
