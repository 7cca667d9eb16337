"""What a person types and reads: commands, console, summaries, doctor, watching."""
