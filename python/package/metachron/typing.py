"""Types of arguments and results."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = Sequence[float] | NDArray[np.floating[Any]]
"""A vector (x, y, z) or a quaternion (x, y, z, w): a list, a tuple or an array."""
