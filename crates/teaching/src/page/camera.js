// A camera: the person's own hands, which MediaPipe Hands finds in its pictures, are the hands of the scene.
//
// The camera faces the person. Its frame has x to the right of the picture, y down and z away from the camera; it is turned into the scene so that the person
// sees her hands as in a mirror: x to her right, y away from her, z up. The pose of the camera is unknown: a hand that comes into view is taken to be where
// the hand of the scene is, and leads it from there.

import { add, dot, length, mix, scale, sub } from "./space.js";
import { send } from "./socket.js";

/** The landmark of each fingertip; landmarks 0 and 9 are the wrist and the knuckle of the middle finger. */
const TIPS = { thumb: 4, index: 8, middle: 12, ring: 16, little: 20 };
/** The tangent of half of the angle that a camera sees from left to right: 60°, as usual in laptops. */
const WIDE = Math.tan(Math.PI / 6);
/** From the wrist to the knuckle of the middle finger, m: of a hand of usual size. The size that a picture has of a hand is off by up to a third. */
const PALM = 0.092;
/** Number of pictures without a hand after which the hand counts as coming into view again. */
const LOST = 10;
/** How much less a point is smoothed while it moves, 1/m, and the least frequency that passes, Hz (Casiez et al. 2012). */
const BETA = 40, LEAST = 1.2;

const mean = (points) => scale(points.reduce(add), 1 / points.length);
const toScene = ([x, y, z]) => [-x, -z, -y];

/**
 * Where the landmarks of a hand are in the frame of the camera, m. `seen` are those in the picture, from 0 to 1 over its width and its height; `shape` are the
 * same in m, about a middle of the hand, and are made `larger` by this. A hand is small beside its distance: its size in the picture says how far away it is.
 */
export function located(seen, shape, aspect, larger) {
  const pictured = seen.map(({ x, y }) => [x - 0.5, (y - 0.5) / aspect, 0]), solid = shape.map(({ x, y, z }) => scale([x, y, z], larger));
  const middle = mean(pictured), center = mean(solid), focal = 0.5 / WIDE;
  let shared = 0, square = 0;
  solid.forEach((point, at) => {
    const [x, y] = sub(point, center);
    shared += dot([x, y, 0], sub(pictured[at], middle));
    square += x * x + y * y;
  });
  // A hand that points at the camera may have no size in the picture.
  const away = focal / Math.max(shared / square, focal / 3);
  return solid.map((point) => add(sub(point, center), scale([middle[0], middle[1], focal], away / focal)));
}

/** How long the palm of a shape is, m. */
const palmOf = (shape) => length(sub(...[shape[0], shape[9]].map(({ x, y, z }) => [x, y, z])));

/** A point without most of its noise: the 1 € filter. */
class Steady {
  next(point, seconds) {
    const part = (frequency) => 1 / (1 + 1 / (2 * Math.PI * frequency * seconds));
    if (!this.point) Object.assign(this, { point, speed: [0, 0, 0] });
    this.speed = mix(this.speed, scale(sub(point, this.point), 1 / seconds), part(1));
    this.point = mix(this.point, point, part(LEAST + BETA * length(this.speed)));
    return this.point;
  }
}

/** Offers the camera if the program has the hand tracker. */
export function offerCamera({ button, picture, status }, stage, hands) {
  const { camera, hands: inScene } = stage.scene, known = new Map();
  let stream, taken = 0;
  button.hidden = !camera || !navigator.mediaDevices;
  button.onclick = () => (stream ? end() : begin()).catch((error) => { end(); say(`No camera: ${error.message}`); });
  const say = (text) => { status.textContent = text; };

  async function begin() {
    say("Starting the camera …");
    button.disabled = true;
    const own = stream = await navigator.mediaDevices.getUserMedia({ video: { width: 640, height: 480, facingMode: "user" } });
    Object.assign(picture, { srcObject: stream, hidden: false });
    Object.assign(button, { textContent: "Stop the camera", disabled: false });
    await picture.play();
    const finder = await findsHands();
    // The person may have ended the camera in the meantime, and begun again.
    const isOn = () => stream === own;
    finder.onResults((found) => { if (isOn()) see(found, performance.now()); });
    hands.isTracked ||= isOn();
    while (isOn()) {
      await finder.send({ image: picture });
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    await finder.close();
  }

  async function end() {
    stream?.getTracks().forEach((track) => track.stop());
    stream = undefined;
    Object.assign(picture, { srcObject: null, hidden: true });
    known.clear();
    Object.assign(hands, { isTracked: false, epoch: undefined });
    Object.assign(button, { textContent: "Use my own hands (camera)", disabled: false });
    say("");
  }

  async function findsHands() {
    if (!window.Hands) {
      await new Promise((resolve, reject) => {
        const script = document.createElement("script");
        Object.assign(script, { src: "camera/hands.js", onload: resolve, onerror: () => reject(new Error("camera/hands.js was not loaded")) });
        document.head.append(script);
      });
    }
    const finder = new window.Hands({ locateFile: (name) => `camera/${name}` });
    finder.setOptions({ maxNumHands: inScene.length, modelComplexity: 1, minDetectionConfidence: 0.6, minTrackingConfidence: 0.6 });
    return finder;
  }

  /** Takes the hands that are in a picture, and leads those of the scene by them. A hand that is not seen is held. */
  function see({ multiHandLandmarks, multiHandWorldLandmarks, multiHandedness, image }, now) {
    const sides = [];
    taken++;
    multiHandedness.forEach(({ label }, at) => {
      // The names are those in a mirrored picture, and this one is not.
      const side = label === "Left" ? "right" : "left", index = inScene.findIndex((hand) => hand.side === side);
      if (index < 0 || sides.includes(side)) return;
      sides.push(side);
      const hand = comes(index, now), shape = multiHandWorldLandmarks[at];
      // The size that a hand seems to have is not that of one picture.
      hand.pictures = Math.min(hand.pictures + 1, 200);
      hand.palm += (palmOf(shape) - hand.palm) / hand.pictures;
      lead(index, hand, located(multiHandLandmarks[at], shape, image.width / image.height, PALM / hand.palm).map(toScene), now);
    });
    const wanted = inScene.map(({ side }) => side).filter((side) => !sides.includes(side));
    say(wanted.length ? `The camera does not see your ${wanted.join(" and ")} hand` : "");
  }

  /** The hand since it came into view. */
  function comes(index, now) {
    const { side } = inScene[index], last = known.get(side);
    if (last && taken - last.picture <= LOST && last.epoch === hands.epoch) return last;
    const hand = { epoch: hands.epoch, pictures: 0, palm: 0, picture: taken, seen: now - 33 };
    known.set(side, hand);
    return hand;
  }

  function lead(index, hand, points, now) {
    const { side, fingers } = inScene[index], is = hands.state?.hands[index];
    if (!is) return;
    const tips = fingers.map((finger) => points[TIPS[finger]]), palm = mean([points[0], points[9]]);
    hand.origin ??= sub(mean(is.tips), mean(tips));
    hand.steady ??= [palm, ...tips].map(() => new Steady());
    const seconds = Math.max(1e-3, (now - hand.seen) / 1000);
    Object.assign(hand, { seen: now, picture: taken, points });
    const [middle, ...ends] = [palm, ...tips].map((point, at) => hand.steady[at].next(add(point, hand.origin), seconds));
    send({ type: "tips", hand: side, epoch: hand.epoch, tips: ends, palm: [...middle, 1, 0, 0, 0] });
  }

  return { see, known };
}
