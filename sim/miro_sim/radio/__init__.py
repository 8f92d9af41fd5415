"""The radio between the PC and the robots: 9600 baud down to every robot of a network, a second band up.

What belongs here: levels on wires as a function of time, bit errors, the carrier and the noise without one,
and the PC's UART. What the bytes mean belongs to `miro_protocol`; who sends when to the station and the
firmware.
"""

from miro_sim.radio.downlink import Downlink, Listener
from miro_sim.radio.params import RadioParams, error_threshold
from miro_sim.radio.uplink import Uplink

__all__ = ["Downlink", "Listener", "RadioParams", "Uplink", "error_threshold"]
