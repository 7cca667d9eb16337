"""What stands around the gunner and touches him, and which way he faces in it."""
