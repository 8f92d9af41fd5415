"""The robot's electronics: AT89C52, LM629, the board that wires them, and the firmware image."""

import miro_exact  # noqa: F401  (puts the engine finder in place before any hot module loads)
