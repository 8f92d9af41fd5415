"""The paper's section V, run again: five figures, claims beside what was measured, and what a better chain gains."""
