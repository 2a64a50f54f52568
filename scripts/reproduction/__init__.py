"""The parts of ``reproduce_paper.py``: subjects, measurements, figures and the document."""
