"""The radio between the PC and the robots: 9600 baud down to every robot of a network, a second band up.

What belongs here: levels on wires as a function of time, what disturbs them, the carrier and the noise without
one, and the PC's UART. What the bytes mean belongs to `miro_protocol`; who sends when to the station and the
firmware.
"""
