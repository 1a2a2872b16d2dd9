"""How bright points of the scene are: lights, reflectance, and the light that surfaces send to each other."""
