"""The ground structure of Appendix C about the gunner, and the layout model that it makes."""
