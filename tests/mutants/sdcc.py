"""The mark of tests that build firmware."""

import pytest

from tests.mutants.build import compiler

needs_sdcc = pytest.mark.skipif(
    not compiler(), reason="needs make and the SDCC of robot_fw/firmware/sdcc.version"
)
