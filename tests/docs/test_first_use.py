"""What `python -m tests.docs.first_use` counts, with a shell that is nobody's installation."""

import os

import pytest

from tests.docs import first_use, sandbox
from tests.docs.shell import Literal

PAGE = """\
Save this as `a.txt`:

<!-- file: a.txt -->
```text
one
```

```sh
grep -q one a.txt
grep -q two a.txt     # exit code 1
test -e b.txt
```

<!-- not run: why -->
```sh
false
false
```

<!-- slow: why -->
```sh
false
```
"""


@pytest.fixture
def page(tmp_path, monkeypatch):
    (tmp_path / "tree").mkdir()
    (tmp_path / "tree/page.md").write_text(PAGE)
    monkeypatch.setattr(sandbox, "ROOT", tmp_path / "tree")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return "page.md"


def test_each_line_is_run_and_the_refused_ones_are_named(page):
    count = first_use.Count()
    first_use.follow(page, Literal(os.environ), count)
    assert str(count) == "4 lines run, 2 not run, 2 refused"
    assert [what.partition("\n")[0] for what in count.refused] == [
        "page.md, line 8: test -e b.txt",
        "page.md, line 21: false",
    ]


def test_a_file_is_there_only_when_the_reader_has_come_to_it(page):
    path = sandbox.ROOT / page
    path.write_text("```sh\ncat a.txt\n```\n\n" + PAGE)
    count = first_use.Count()
    first_use.follow(page, Literal(os.environ), count)
    assert count.refused[0].startswith("page.md, line 1: cat a.txt")


def test_the_extras_that_are_installed_are_those_of_the_page_for_beginners():
    found = first_use.EXTRAS.search((sandbox.ROOT / "docs/start.md").read_text("utf-8"))
    assert found
    assert found[1] == "[report,campaign,hypothesis]"
    assert found[0] in (sandbox.ROOT / "README.md").read_text("utf-8")
