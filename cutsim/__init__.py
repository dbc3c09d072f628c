"""cutsim: cutting, tearing and blade penetration of soft solids on FEniCSx.

`__init__.pyi` lists what scripts import from here. Each name is loaded when it is first used: the command and its
completion answer without dolfinx, which takes a second to load.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
