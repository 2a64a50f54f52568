"""The command line: one module a command, each parsing, calling and printing, nothing else."""
