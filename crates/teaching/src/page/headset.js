// WebXR: the person's own hands, tracked by a headset, are the hands of the scene. The scene stands in front of the person, at the height of a table.

import { add, product, scale, turn as turned, view } from "./space.js";
import { send } from "./socket.js";

/** The joint of each finger whose ball is the fingertip. */
const TIPS = { thumb: "thumb-tip", index: "index-finger-tip", middle: "middle-finger-tip", ring: "ring-finger-tip", little: "pinky-finger-tip" };
/** How high the table is, and how far in front of the person its middle, m. */
const TABLE = 0.8;
const AWAY = 0.45;

/** A point of the headset (x right, y up, z backwards) in the scene (x right, y away, z up). */
const toScene = ({ x, y, z }, origin) => add([x, -z, y], origin);

/** Offers the headset where there is one with hands. */
export function offerHeadset(button, stage, hands, page) {
  const { xr } = navigator;
  let session;
  const none = { isOn: () => Boolean(session) };
  if (!xr) return none;
  const kinds = ["immersive-ar", "immersive-vr"];
  Promise.all(kinds.map((kind) => xr.isSessionSupported(kind).catch(() => false))).then((supported) => {
    const kind = kinds[supported.indexOf(true)];
    button.hidden = !kind;
    button.onclick = () => (session ? session.end() : start(kind));
  });

  async function start(kind) {
    session = await xr.requestSession(kind, { requiredFeatures: ["hand-tracking", "local-floor"] });
    const { gl } = stage;
    await gl.makeXRCompatible?.();
    session.updateRenderState({ baseLayer: new XRWebGLLayer(session, gl), depthNear: 0.02, depthFar: 20 });
    const space = await session.requestReferenceSpace("local-floor");
    const middle = scale(add(stage.low, stage.high), 0.5);
    const origin = [middle[0], middle[1] - AWAY, stage.ground.z - TABLE];
    button.textContent = "End";
    hands.isTracked = true;
    session.addEventListener("end", () => {
      session = undefined;
      hands.isTracked = false;
      hands.epoch = undefined;
      button.textContent = "Use my own hands (headset)";
    });
    const frame = (now, xrFrame) => {
      session?.requestAnimationFrame(frame);
      page.turn(now);
      const viewer = xrFrame.getViewerPose(space), state = page.state();
      if (!state) return;
      track(xrFrame, space, origin);
      if (viewer) show(viewer, origin, state);
    };
    session.requestAnimationFrame(frame);
  }

  /** Sends where the fingertips are. A hand of which a joint is not seen sends nothing, and is held. */
  function track(xrFrame, space, origin) {
    for (const { hand, handedness } of session.inputSources) {
      const of = stage.scene.hands.find(({ side }) => side === handedness);
      if (!hand || !of) continue;
      const at = (joint) => {
        const pose = hand.get(joint) && xrFrame.getJointPose(hand.get(joint), space);
        return pose && toScene(pose.transform.position, origin);
      };
      const tips = of.fingers.map((finger) => at(TIPS[finger])), wrist = at("wrist"), knuckle = at("middle-finger-metacarpal") || wrist;
      if (tips.some((tip) => !tip) || !wrist) continue;
      const palm = scale(add(wrist, knuckle), 0.5);
      send({ type: "tips", hand: handedness, epoch: hands.epoch, tips, palm: [...palm, 1, 0, 0, 0] });
    }
  }

  /** Draws both eyes. */
  function show(viewer, origin, state) {
    const { gl } = stage, layer = session.renderState.baseLayer;
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    stage.clear();
    for (const eye of viewer.views) {
      const { x, y, width, height } = layer.getViewport(eye), { position, orientation } = eye.transform;
      const q = [orientation.w, orientation.x, orientation.y, orientation.z];
      const way = (axis) => {
        const [right, up, back] = turned(q, axis);
        return [right, -back, up];
      };
      const at = toScene(position, origin);
      const behind = way([0, 0, 1]), matrix = view(at, way([1, 0, 0]), way([0, 1, 0]), behind);
      stage.paintView(product(eye.projectionMatrix, matrix), [x, y, width, height], state, page.picture(state), behind);
    }
  }
  return none;
}
