"""Processing of the camera's picture on the PC: regions of colour, robots, postures, and calibration."""
