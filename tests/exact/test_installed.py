"""The sources of plug-ins: what of a distribution belongs to a run, however it is installed."""

import shutil
import sys
from importlib.machinery import EXTENSION_SUFFIXES

import pytest

from miro_exact.installed import described, differences, entries_of
from tests.exact.distribution import install

PARTS = {"steady": "plug_steady:Parameters"}


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("plug_")]:
        del sys.modules[name]


def sources(name="steady"):
    """The hash alone; the sources are read again each time."""
    return described("law", name).rpartition(" ")[2]


def info(folder, **files):
    """Files of the folder with the metadata of the one distribution there."""
    (place,) = folder.glob("*.dist-info")
    for name, text in files.items():
        (place / name.replace("_txt", ".txt")).write_text(text)


def changes(path, content="changed = True\n"):
    """Whether another content of this file makes other sources; the file is as before then."""
    before, there = sources(), path.read_bytes() if path.exists() else None
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)
    changed = sources() != before
    if there is None:
        path.unlink()
    else:
        path.write_bytes(there)
    assert sources() == before
    return changed


def test_a_plug_in_is_described_by_its_distribution_with_version_and_sources(site):
    install(site, "steady-law", "1.2", PARTS, plug_steady="x = 1\n")
    text = described("law", "steady")
    assert text == f"law steady: steady-law 1.2, sources {sources()}"
    assert len(sources()) == 12
    assert described("law", "yang_kim") == ""  # our own: the version of this program says it


def test_modules_that_the_distribution_brings_belong_to_it_and_those_of_others_do_not(site):
    install(
        site, "steady-law", "1.2", PARTS, plug_steady="x = 1\n", plug_helper="y = 1\n", plug_other="z = 1\n"
    )
    info(site, top_level_txt="plug_steady\nplug_helper\n")
    assert changes(site / "plug_steady.py")
    assert changes(site / "plug_helper.py")
    assert not changes(site / "plug_other.py")


def test_without_top_level_txt_the_record_says_which_modules_there_are(site):
    install(
        site, "steady-law", "1.2", PARTS, plug_steady="x = 1\n", plug_helper="y = 1\n", plug_other="z = 1\n"
    )
    info(site, RECORD="plug_steady.py,,\nplug_helper.py,,\n../../bin/plug_other.py,,\n")
    assert changes(site / "plug_helper.py")
    assert not changes(site / "plug_other.py")


@pytest.mark.parametrize("stated", [True, False])
def test_an_editable_distribution_is_read_where_its_sources_are(site, tmp_path_factory, monkeypatch, stated):
    """Its folder on the path has a .pth file instead of modules."""
    checkout = tmp_path_factory.mktemp("checkout") / "src"
    checkout.mkdir()
    monkeypatch.syspath_prepend(str(checkout))  # as Python does by the .pth file when it starts
    install(site, "steady-law", "1.2", PARTS)
    (site / "__editable__.steady_law-1.2.pth").write_text(f"{checkout}\n")
    info(site, RECORD="__editable__.steady_law-1.2.pth,,\nsteady_law-1.2.dist-info/RECORD,,\n")
    if stated:
        info(site, top_level_txt="plug_steady\nplug_tools\n")
    (checkout / "plug_steady.py").write_text("x = 1\n")
    (checkout / "plug_tools").mkdir()
    (checkout / "plug_tools" / "__init__.py").write_text("")
    assert changes(checkout / "plug_steady.py")
    assert changes(checkout / "plug_tools" / "filter.py")
    assert not changes(checkout / "README.txt")
    assert not changes(checkout / ".venv" / "lib.py")


def test_of_a_package_all_files_count_compiled_ones_and_data_too(site):
    package = site / "plug_steady"
    install(site, "steady-law", "1.2", {"steady": "plug_steady.laws.steady:Parameters"})
    for name in ("", "laws"):
        (package / name).mkdir()
        (package / name / "__init__.py").write_text("")
    (package / "laws" / "steady.py").write_text("x = 1\n")
    for name in ("helper.py", "deep/er/gains.toml", "weights.npy", f"fast{EXTENSION_SUFFIXES[0]}"):
        assert changes(package / name), name
    for name in ("__pycache__/helper.cpython-311.pyc", ".git/HEAD", "helper.py~", ".helper.py.swp"):
        assert not changes(package / name), name


def test_a_compiled_module_is_read_itself(site):
    install(site, "steady-law", "1.2", PARTS)
    built = site / f"plug_steady{EXTENSION_SUFFIXES[0]}"
    built.write_bytes(b"\x7fELF 1")
    assert changes(built)
    assert not changes(site / "plug_steady.pyx")  # what is not built again does not run


def test_of_a_namespace_that_others_share_only_the_package_of_the_plug_in_counts(site):
    install(site, "steady-law", "1.2", {"steady": "plug_shared.steady:Parameters"})
    for name in ("steady", "other"):
        (site / "plug_shared" / name).mkdir(parents=True)
        (site / "plug_shared" / name / "__init__.py").write_text("")
    assert changes(site / "plug_shared" / "steady" / "law.py")
    assert not changes(site / "plug_shared" / "other" / "law.py")


def test_the_same_sources_elsewhere_are_the_same(site, tmp_path_factory, monkeypatch):
    install(site, "steady-law", "1.2", PARTS, plug_steady="x = 1\n")
    here = described("law", "steady")
    other = tmp_path_factory.mktemp("other") / "deep"
    shutil.copytree(site, other)
    monkeypatch.setattr(sys, "path", [str(other), *(path for path in sys.path if path != str(site))])
    assert described("law", "steady") == here


def test_an_entry_point_that_cannot_be_loaded_is_described_too(site):
    """Nothing is imported for that."""
    parts = {"steady": "plug_absent:Parameters", "odd": "1 + 1"}
    install(site, "steady-law", "1.2", parts, plug_steady="raise RuntimeError")
    for name in parts:
        assert described("law", name).startswith(f"law {name}: steady-law 1.2, sources ")


@pytest.mark.parametrize("error", [AttributeError, ValueError])
def test_an_entry_point_without_a_module_is_described_whatever_its_library_raises(site, monkeypatch, error):
    """`importlib.metadata` raises AttributeError; the package `importlib_metadata`, once imported, ValueError."""

    def module(entry):
        raise error

    install(site, "steady-law", "1.2", {"odd": "1 + 1"})
    (entry,) = entries_of("mirotwin.laws", "odd")
    monkeypatch.setattr(type(entry), "module", property(module))
    assert described("law", "odd").startswith("law odd: steady-law 1.2, sources ")


def test_what_differs_from_a_recording_is_a_line_each(site):
    install(site, "steady-law", "1.2", PARTS, plug_steady="x = 1\n")
    now = described("law", "steady")
    recorded = [now, "law steady: steady-law 1.1, sources 0", "check absent: a 1, sources 1", "rubbish"]
    assert list(differences(recorded, described)) == [
        f"law steady is {now.partition(': ')[2]} instead of steady-law 1.1, sources 0",
        "check absent is not installed instead of a 1, sources 1",
    ]
