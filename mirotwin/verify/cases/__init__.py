"""Cases: a failure as one text file that gives it again."""
