"""Pairs of outer surfaces with different meshes that find each other, under the law of an interface."""
