"""Recipes (`ice export`): what measures one picture at a known place with NumPy alone, made of a scene."""
