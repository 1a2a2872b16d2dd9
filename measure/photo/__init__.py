"""A user's own photographs."""
