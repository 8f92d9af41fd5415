"""The paper's theory along a run: what is saved of each control period, and the figures that it comes to."""
