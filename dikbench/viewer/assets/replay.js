// Functions that show scenes in viser's client and move them (see static_scene.py).
// viser 1.1.1 exposes its message queue and its scene tree on the window for its own tests.

// Open the client (client_html) in an element, with the scene of a robot (StaticScene.data).
function openScene(host, client, data, dark) {
  const frame = document.createElement("iframe"), nonce = document.querySelector("script[nonce]")?.nonce ?? "";
  const head = `<head><script nonce="${nonce}">window.__VISER_EMBED_DATA__="${data}";` +
    `window.__VISER_EMBED_CONFIG__={darkMode:${Boolean(dark)}};</scr` + `ipt>` +
    `<style>[class*=Notification],[aria-label="Show scene tree"]{display:none!important}</style>`;
  // A page that lets no script through but those with its nonce: the client's own, and what it adds.
  frame.srcdoc = client.replaceAll("<script ", () => `<script nonce="${nonce}" `)
    .replaceAll('("script");e.', () => `("script");e.nonce="${nonce}";e.`).replace("<head>", () => head);
  host.replaceChildren(frame);
  return frame;
}

// Whether the scene of a frame is there, so that it can be filled and moved.
function isSceneReady(frame) {
  const view = frame.contentWindow;
  return Boolean(view?.__viserMutable && view.__viserSceneTree?.getState()["/target"]);
}

// Add what surrounds the robot (Surroundings.messages).
function send(frame, messages) {
  const viser = frame.contentWindow.__viserMutable;
  viser.messageQueue.push(...messages);
  viser.requestRender();
}

// Draw a line through points [[x, y, z], ...] in a colour [r, g, b] (0 to 255).
function drawLine(frame, name, points, colour, thickness = 4) {
  const view = frame.contentWindow, n = points.length - 1;
  if (n < 1) return;
  // Arrays of the frame's own realm: others are none to its React.
  const ends = new view.Float32Array(6 * n), colours = new view.Uint8Array(6 * n);
  for (let k = 0; k < n; k++) {
    ends.set([...points[k], ...points[k + 1]], 6 * k);
    colours.set([...colour, ...colour], 6 * k);
  }
  send(frame, [{type: "LineSegmentsMessage", name, owner: "", virtual: false,
    props: {points: ends, colors: colours, thickness, thickness_units: "screen", scale: 1}}]);
}

// Put the robot where the row c of joint_coordinates says, its joints [...] being those of the
// StaticScene, and colour its links: colours [[r, g, b], ...] by joint.
function moveRobot(frame, joints, c, colours) {
  const messages = [];
  const turn = (name, wxyz) =>
    messages.push({type: "SetOrientationMessage", name, owner: "", wxyz});
  const shift = (name, position) =>
    messages.push({type: "SetPositionMessage", name, owner: "", position});
  frame.colours ??= [];
  joints.forEach((joint, k) => {
    const value = c[joint.column];
    if (joint.kind === "turn") {
      const s = Math.sin(value / 2), [x, y, z] = joint.axis;
      turn(joint.node, product([Math.cos(value / 2), s * x, s * y, s * z], joint.wxyz));
    } else if (joint.kind === "slide") {
      shift(joint.node, joint.position.map((start, i) => start + value * joint.axis[i]));
    } else {
      shift(joint.node, c.slice(joint.column, joint.column + 3));
      const wxyz = c.slice(joint.column + 3, joint.column + 7), norm = Math.hypot(...wxyz);
      turn(joint.node, wxyz.map(part => part / norm));
    }
    const colour = colours?.[k];
    if (joint.body && colour && String(colour) !== frame.colours[k]) {
      frame.colours[k] = String(colour);
      messages.push({type: "SceneNodeUpdateMessage", name: joint.body, owner: "",
        updates: {color: colour}});
    }
  });
  send(frame, messages);
}

// Put a node, such as "/target", at a pose [x, y, z, w, x, y, z] in its parent.
function moveNode(frame, name, pose) {
  const norm = Math.hypot(...pose.slice(3));
  send(frame, [
    {type: "SetPositionMessage", name, owner: "", position: pose.slice(0, 3)},
    {type: "SetOrientationMessage", name, owner: "", wxyz: pose.slice(3).map(part => part / norm)},
  ]);
}

// Product of two quaternions w, x, y, z.
function product([a, b, c, d], [w, x, y, z]) {
  return [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
    a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
}
