// Functions that show scenes in viser's client and move them (see static_scene.py).
// viser 1.1.1 exposes its message queue and its scene tree on the window for its own tests.

// Open the client (client_template) in an element, with the scene of a robot (StaticScene.data).
function openScene(host, client, data, dark = false) {
  const given = { data, dark, nonce: document.querySelector("script[nonce]")?.nonce ?? "" };
  const srcdoc = client.replace(/@@(data|dark|nonce)@@/g, (_, name) => given[name]);
  const frame = Object.assign(document.createElement("iframe"), { title: "Robot", tabIndex: -1, srcdoc });
  host.replaceChildren(frame);
  return frame;
}

// Whether the scene of a frame is there, so that it can be filled and moved.
const isSceneReady = ({ contentWindow: view }) =>
  Boolean(view?.__viserMutable && view.__viserSceneTree?.getState()["/target"]);

// Add what surrounds the robot (Surroundings.messages), or change what is there.
function send(frame, messages) {
  const viser = frame.contentWindow.__viserMutable;
  viser.messageQueue.push(...messages.map((message) => ({ owner: "", ...message })));
  viser.requestRender();
}

// Draw a line through points [[x, y, z], ...] in a colour [r, g, b] (0 to 255).
function drawLine(frame, name, points, colour) {
  const view = frame.contentWindow, ends = points.slice(1).flatMap((end, k) => [...points[k], ...end]);
  if (!ends.length) return;
  // Arrays of the frame's own realm: others are none to its React.
  const colors = new view.Uint8Array(ends.map((_, k) => colour[k % 3]));
  const props = { points: new view.Float32Array(ends), colors, thickness: 4, thickness_units: "screen", scale: 1 };
  send(frame, [{ type: "LineSegmentsMessage", name, virtual: false, props }]);
}

// Put the robot where the row c of joint_coordinates says, its joints [...] being those of the
// StaticScene, and colour its links: colours [[r, g, b], ...] by joint.
function moveRobot(frame, joints, c, colours = []) {
  const coloured = (frame.coloured ??= {});
  joints.forEach((joint, k) => {
    moveNode(frame, joint.node, jointPose(joint, c));
    if (!joint.body || !colours[k] || coloured[joint.body] === colours[k]) return;
    coloured[joint.body] = colours[k];
    send(frame, [{ type: "SceneNodeUpdateMessage", name: joint.body, updates: { color: colours[k] } }]);
  });
}

// Compute the pose [x, y, z, w, x, y, z] of a joint in its parent node (see MovingJoint).
function jointPose({ kind, column, axis, wxyz, turned, position }, c) {
  if (kind === "free") return c.slice(column, column + 7);
  const value = c[column], cosine = Math.cos(value / 2), sine = Math.sin(value / 2);
  return kind === "slide" ? [...position.map((start, i) => start + value * axis[i]), ...wxyz]
    : [...position, ...wxyz.map((part, i) => cosine * part + sine * turned[i])];
}

// Put a node, such as "/target", at a pose [x, y, z, w, x, y, z] in its parent.
function moveNode(frame, name, pose) {
  const norm = Math.hypot(...pose.slice(3));
  send(frame, [
    { type: "SetPositionMessage", name, position: pose.slice(0, 3) },
    { type: "SetOrientationMessage", name, wxyz: pose.slice(3).map((part) => part / norm) },
  ]);
}
