"""The page itself: template, style and scripts, and the blocks that the sections are written with."""
