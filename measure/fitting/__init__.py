"""A scene that is fitted to photographs of it."""
