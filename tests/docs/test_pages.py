"""What holds for every page: it leads to what can be read where it lies."""

import re

import pytest

from tests.docs import sandbox

REFERENCE = sandbox.ROOT / "docs/reference"
TARGET = re.compile(r"\]\(([^()\s#:]+)")


@pytest.mark.parametrize("document", sandbox.documents())
def test_no_page_leads_to_a_reference_that_only_the_site_can_show(document):
    """The pages of `docs/reference` are marks, which the site replaces by docstrings."""
    page = sandbox.ROOT / document
    if page.parent == REFERENCE:
        return
    text = page.read_text("utf-8")
    targets = [(page.parent / target).resolve() for target in TARGET.findall(text)]
    assert [target for target in targets if REFERENCE in target.parents] == []
