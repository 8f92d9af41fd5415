"""A real robot on the desk: its serial port, the guards in front of it, and its answers beside those of the twin."""
