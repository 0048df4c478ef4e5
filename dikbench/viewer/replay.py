"""Trials in the browser, or in an HTML file."""

from __future__ import annotations

import html
import time
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.viewer.frames import FRAMES_PER_SECOND
from dikbench.viewer.legend import captions, legend
from dikbench.viewer.recording import Recording
from dikbench.viewer.replay_scene import ReplayScene
from dikbench.viewer.viser_client import HOST, viser_server

if TYPE_CHECKING:
    import viser

PANE_HTML: Final = (
    # The client warns of slow graphics where the pane is.
    "<style>[class*=Notification]{{display:none!important}}</style>"
    '<div style="position:fixed;left:1em;top:1em;max-width:26em;z-index:9;font:13px sans-serif;'
    'color:#222;background:#fffc;padding:.2em .8em;border-radius:6px">{}</div>'
)

SWATCH_HTML: Final = (
    '<p style="margin:.3em 0"><span style="background:rgb{};border-radius:2px">&emsp;</span> {}</p>'
)

REST_S: Final = 1.0
"""Time at the end before a replay begins anew."""

SPEEDS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Speeds to choose from, beside the one that was asked for."""


def write_replay(recordings: list[Recording], speed: float, file: Path) -> None:
    """Write a replay of trials side by side as one HTML file with everything in it.

    Raises:
        DikbenchError: if viser is missing, or the file cannot be written.
    """
    with viser_server() as server:
        scene = ReplayScene(server, recordings, speed)
        recorded = server.get_scene_serializer()
        for frame, seconds in enumerate(np.diff(scene.times) / speed, start=1):
            recorded.insert_sleep(float(seconds))
            scene.show(frame)
        recorded.insert_sleep(REST_S)
        page = recorded.as_html()
    title = html.escape(" and ".join(recording.id for recording in recordings))
    page = page.replace("<title>Viser</title>", f"<title>{title}</title>", 1)
    pane = PANE_HTML.format(_told(recordings, speed))
    before, body, after = page.rpartition("</body>")
    try:
        file.write_text(f"{before}{pane}{body}{after}", encoding="utf-8")
    except OSError as error:
        raise DikbenchError(f"file {file}: {error.strerror or error}") from None


def serve_replay(recordings: list[Recording], speed: float) -> None:
    """Open a replay of trials side by side in the browser and serve it until interrupted.

    Raises:
        DikbenchError: if viser is missing.
    """
    with viser_server() as server:
        scene = ReplayScene(server, recordings, speed)
        bar = _Bar(server, scene, speed, _told(recordings, speed))
        address = f"http://{HOST}:{server.get_port()}"
        try:
            print(f"{address} (Ctrl-C ends)", flush=True)
            webbrowser.open(address)
            bar.play()
        except KeyboardInterrupt:
            return


class _Bar:
    """The controls of a replay that is served: time, pause, speed."""

    def __init__(
        self, server: viser.ViserServer, scene: ReplayScene, speed: float, told: str
    ) -> None:
        self._server, self._scene, gui = server, scene, server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_layout="fixed")
        end = float(scene.times[-1])
        # Its value is writable, which mypy does not see.
        self._time: Any = gui.add_slider(
            "time [s]", min=0.0, max=end, step=0.001, initial_value=0.0
        )
        self._playing = gui.add_checkbox("play", initial_value=True)
        speeds = [f"{each:g}" for each in sorted({*SPEEDS, speed})]
        self._speed = gui.add_dropdown("speed", speeds, initial_value=f"{speed:g}")
        gui.add_html(f'<div style="padding:.6em 1em;font-size:13px">{told}</div>')

    def play(self) -> None:
        """Move the scene with the time, over and over, until interrupted."""
        times, shown, before, bar = self._scene.times, 0, time.monotonic(), self._time
        end = float(times[-1])
        while True:
            time.sleep(1 / FRAMES_PER_SECOND)
            now = time.monotonic()
            if self._playing.value:
                at = bar.value + (now - before) * float(self._speed.value)
                bar.value = 0.0 if bar.value >= end else min(at, end)
            before = now
            frame = int(np.abs(times - bar.value).argmin())
            if frame != shown:
                with self._server.atomic():
                    self._scene.show(frame)
                shown = frame


def _told(recordings: list[Recording], speed: float) -> str:
    """Say in HTML what is shown and what the colours mean."""
    told = [html.escape(line) for each in recordings for line in captions(each, speed)]
    lines = "".join(f'<p style="margin:.5em 0;overflow-wrap:anywhere">{line}</p>' for line in told)
    return lines + "".join(SWATCH_HTML.format(colour, text) for colour, text in legend(recordings))
