"""Reading what a run has written."""


def written(folder, name):
    """Raw bytes of the values in a VTX file."""
    return b"".join(part.read_bytes() for part in (folder / name).glob("data.*"))
