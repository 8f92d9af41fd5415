"""What the PC makes of the camera's picture: regions of colour, robots, postures, and the calibration that it needs."""
