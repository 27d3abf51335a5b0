"""A finger of revolution and a block by another mesh and element: what presses in three dimensions are held to."""
