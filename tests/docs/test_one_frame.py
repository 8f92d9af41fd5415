"""The page that follows one frame says what the run says."""

from pathlib import Path

from benchmarks import one_frame, one_frame_page

PAGE = Path(__file__).parents[2] / "docs" / "one-frame.md"


def test_the_page_is_what_the_command_writes() -> None:
    assert PAGE.read_text("utf-8") == one_frame_page.page(one_frame.Way())
