"""What asks for other versions than nondum has lies beside the environment."""

from __future__ import annotations

import sys

from nondum_dev.places import BESIDE

sys.path.append(str(BESIDE))
