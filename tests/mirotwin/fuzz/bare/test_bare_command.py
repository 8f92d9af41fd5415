"""`mirotwin fuzz --bare`, and cases of a bare processor on the command line."""

import shlex

import pytest

from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.firmwares import FAULTY, POLLS, SLEEPS
from tests.mirotwin.verify.own_checks import source_of
from tests.robot.mcs51.asm import assemble

CHECK = source_of("NeverQ", "never_q", "b'q' in self.received_bytes", "'it heard a q'")


MENDED = SLEEPS.replace("LJMP 4000h", "RETI").replace("stuck:\nSJMP stuck", "RETI")
FIRMWARES = {"sleeps": SLEEPS, "polls": POLLS, "mended": MENDED, "faulty": FAULTY}


@pytest.fixture
def hexes(tmp_path):
    """The firmwares as files."""
    return {name: str(hex_file(tmp_path / f"{name}.ihx", assemble(text))) for name, text in FIRMWARES.items()}


@pytest.fixture
def check(tmp_path):
    path = tmp_path / "mycheck.py"
    path.write_text(CHECK)
    return f"{path}:NeverQ"


def corpus(tmp_path, *inputs):
    folder = tmp_path / "corpus"
    folder.mkdir()
    for number, data in enumerate(inputs):
        (folder / str(number)).write_bytes(data)
    return str(folder)


def campaign(mirotwin, tmp_path, firmware, *options):
    common = ("--bare", "--time", "0.4s", "--minimise", "1s", "--out", str(tmp_path / "out"))
    return mirotwin("fuzz", firmware, *common, *options)


def test_finds_are_confirmed_from_power_on_and_left_as_cases_that_replay(mirotwin, engines, hexes, tmp_path):
    inputs = corpus(tmp_path, b"hello!", b"what?")
    code, out, err = campaign(mirotwin, tmp_path, hexes["sleeps"], "--input", "bytes", "--corpus", inputs)
    assert code == 1
    assert "not confirmed" not in out + err
    cases = sorted((tmp_path / "out" / "crashes").glob("*.stream"))
    assert {path.name.partition("-")[0] for path in cases} == {"never_sleeps", "no_fault"}
    assert {path.read_text().partition(" > ")[2].strip() for path in cases} >= {"21", "3f"}
    for path in cases:
        failed = 3 if path.name.startswith("no_fault") else 1
        again, _, err = mirotwin("replay", str(path), "--firmware", hexes["sleeps"])
        assert (again, err.startswith("mirotwin: fails as recorded: ")) == (failed, True)
        again, out, _ = mirotwin("replay", str(path), "--firmware", hexes["mended"])
        assert (again, out.startswith("cured: ")) == (0, True)
    folder = str(tmp_path / "out" / "crashes")
    code, out, _ = mirotwin("test", folder, "--firmware", hexes["sleeps"])
    assert (code, out.count("FAULT"), out.count("FAILED")) == (3, len(cases) - 1, 1)
    code, out, _ = mirotwin("test", folder, "--firmware", hexes["mended"])
    assert (code, out.splitlines()[-1]) == (0, f"{len(cases)} passed")


def test_a_port_of_9_bits_is_reported_as_the_inputs_are_none_of_its_characters(mirotwin, engines, tmp_path):
    for name, control, reported in (("eight", "50h", False), ("nine", "0D0h", True)):
        text = POLLS.replace("MOV SCON,#50h", f"MOV SCON,#{control}")
        assert control in text
        image = hex_file(tmp_path / f"{name}.ihx", assemble(text))
        _, _, err = campaign(mirotwin, tmp_path, image, "--input", "bytes", "--out", str(tmp_path / name))
        assert (f"{image}: takes characters of 9 bits; inputs are characters of 8" in err) == reported


@pytest.mark.slow
def test_a_check_looks_at_what_is_new_or_at_everything(mirotwin, engines, hexes, check, tmp_path):
    inputs = corpus(tmp_path, b"quiet")
    for number, more in enumerate(((), ("--expect-all",))):
        out_folder = tmp_path / f"out{number}"
        options = ("--input", "bytes", "--corpus", inputs, "--expect", check, "--out", str(out_folder), *more)
        code, out, err = campaign(mirotwin, tmp_path, hexes["polls"], *options)
        assert code == 1
        assert "it heard a q" in err
        case = next((out_folder / "crashes").glob("never_q-*.stream"))
        again = next(line for line in out.splitlines() if line.startswith(f"    mirotwin replay {case}"))
        assert again.endswith(f" --expect {check}")
        _, out, err = mirotwin(*shlex.split(again)[1:])
        assert err.startswith("mirotwin: fails as recorded: never_q")
        debug = f"mirotwin debug {case} --firmware {hexes['polls']} --expect {check}"
        assert out.splitlines() == [debug]
    code, out, _ = mirotwin("test", case, "--firmware", hexes["polls"], "--expect", check)
    assert (code, "FAILED" in out) == (1, True)


