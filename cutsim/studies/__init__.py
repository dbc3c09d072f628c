"""Ready-made problems and what is read off them: the blade cut, fracture parameters."""
