"""A trial in the browser, or in an HTML file."""

from __future__ import annotations

import html
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, Final

from dikbench.errors import DikbenchError
from dikbench.viewer.legend import LEGEND, captions
from dikbench.viewer.recording import Recording

PANE_HTML: Final = '<div style="position:fixed;left:1em;top:1em;font:14px sans-serif">{}</div>'
SWATCH_HTML: Final = '<p><span style="background:#{:06X}">&emsp;</span> {}</p>'


def write_replay(recording: Recording, speed: float, file: Path) -> None:
    """Write a replay as one HTML file with everything in it.

    Raises:
        DikbenchError: if meshcat is missing, or the file cannot be written.
    """
    with _scene(recording, speed) as viewer:
        page = viewer.static_html()
    told = "".join(f"<p>{html.escape(line)}</p>" for line in captions(recording, speed))
    told += "".join(SWATCH_HTML.format(colour, text) for colour, text in LEGEND)
    page = page.replace("<title>MeshCat</title>", f"<title>{recording.id}</title>")
    page = page.replace("</body>", f"{PANE_HTML.format(told)}</body>")
    try:
        file.write_text(page, encoding="utf-8")
    except OSError as error:
        raise DikbenchError(f"file {file}: {error.strerror or error}") from None


def serve_replay(recording: Recording, speed: float) -> None:
    """Open a replay in the browser and serve it until interrupted.

    Raises:
        DikbenchError: if meshcat is missing.
    """
    with _scene(recording, speed) as viewer:
        try:
            print(f"{viewer.url()} (Ctrl-C ends)", flush=True)
            viewer.open()
            while True:
                time.sleep(1)
        except KeyboardInterrupt:
            return


@contextmanager
def _scene(recording: Recording, speed: float) -> Iterator[Any]:
    """Start a viewer filled with a recording, and end its server afterwards."""
    try:
        import meshcat
    except ImportError:
        raise DikbenchError("a replay needs meshcat: pip install 'dikbench[replay]'") from None
    from dikbench.viewer.scene import build_scene

    with redirect_stdout(StringIO()):  # meshcat prints its address
        viewer = meshcat.Visualizer()
    try:
        build_scene(viewer, recording, speed)
        yield viewer
    finally:
        viewer.window.zmq_socket.close()
        viewer.window.server_proc.kill()
        viewer.window.server_proc.communicate()  # waits, and closes its pipes
