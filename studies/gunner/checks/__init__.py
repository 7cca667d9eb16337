"""Tables of what the gunner shows beside what he was asked to show, over everything else of the study."""
