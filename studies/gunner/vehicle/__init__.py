"""The vehicle: sprung body, corners, tyres and shell, its states, and what it is held against."""
