"""The physical world and its clock: scenarios, radio, motors, chassis, pitch, and the order in which they move."""

import miro_exact  # noqa: F401  (puts the engine finder in place before any hot module loads)
