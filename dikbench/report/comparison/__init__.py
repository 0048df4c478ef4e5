"""Two results folders side by side: what became worse, better, slower, and by how much."""
