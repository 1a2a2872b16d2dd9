"""Finding things in a photograph when no pose is known."""
