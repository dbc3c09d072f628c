"""Conduction, and heat made and exchanged where surfaces meet."""
