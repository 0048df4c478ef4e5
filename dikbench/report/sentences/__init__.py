"""What a report says in words, from the numbers."""
