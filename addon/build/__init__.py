# SPDX-License-Identifier: GPL-3.0-or-later
"""What build.py does; standard library only."""

import platform
import sys

# Whatever is older cannot read the modules beside this one, which know all that is to be said.
if sys.version_info < (3, 9):  # noqa: UP036
    sys.exit(
        "build.py: Photon Stream needs Python 3.11 or Python 3.13; this is Python "
        + platform.python_version()
    )
