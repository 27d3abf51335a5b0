"""Studies of papilla itself: verification against exact answers and hard cases."""
