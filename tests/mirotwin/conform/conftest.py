"""The command, called in this process."""

from tests.mirotwin.cli.conftest import mirotwin as mirotwin
