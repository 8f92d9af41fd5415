"""The paper's theory along a run: values saved in each control period, and the resulting figures."""
