"""Files that somebody else has written: texts, images and what they say of themselves."""
