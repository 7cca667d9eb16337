"""What comes out of a layout optimisation: result, history, verdicts, optimality, purified layouts."""
