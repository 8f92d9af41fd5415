"""The programs of the PC: posture measurement, reference trajectories, controllers, integrator, station."""

import miro_exact  # noqa: F401  (puts the engine finder in place before any hot module loads)
