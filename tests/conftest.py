"""What all tests share: property tests without a time limit, and a garbage collector that passes over what stays.

Property tests take the same examples each time, so that a test that is red is red for everybody, and since the change
that made it so. `--hypothesis-profile=long` takes new ones, and ten times as many.

On a busy machine any example may be slow. Each process holds some 800,000 objects once it has collected the tests, all
of which stay until its end. Each full collection would walk through them; a pytest session in this process makes ten.
"""

import gc
import sys

from hypothesis import HealthCheck, settings

settings.register_profile("untimed", deadline=None, derandomize=True)
settings.load_profile("untimed")
settings.register_profile(
    "long",
    deadline=None,
    derandomize=False,
    max_examples=1000,
    print_blob=True,
    suppress_health_check=list(HealthCheck),
)


def pytest_sessionstart():
    gc.disable()


def pytest_collection_finish():
    gc.freeze()
    gc.enable()


def pytest_runtest_teardown(item, nextitem):
    """A command forgets the plug-ins that it took from files with its process; here tests of many files share one."""
    expect = sys.modules.get("mirotwin.verify.checks.expect")
    if expect is not None and (nextitem is None or nextitem.path != item.path):
        expect.CHECKS.in_files.clear()
    files = sys.modules.get("mirotwin.shell.plugin_files")
    if files is not None and (nextitem is None or nextitem.path != item.path):
        files.PluginFiles().bring()
