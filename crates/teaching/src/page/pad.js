// A gamepad: the left stick moves over the table, the right one up, down and around; buttons close, record and undo. It vibrates at touches.

const DEAD = 0.15;
const NOTHING = { right: 0, away: 0, up: 0, turn: 0, presses: false };
let were = [];
let rumbled = 0;

/** Input of the first gamepad; `press` is called with the name of each pressed button. */
export function readPad(press) {
  const pad = navigator.getGamepads?.().find((one) => one?.connected);
  if (!pad) return NOTHING;
  const stick = (at) => {
    const value = pad.axes[at] || 0;
    return Math.abs(value) < DEAD ? 0 : Math.sign(value) * ((Math.abs(value) - DEAD) / (1 - DEAD)) ** 2 * 1.6;
  };
  const names = { 0: "close", 3: "next", 8: "undo", 9: "record" };
  pad.buttons.forEach((button, at) => {
    if (button.pressed && !were[at] && names[at]) press(names[at]);
  });
  were = pad.buttons.map((button) => button.pressed);
  return { right: stick(0), away: -stick(1), up: -stick(3), turn: stick(2), presses: were[1] || false };
}

/** Lets the gamepad tremble after the strongest force, N. */
export function rumble(force) {
  const pad = navigator.getGamepads?.().find((one) => one?.connected), now = performance.now();
  if (!pad?.vibrationActuator || now - rumbled < 100 || force < 0.05) return;
  rumbled = now;
  const strength = Math.min(1, force / 5);
  pad.vibrationActuator.playEffect?.("dual-rumble", { duration: 120, weakMagnitude: strength, strongMagnitude: strength * strength });
}
