"""`mirotwin debug --dap` on its standard streams, with a copy of what it sends in the file that DAP_SENT names."""

import io
import os
import sys

from mirotwin.commands import main


class Copied(io.FileIO):
    """Standard output, and a file beside it."""

    def write(self, data):
        with open(os.environ["DAP_SENT"], "ab") as copy:
            copy.write(data)
        return super().write(data)


if __name__ == "__main__":
    sys.stdout = io.TextIOWrapper(io.BufferedWriter(Copied(1, "wb", closefd=False)), write_through=True)
    main(["debug", "--dap", *sys.argv[1:]])
