"""Trees from and to the files of robot engines: URDF, and the part of MJCF that a tree can hold."""
