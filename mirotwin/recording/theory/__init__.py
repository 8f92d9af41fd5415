"""The paper's theory along a run: what is kept of each control period, and the figures that it comes to."""
