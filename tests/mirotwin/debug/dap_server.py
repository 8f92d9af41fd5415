"""`mirotwin debug --dap` on its standard streams, with a copy of what it sends in the file that DAP_SENT names."""

import io
import os
import sys

from mirotwin.commands import main


class Copied(io.RawIOBase):
    """Standard output, and a file beside it."""

    def __init__(self, stream, path):
        self.stream = stream
        self.copy = open(path, "ab", buffering=0)  # noqa: SIM115

    def writable(self):
        return True

    def write(self, data):
        self.copy.write(data)
        return self.stream.write(data)

    def flush(self):
        self.stream.flush()


if __name__ == "__main__":
    if "DAP_SENT" in os.environ:
        plain = open(1, "wb", buffering=0, closefd=False)  # noqa: SIM115
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(Copied(plain, os.environ["DAP_SENT"])), write_through=True
        )
    main(["debug", "--dap", *sys.argv[1:]])
