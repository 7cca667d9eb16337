"""What is minimised: problems, load cases, transient responses and their peaks."""
