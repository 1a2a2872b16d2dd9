"""Objects: their typed description and their geometry."""
