"""What a run or a firmware has to fulfil: checks, steps, cases, conformance."""
