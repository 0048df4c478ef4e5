"""What a robot can run into: obstacles, its own bodies, pairs of them."""
