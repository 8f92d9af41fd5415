"""`import mirotwin`: the public names, loaded when they are asked for."""

import sys

import pytest

import mirotwin
from tests import children


@pytest.mark.parametrize("package", [mirotwin, mirotwin.campaign, mirotwin.replay])
def test_every_public_name_is_there(package):
    assert len(package.__all__) > 1
    for name in package.__all__:
        assert getattr(package, name) is not None


def test_a_name_that_is_not_public_is_refused_with_those_that_are():
    there = ", ".join(mirotwin.__all__)
    with pytest.raises(AttributeError, match=f"'mirotwin' has no attribute 'Wrold'; it has {there}"):
        _ = mirotwin.Wrold


def test_importing_the_package_imports_nothing_else_of_ours_but_the_tables_of_checks():
    script = (
        "import sys, mirotwin; print(sorted(n for n in sys.modules if n.split('.')[0].startswith('miro')))"
    )
    done = children.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    tables = ["mirotwin.conform", "mirotwin.verify", "mirotwin.verify.checks"]
    assert done.stdout == f"{['mirotwin', *tables]}\n"


def test_the_example_in_its_documentation_runs():
    lines = [line.strip() for line in mirotwin.__doc__.splitlines() if line.startswith("    ")]
    names = {}
    exec("\n".join(lines), names)
    assert names["answer"].what == "answer"
