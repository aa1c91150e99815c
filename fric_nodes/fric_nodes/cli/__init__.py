"""The command line: one thin file per verb, each with a function ``register(app)``."""
