"""The velocity table: velocities of three spheres at any two distances."""
