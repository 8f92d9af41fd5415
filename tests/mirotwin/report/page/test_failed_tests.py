"""Pages of failed tests: what the plugin leaves, and `mirotwin report` of a case."""

import pytest

from tests.mirotwin.program import mirotwin
from tests.mirotwin.testing.sessions import session

pytestmark = pytest.mark.slow

TESTS = """
def test_an_answer_that_does_not_come(link):
    link.radio("down")
    link.poll(slot=0)
    link.expect(Telemetry, within=ms(40))

@pytest.mark.mirotwin(expect={"wheels_within_m_s": 0.05})
def test_a_check(link):
    link.drive({0: (3000, 3000)}, ms(100))

def test_a_comparison(link, robot):
    link.drive({0: (300, 300)}, ms(50))
    assert robot.wheels.commanded == (1, 2)

def test_one_that_writes(link, robot):
    robot.write("last_left", 5)
    assert False

def test_one_that_passes(link):
    link.poll(slot=0)
"""


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    """The folders that the tests leave, by their names."""
    folder = tmp_path_factory.mktemp("session")
    done = session(folder, "-q", "--mirotwin-artifacts=left", "--mirotwin-pages", tests=TESTS)
    assert "4 failed, 1 passed" in done.stdout
    names = ("an_answer_that_does_not_come", "a_check", "a_comparison", "one_that_writes", "one_that_passes")
    return {name: next(iter((folder / "left").glob(f"test_mine.py-test_{name}-*")), None) for name in names}


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("an_answer_that_does_not_come", "<strong>happens</strong> net0/robot0: wanted answer"),
        ("a_check", "<strong>wheels_within_m_s</strong> net0/robot0: wanted"),
        ("a_comparison", "pytest test_mine.py::test_a_comparison --mirotwin-seed 0"),
    ],
)
def test_a_failed_test_leaves_the_page_of_its_run(left, name, said):
    page = (left[name] / "report.html").read_text()
    assert f"<h1>test_mine.py::test_{name}</h1>" in page
    assert "<strong>failed</strong>" in page
    assert said in page


def test_a_test_that_wrote_into_memory_leaves_none_for_nobody_can_make_its_run_again(left):
    assert (left["one_that_writes"] / "report.txt").exists()
    assert not (left["one_that_writes"] / "report.html").exists()
    assert left["one_that_passes"] is None


def test_the_digest_of_the_page_is_that_of_the_test(left):
    report = (left["a_check"] / "report.txt").read_text()
    digest = next(line.removeprefix("digest ") for line in report.splitlines() if line.startswith("digest"))
    assert f'title="{digest}"' in (left["a_check"] / "report.html").read_text()


@pytest.mark.parametrize("name", ["an_answer_that_does_not_come", "a_comparison"])
def test_the_folder_of_a_failed_test_has_a_page(left, name, tmp_path):
    page = tmp_path / "page.html"
    mirotwin.succeeds("report", left[name], "-o", page, "-q")
    text = page.read_text()
    assert '<p class="kind">failed test</p>' in text
    assert "<strong>failed</strong>" in text
    assert "last events:" in text


def test_a_case_by_itself_has_one_too_and_says_when_it_is_cured(left, tmp_path):
    case = tmp_path / "mine.stream"
    text = (left["a_check"] / "case.stream").read_text()
    case.write_text(text)
    page = tmp_path / "page.html"
    mirotwin.succeeds("report", case, "-o", page, "-q")
    assert '<p class="kind">case</p>' in page.read_text()
    assert "Recorded:" not in page.read_text()
    assert "mirotwin replay mine.stream" in page.read_text()
    lenient = text.replace("0.05", "1.0")
    assert lenient != text
    case.write_text(lenient)
    mirotwin.succeeds("report", case, "-o", page, "-q", "--force")
    assert "does not fail any more. Recorded: wheels_within_m_s" in page.read_text()
    assert "<strong>passed</strong>" in page.read_text()


def test_without_the_option_no_page_is_made_and_the_report_names_the_line_for_it(tmp_path):
    done = session(tmp_path, "-q", "--mirotwin-artifacts=left", tests=TESTS)
    assert list((tmp_path / "left").rglob("report.html")) == []
    lines = [line for line in done.stdout.splitlines() if line.startswith("page: mirotwin report left/")]
    assert len(lines) == 3  # not of the test that wrote into memory
    page = tmp_path / "page.html"
    mirotwin.succeeds("report", tmp_path / lines[0].split()[-1], "-o", page, "-q")
    assert '<p class="kind">failed test</p>' in page.read_text()
