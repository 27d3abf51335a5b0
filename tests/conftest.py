"""What all tests share: a cache of their own, so that nothing is read from or written to the user's."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory):
    """The cache of this session; meshes and reduced fingers are made once for all tests."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PAPILLA_CACHE", str(folder))
        patch.setenv("MPLBACKEND", "Agg")
        yield folder
