"""Analysis: mechanics and heat as sums of terms, the energy audit, and the loop over steps."""
