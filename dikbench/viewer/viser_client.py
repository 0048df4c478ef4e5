"""viser's client, and servers in which scenes are built."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from dikbench.errors import DikbenchError

if TYPE_CHECKING:
    import viser

INSTALL: Final = "a replay needs viser: pip install 'dikbench[replay]'"

HOST: Final = "127.0.0.1"

_GIVEN: Final = (
    '<script nonce="@@nonce@@">window.__VISER_EMBED_DATA__="@@data@@";'
    "window.__VISER_EMBED_CONFIG__={darkMode:@@dark@@};</script>"
    # It warns of slow graphics, and would show a list of nodes.
    '<style>[class*=Notification],[aria-label="Show scene tree"]{display:none!important}</style>'
)


def has_viser() -> bool:
    """Whether viser is installed."""
    return find_spec("viser") is not None


def client_template() -> str:
    """Read the client of the installed viser: one HTML page of 0.8 MB that needs nothing else.

    In it stand `@@data@@` for a scene (see `StaticScene`), `@@dark@@` for whether it is dark (true
    or false), and `@@nonce@@` for that of the scripts of the page in whose frame it is put: such a
    page lets no others through, neither the client's own nor those that it adds.

    Raises:
        DikbenchError: if viser is missing.
    """
    spec = find_spec("viser")
    if spec is None or spec.origin is None:
        raise DikbenchError(INSTALL)
    file = Path(spec.origin).parent / "client" / "build" / "index.html"
    client = file.read_text(encoding="utf-8").replace("<script ", '<script nonce="@@nonce@@" ')
    client = client.replace('("script");e.', '("script");e.nonce="@@nonce@@";e.')
    return client.replace("<head>", f"<head>{_GIVEN}", 1)


@contextmanager
def viser_server() -> Iterator[viser.ViserServer]:
    """Start a viser server on a free port of this machine, and stop it afterwards.

    A scene can be built and serialised in no other way; this takes 10 ms.

    Raises:
        DikbenchError: if viser is missing.
    """
    try:
        import viser
    except ImportError:
        raise DikbenchError(INSTALL) from None
    said = StringIO()  # its address, in a frame
    with redirect_stdout(said):
        server = viser.ViserServer(host=HOST, verbose=False)
    try:
        server.scene.set_up_direction("+z")
        server.scene.configure_default_lights(cast_shadow=False)  # half the time of a frame
        yield server
    finally:
        with redirect_stdout(said):
            server.stop()


def messages_of(server: viser.ViserServer) -> list[dict[str, Any]]:
    """Return what makes the scene of a server, as the messages that its client takes.

    The scene must be of shapes and frames, without arrays, so that all is JSON.
    """
    import zstandard

    # Eight bytes of length, then compressed: eight bytes of length, msgpack, arrays.
    recording = server.get_scene_serializer().serialize()
    content = zstandard.ZstdDecompressor().decompress(recording[8:])
    end = 8 + int.from_bytes(content[:8], "little")
    unpacked = msgspec.msgpack.decode(content[8:end])
    assert not unpacked["binaryBufferLengths"]
    return [message for _, message in unpacked["messages"]]
