"""Heat: conduction in bodies, and heat that is generated and exchanged at contacts."""
