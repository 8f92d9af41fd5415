"""The physical robot: motors, H-bridges, wheels, chassis and encoders behind `miro_robot.plant.Plant`."""