def test_a_check_that_raises_ends_the_campaign_with_its_place(mirotwin, engines, hexes, check, tmp_path):
    (tmp_path / "mycheck.py").write_text(CHECK.replace("'it heard a q'", "self.nothing"))
    inputs = corpus(tmp_path, b"quiet")
    for more in ((), ("--expect-all",)):
        options = ("--input", "bytes", "--corpus", inputs, "--expect", check, "--force", *more)
        code, _, err = campaign(mirotwin, tmp_path, hexes["polls"], *options)
        assert code == 2
        said = "check 'never_q' cannot judge: AttributeError: 'OwnMonitor' object has no attribute 'nothing'"
        assert f"{said} ({tmp_path}/mycheck.py:18 in OwnMonitor.end)" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--bare",), "--bare needs an IMAGE.ihx."),
        (("sleeps", "--protocol", "miro"), "--protocol needs --bare, or a BOARD."),
        (("sleeps", "--crystal", "12000000"), "--crystal needs --bare."),
        (("sleeps", "--bare", "--slot", "1"), "--slot does not go with --bare."),
        (("sleeps", "--bare", "--expect-all"), "--expect-all needs --expect."),
        (("sleeps", "--bare", "--protocol", "mire"), "did you mean miro?"),
        (("sleeps", "--bare", "--expect", "nothing"), "--expect nothing=true: there is no such check"),
        (("sleeps", "--bare", "--baud", "100000000"), "--baud: 100000000 is outside 50..750000"),
        (("faulty", "--bare"), "comes up with a fault"),
    ],
)
def test_what_does_not_go_together_is_refused(mirotwin, engines, hexes, tmp_path, arguments, said):
    given = [hexes.get(one, one) for one in arguments]
    assert said in mirotwin.ends(2, "fuzz", *given, "--time", "1s", "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_a_case_of_a_bare_processor_is_not_played_on_the_robot(mirotwin, engines, hexes, tmp_path):
    inputs = corpus(tmp_path, b"!")
    campaign(mirotwin, tmp_path, hexes["sleeps"], "--input", "bytes", "--corpus", inputs)
    case = str(next((tmp_path / "out" / "crashes").glob("no_fault-*.stream")))
    needs = "is for a bare processor, which has no firmware of its own; give --firmware"
    firmware = ("--firmware", hexes["sleeps"])
    for arguments, said in (
        (("replay", case), needs),
        (("replay", case, *firmware, "--seed", "1"), "--seed: is not for a case of a bare"),
        (("replay", case, *firmware, "--set", "duration_s=1"), "is not for a case of a bare"),
        (
            ("replay", case, *firmware, "--port", "/dev/null"),
            "--port: is for robots, and this is for a board",
        ),
    ):
        code, _, err = mirotwin(*arguments)
        assert (code, said in err) == (2, True), err


def test_a_case_of_a_bare_processor_is_looked_into_as_a_robots(mirotwin, engines, hexes, tmp_path):
    inputs = corpus(tmp_path, b"!")
    campaign(mirotwin, tmp_path, hexes["sleeps"], "--input", "bytes", "--corpus", inputs)
    case = next((tmp_path / "out" / "crashes").glob("no_fault-*.stream"))
    code, out, err = mirotwin("fw", "trace", case, "--firmware", hexes["sleeps"])
    assert (code, "LJMP 4000h" in out.replace("  ", " ")) == (3, True)
    assert err.startswith(
        "mirotwin: firmware fault: firmware executed outside the loaded image at 0x4000, tick "
    )
    case.write_text(case.read_text().replace("no_fault = true", "no_fault = true\n#: never_q = true"))
    err = mirotwin.refuses("fw", "trace", case, "--firmware", hexes["sleeps"])
    assert "expect.never_q: there is no such check; " in err
    (tmp_path / "mycheck.py").write_text(CHECK)
    more = ("--expect", f"{tmp_path}/mycheck.py:NeverQ")
    assert mirotwin("fw", "trace", case, "--firmware", hexes["sleeps"], *more)[:2] == (code, out)
    err = mirotwin.refuses("fw", "trace", "fig6", "--expect", "no_fault")
    assert "fig6: is a scenario, of which nothing is judged here, --expect does not apply to it" in err
