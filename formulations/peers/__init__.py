"""Other libraries as formulations, one per file: each calls the real one.

They stand in a table of their own, since "all formulations" are ours: studies, tuning and tests
that go over all of them do not depend on what is installed. A peer is named where it is wanted.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dikbench.problem import Formulation
from formulations.peers.peer_drake import PeerDrake
from formulations.peers.peer_drake_system import PeerDrakeSystem
from formulations.peers.peer_embodik import PeerEmbodik
from formulations.peers.peer_jparse import PeerJParse
from formulations.peers.peer_mink import PeerMink
from formulations.peers.peer_pink import PeerPink

PEERS: Mapping[str, type[Formulation]] = MappingProxyType(
    {
        "peer-pink": PeerPink,
        "peer-mink": PeerMink,
        "peer-drake": PeerDrake,
        "peer-drake-system": PeerDrakeSystem,
        "peer-embodik": PeerEmbodik,
        "peer-jparse": PeerJParse,
    }
)
