"""The flow around spheres: equations, meshes, discrete problem and its solution."""
