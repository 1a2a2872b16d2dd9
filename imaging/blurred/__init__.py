"""The polygonal model of a picture under blur and square pixels, exact, with its derivatives."""
