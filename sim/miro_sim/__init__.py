"""The physical world and the clock: radio, motors, chassis, scheduler, scenarios, recording, command line."""

import miro_protocol  # noqa: F401  (puts the engine finder in place before any hot module loads)
