"""Time histories of a campaign: encoding, database, those of older campaigns, looks at many runs at once."""
