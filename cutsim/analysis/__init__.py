"""The sum of the terms, the energy audit, and the loop over steps."""
