"""Drives a Handloft model server.

    with handloft.connect() as model:
        shape = model.dual_shape("top")
        shape.add_points([[0, 0, 0.03], [0.01, 0, 0.031]], pressure=0.8)

README.md has the rest.
"""

from handloft.errors import ConnectionLost, HandloftError, NotAdmitted, ProtocolError, Refused, ServerClosed, Timeout
from handloft.model import Model, Outcome, connect, new_client_key
from handloft.scene import Change, Entity, Scene, Surface
from handloft.shapes import DualShape

__version__ = "0.1.0"
__all__ = [
    "Change",
    "ConnectionLost",
    "DualShape",
    "Entity",
    "HandloftError",
    "Model",
    "NotAdmitted",
    "Outcome",
    "ProtocolError",
    "Refused",
    "Scene",
    "ServerClosed",
    "Surface",
    "Timeout",
    "connect",
    "new_client_key",
]
