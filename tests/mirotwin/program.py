"""The program as tests call it: in their own process, and as one of its own."""

import sys

from click.testing import CliRunner

from mirotwin.commands import main
from tests import children

COMMAND = [sys.executable, "-c", "from mirotwin.entry import main; main()"]


class Program:
    """Calls a command in this process. Anything but a clean exit fails the test."""

    def __call__(self, *words, **more):
        """Exit code, stdout and stderr."""
        result = CliRunner().invoke(main, list(map(str, words)), **more)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.stdout, result.stderr

    def succeeds(self, *words, **more):
        """What is printed by a command that ends well and says nothing on stderr."""
        code, out, err = self(*words, **more)
        assert (code, err) == (0, ""), f"exit code {code}: {err}"
        return out

    def ends(self, code, *words, **more):
        """What is said on stderr by a command that ends with this exit code."""
        found, _, err = self(*words, **more)
        assert found == code, f"exit code {found}: {err}"
        return err

    def refuses(self, *words, **more):
        """The line of a command that takes its input for bad, without the `mirotwin: error: ` before it."""
        code, out, err = self(*words, **more)
        assert (code, out, err.count("\n")) == (2, "", 1), f"exit code {code}: {out}{err}"
        assert err.startswith("mirotwin: error: "), err
        return err.removeprefix("mirotwin: error: ").rstrip("\n")


mirotwin = Program()


def run(*words, **more):
    """Runs the program as a process of its own and gives what became of it, with what it said as text."""
    return children.run([*COMMAND, *map(str, words)], **{"capture_output": True, "text": True, **more})


def full_disk(size):
    """For `preexec_fn`: a limit on the length of files stands in for a disk that takes so much."""
    import resource  # only where there is a fork, too

    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
