"""Every way to simplify a cloud: one module a method, each with a function ``rank``."""
