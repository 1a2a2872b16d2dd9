"""Lights: what they look like and where they are mounted; lamps and filters at hand."""
