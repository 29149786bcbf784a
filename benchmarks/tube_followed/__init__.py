"""How plans of hp-st are followed, as `certified_tube.py` and `certificates.py` both have it."""
