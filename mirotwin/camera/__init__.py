"""Camera commands: show a camera picture, run the tracker on pictures, calibrate from control points."""
