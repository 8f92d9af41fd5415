"""The wire between host and robot: frames, CRC, sans-IO decoder, command streams."""

import miro_exact  # noqa: F401  (puts the engine finder in place before any hot module loads)
