"""The command, called in this process."""

from tests.mirotwin.conftest import mirotwin as mirotwin
