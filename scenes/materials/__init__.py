"""What surfaces are made of, what is printed on them, and which face is made of what."""
