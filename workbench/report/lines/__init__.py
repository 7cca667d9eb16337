"""What the stages found, in lines of 80 columns: what a terminal prints, one file per stage."""
