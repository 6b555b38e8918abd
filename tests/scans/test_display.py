import threading

import numpy as np
import pytest

from lubdub.geometry.surface import Surface, cloud
from lubdub.scans.display import begun


def test_the_skin_for_showing_is_made_beside_other_work() -> None:
    goes_on = threading.Event()

    def made() -> Surface:
        assert goes_on.wait(60)
        return cloud(np.eye(3))

    drape = begun(made)
    goes_on.set()
    assert drape() is drape(), "it is made once"


def test_what_goes_wrong_with_the_skin_is_told_to_whoever_wants_it() -> None:
    def fails() -> Surface:
        raise MemoryError("too many points")

    drape = begun(fails)
    with pytest.raises(MemoryError, match="too many points"):
        drape()
