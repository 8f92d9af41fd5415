"""Workers of a Dask scheduler that is running already.

The extra `cluster` brings Dask. Workers need mirotwin in the same version with the same sources; images that are not
the robot's own have to stand under the same path on each of them. Scenarios travel with the jobs.
"""

from __future__ import annotations

import logging
from concurrent.futures import Executor
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from miro_exact.bad_input import BadInput
from mirotwin.campaign.versions import Versions, versions
from mirotwin.campaign.workers import AHEAD, Workers

PATIENCE_S = 5
OPTION = "--cluster"


class Cluster(Workers):
    """The workers of the scheduler at `address` (tcp://host:8786). Raises BadInput where it does not answer."""

    option = OPTION
    gone = (*Workers.gone, TypeError)  # Dask raises it of a result whose scheduler ends at that moment

    def __init__(self, address: str) -> None:
        super().__init__()
        self.address = address
        self.client = _connected(address)
        try:
            threads = self._check()
        except BaseException:
            self.client.close()
            raise
        self.ahead = AHEAD * threads
        self.ended = (_killed_worker(),)

    def start(self) -> Executor:
        found: Executor = self.client.get_executor(pure=False)
        return found

    def stop(self, executor: Executor) -> None:
        executor.shutdown(wait=False)

    def close(self) -> None:
        self.client.close()

    def _check(self) -> int:
        """Refuses workers that are not like this process, by name; returns how many jobs they do at once."""
        threads_of: dict[str, int] = self.client.nthreads()
        if not threads_of:
            what = f"the scheduler at {self.address} has no workers"
            raise BadInput("", OPTION, what, f"start some: dask worker {self.address}")
        expected = ours()
        found = self.client.run(versions, on_error="return")
        for address, theirs in sorted(found.items()):
            if isinstance(theirs, BaseException):
                what = f"worker {address} cannot load mirotwin: {theirs}"
                raise BadInput("", OPTION, what, "install there what runs here")
            difference = expected.difference(theirs)
            if difference:
                raise BadInput(
                    "", OPTION, f"worker {address} has {difference}", "install there what runs here"
                )
        threads = 0
        for count in threads_of.values():
            threads += count
        return threads


def ours() -> Versions:
    """What workers have to be like."""
    return versions()


def _connected(address: str) -> Any:
    if find_spec("distributed") is None:
        raise BadInput("", OPTION, "Dask is not installed", "pip install 'mirotwin[cluster]'")
    client_type: Any = import_module("distributed").Client  # has no types

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it says is said here, in one line
    if not address.strip():  # it would start one
        raise _no_answer(address, "the address is empty")
    client = client_type.__new__(client_type)
    try:
        client.__init__(address, timeout=PATIENCE_S, set_as_default=False)
        return client
    except (OSError, ValueError, TypeError) as error:
        # Collected later, it would close itself, perhaps while the next one holds the lock of Dask's event loop.
        with suppress(Exception):
            client.close()
        raise _no_answer(address, f"{error}".partition("\n")[0] or type(error).__name__) from None


def _no_answer(address: str, reason: str) -> BadInput:
    what = f"no Dask scheduler answers at {address}: {reason}"
    return BadInput("", OPTION, what, "start one (dask scheduler), or leave --cluster out")


def _killed_worker() -> type[Exception]:
    """A job whose workers ended, several times."""
    found: type[Exception] = import_module("distributed.scheduler").KilledWorker
    return found
