"""Settings of all tests."""

import os

from hypothesis import settings

# The gate must not fail by chance: there every property test tries the same examples each time.
settings.register_profile("gate", derandomize=True, print_blob=True)
if os.environ.get("CI"):
    settings.load_profile("gate")
