"""Plugs for programs that know nothing of Mirotwin: `miro://` for pyserial, and PTY, TCP and RFC 2217 ports.

What belongs here: the robot's radio as a serial port, in virtual time (`serial_port`) or paced by the wall clock
(`session`). What does not: the world, recordings, and the command line (`serve_command`). Only `pacing` knows the wall
clock and threads.
"""
