"""CasADi's symbols belong to one thread at a time: `with SYMBOLS:` wherever threads may make any.

Compiled loops, and functions that are there already, may run in as many as one likes.
"""

from threading import RLock

SYMBOLS = RLock()
