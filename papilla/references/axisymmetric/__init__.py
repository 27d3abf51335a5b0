"""A finger of revolution and a block with another mesh and element: the reference for presses in three dimensions."""
