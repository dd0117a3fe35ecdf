"""How good a result is: against truth, against reference points, against each other."""
