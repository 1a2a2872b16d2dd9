"""Where points of the scene land in the image, and what hides them: poses, projection, lens, rays, visibility."""
