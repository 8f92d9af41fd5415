"""What the tests of pages share: recordings, and the page of one."""

import pytest

FIG6 = ("fig6", "--seed", 3, "--set", "duration_s=1.5", "--expect", "settles_within_s=0.4")


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pages")


@pytest.fixture(scope="session")
def fig6(mirotwin, folder):
    """The folder of a run of 1.5 s that does not settle in time."""
    mirotwin.ends(1, "run", *FIG6, "--out", folder / "fig6", "--no-figure", "-q")
    return folder / "fig6"


@pytest.fixture(scope="session")
def fig6_page(mirotwin, folder, fig6):
    page = folder / "fig6.html"
    mirotwin.succeeds("report", fig6, "-o", page, "-q")
    return page


@pytest.fixture(scope="session")
def two(mirotwin, folder, short):
    """The folder of a run of two robots, with the camera's frames."""
    longer = ("--set", "duration_s=0.5", "--record-frames")
    mirotwin.succeeds("run", short, *longer, "--out", folder / "two", "--no-figure", "-q")
    return folder / "two"
