"""The paper's section V reproduced: five figures, each claim beside the measurement, and the gain of a better chain."""
