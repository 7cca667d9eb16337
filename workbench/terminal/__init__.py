"""What a person types and reads: commands, progress, doctor, watching."""
