"""The only code that touches pymeshlab."""
