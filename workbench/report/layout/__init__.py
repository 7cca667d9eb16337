"""The section of the report on the layout, its drawings, and its bill of materials."""
