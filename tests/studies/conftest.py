from tests.coarse_pictures import coarse_pictures  # noqa: F401 - for every test here
