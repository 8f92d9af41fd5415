"""Mistakes planted in the firmware of the example boards: a campaign finds each, and its case tells it from the mended
firmware.
"""

import pytest

from miro_sim.scenario.board_scenario import firmware_beside, load_any
from tests.mirotwin.fuzz.boards.planted import ALL, BOARDS, FOLDER, built
from tests.mutants.sdcc import needs_sdcc

NAMES = [planted.name for planted in ALL]
own_check = {planted.name: [f for f in planted.options if "checks.py" in f] for planted in ALL}


@pytest.mark.parametrize("planted", ALL, ids=NAMES)
def test_the_case_that_was_found_fails_on_that_firmware_and_on_no_other(mirotwin, planted):
    case = FOLDER / f"{planted.name}.stream"
    right = firmware_beside(load_any(str(BOARDS / planted.scenario)))
    checks = [f"--expect={check}" for check in own_check[planted.name]]
    code, _, err = mirotwin("replay", str(case), "--firmware", str(planted.image), *checks)
    assert code == (3 if planted.check == "no_fault" else 1)
    assert err.startswith(f"mirotwin: fails as recorded: {planted.check}: tick ")
    code, out, _ = mirotwin("replay", str(case), "--firmware", right, *checks)
    assert (code, out.startswith("cured: ")) == (0, True)


@pytest.mark.slow
@pytest.mark.parametrize("planted", ALL, ids=NAMES)
def test_a_campaign_finds_it_and_ends(mirotwin, engines, planted, tmp_path):
    options = ("--time", "10min", "--until-crash", "--minimise", "1s", "--seed", "1")
    code, out, err = mirotwin("fuzz", *planted.looks_for(), *options, "--out", str(tmp_path / "out"))
    assert code == 1, out + err
    assert f"found: {planted.check}-" in err
    assert len(list((tmp_path / "out" / "crashes").glob(f"{planted.check}-*.stream"))) == 1


@needs_sdcc
@pytest.mark.parametrize("planted", ALL, ids=NAMES)
def test_the_images_are_what_sdcc_makes_of_the_changed_sources(planted, tmp_path):
    assert built(planted, tmp_path).splitlines() == planted.image.read_bytes().splitlines()
