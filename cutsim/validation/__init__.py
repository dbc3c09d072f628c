"""Validation: rows that compare results of runs with references, what was found, and the page that is made of it."""
