"""Board files: how the CPU, the two LM629 and the straps of a robot are wired, as data (see `miro_robot.wiring`)."""
