"""Two outer surfaces, meshed apart, that find each other under the law of an interface."""
