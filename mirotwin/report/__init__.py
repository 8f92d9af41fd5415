"""What a run amounts to, for people: summary, figure, firmware coverage."""
