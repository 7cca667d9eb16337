"""Laws of members, joints, bushings and prescribed motion: numbers in, forces and slopes out; a file each."""
